import "./style.css";
import { data } from "./data.js";
import { el } from "./dom.js";
import { DesignView } from "./design.js";
import { LiveView } from "./live.js";
import { RcsView } from "./rcs.js";
import { RunView } from "./run.js";
import { ThingView } from "./scene.js";
import { StudyView } from "./study.js";

const KEYS = { run: "space play · ← → frames · n p points · 1–4 panes · r behind · t above · d dark or light · Esc nothing chosen", rcs: "d dark or light", design: "Ctrl+Z undo · Ctrl+Y redo · r along the strongest direction · d dark or light", study: "n p studies · l lines · m map · d dark or light · Esc no row", live: "Ctrl+Z undo · Ctrl+Y redo · space play · ← → frames · n p points · 1–4 panes · r behind · t above · d dark or light", scene: "r all of it · d dark or light · Esc back" };

const dark = window.matchMedia("(prefers-color-scheme: dark)");
let theme = dark.matches ? "dark" : "light";
document.documentElement.dataset.theme = theme;
const view = new { run: RunView, rcs: RcsView, scene: ThingView, study: StudyView, design: DesignView, live: LiveView }[data.kind]();

function change_theme() {
  theme = theme === "dark" ? "light" : "dark";
  document.documentElement.dataset.theme = theme;
  view.theme();
}

const engine = data.about?.engine;
document.body.append(
  el("header", {}, el("h1", {}, data.title), el("span", { class: "about" }, data.about ? [`catseye ${data.about.catseye}`, engine?.adapter ?? engine?.engine, data.about.seed != null && `seed ${data.about.seed}`].filter(Boolean).join(" · ") : ""),
    el("span", { class: "keys" }, KEYS[data.kind]), el("button", { onclick: change_theme, title: "Dark or light (d)" }, "◐")),
  view.element);
if (data.about?.remarks?.length) document.querySelector("header").append(el("span", { class: "remarks", title: data.about.remarks.join("\n") }, `${data.about.remarks.length} remarks`));

document.addEventListener("keydown", (e) => {
  if ((e.ctrlKey || e.metaKey) && view.shortcut?.(e)) return e.preventDefault();
  if (e.target.closest("select, textarea, input:not([type=checkbox])") || e.ctrlKey || e.metaKey || e.altKey) return;
  if (e.key === "d") change_theme();
  else view.key_press(e);
});

// For tests and for those who script the page.
window.catseye = { data, view, ready: false };
view.start().then(() => (window.catseye.ready = true), (e) => {
  view.element.replaceChildren(el("p", { class: "missing" }, `This page cannot start: ${e.message}`));
});
