// A scenario that is changed in the page. The program that serves the page simulates it anew after each change.

import { data, renew, unit, words } from "./data.js";
import { el, number } from "./dom.js";
import { RunView } from "./run.js";
import { numbersOf, withNumber } from "./toml.js";

/** Typing waits so long for its next letter before it is simulated, ms. */
const PAUSE_MS = 400;

export class LiveView {
  constructor() {
    this.text = data.text;
    this.kept = data.text;
    this.past = [];
    this.future = [];
    this.form = el("form", { class: "controls", onsubmit: (e) => e.preventDefault() });
    this.editor = el("textarea", { spellcheck: false, wrap: "off", "aria-label": "the scenario as text", oninput: () => this.typed() });
    this.told = el("p", { class: "told", role: "status" });
    this.note = el("p", { class: "hint", role: "status" });
    const button = (text, title, act) => el("button", { type: "button", title, onclick: act }, text);
    this.switch = button("text", "The scenario as text, or its numbers with sliders", () => this.turn());
    this.tools = el("div", { class: "tools" }, this.switch, button("↶", "Undo (Ctrl+Z)", () => this.undo()), button("↷", "Redo (Ctrl+Y)", () => this.redo()),
      button("as it was", "The scenario as the program was given it", () => this.set(data.text)), button("save TOML", "The scenario with its changes, as a file", () => this.save()));
    this.editor.hidden = true;
    this.bench = el("section", { class: "bench" }, this.tools, this.told, this.form, this.editor, this.note);
    this.place = el("section", { class: "place" }, el("p", { class: "missing" }, "The first frame is being simulated."));
    this.element = el("main", { class: "live" }, this.bench, this.place);
    // The text and its file do not change with what is simulated.
    this.first = { text: data.text, file: data.file };
  }

  async start() {
    this.make_form();
    await this.simulate();
  }

  /** Whether the text is shown in place of its numbers. */
  turn() {
    this.editor.hidden = !this.editor.hidden;
    this.form.hidden = !this.editor.hidden;
    this.switch.textContent = this.editor.hidden ? "text" : "numbers";
    if (this.editor.hidden) this.make_form();
    else this.editor.value = this.text;
  }

  typed() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.set(this.editor.value, false, true), PAUSE_MS);
  }

  /** Another text, which can be taken back; `moving` while a slider moves, `own` where it comes from the editor. */
  set(text, moving = false, own = false) {
    if (text === this.text) return;
    if (!moving || !this.moving) this.past.push(this.text);
    this.moving = moving;
    this.future = [];
    this.take(text, moving, own);
  }

  take(text, moving, own) {
    this.text = text;
    if (!moving && this.editor.hidden) this.make_form();
    if (!own) this.editor.value = text;
    this.simulate();
  }

  undo() {
    if (!this.past.length) return;
    this.future.push(this.text);
    this.take(this.past.pop());
  }

  redo() {
    if (!this.future.length) return;
    this.past.push(this.text);
    this.take(this.future.pop());
  }

  make_form() {
    const groups = [];
    const all = numbersOf(this.text);
    all.forEach((n, k) => {
      if (groups.at(-1)?.table !== n.table) groups.push({ table: n.table, rows: [] });
      const several = all.filter((m) => m.table === n.table && m.key === n.key).length > 1;
      groups.at(-1).rows.push(this.row(k, n, several));
    });
    this.form.replaceChildren(...groups.flatMap((g) => [el("h3", {}, g.table || "scenario"), ...g.rows]));
    this.judge();
  }

  /** A slider and a field for one number. The slider spans the number as it was given, once to each side; the field takes any. */
  row(k, n, several) {
    const given = Number(this.text.slice(n.from, n.to).replaceAll("_", ""));
    const whole = !/[.eE]/.test(this.text.slice(n.from, n.to));
    const span = n.key.endsWith("_deg") ? 180 : Math.max(Math.abs(given), whole ? 10 : 1);
    const [low, high] = [given - span, given + span];
    const put = (text, moving) => this.set(withNumber(this.text, numbersOf(this.text)[k], text), moving);
    const name = `${words(n.key)}${several ? ` ${n.place + 1}` : ""}`;
    const label = `${n.table} ${n.key}${several ? ` ${n.place + 1}` : ""}`.trim();
    const field = el("input", { type: "text", inputMode: "decimal", value: this.text.slice(n.from, n.to), "aria-label": label, title: label, onchange: () => {
      const text = field.value.trim().replace(",", ".");
      if (!Number.isFinite(Number(text)) || text === "") {
        field.setAttribute("aria-invalid", "true");
        this.told.textContent = `${label} = ${field.value}: not a number`;
      } else put(text, false);
    } });
    const slider = el("input", { type: "range", min: 0, max: 1000, value: 500, "aria-label": `${label} by a slider`, title: label, oninput: () => {
      const v = low + ((high - low) * Number(slider.value)) / 1000;
      field.value = whole ? String(Math.round(v)) : String(Number(v.toPrecision(4)));
      put(field.value, true);
    }, onchange: () => { this.moving = false; } });
    const row = el("label", { class: "row", title: label }, el("span", {}, `${name}${unit(n.key) ? ` / ${unit(n.key)}` : ""}`), slider, field);
    row.dataset.line = n.line;
    return row;
  }

  /** Has the program simulate the text; of several changes in the meantime only the last. */
  async simulate() {
    if (this.busy) {
      this.again = true;
      return;
    }
    this.busy = true;
    this.element.classList.add("busy");
    const began = performance.now();
    const text = this.text;
    try {
      const answer = await fetch("simulate", { method: "POST", headers: { "Content-Type": "text/plain; charset=utf-8" }, body: text });
      const told = await answer.json();
      if (told.error) this.complain(told.error);
      else {
        this.complain("");
        await this.show(told);
        this.note.textContent = `Simulated in ${number(told.seconds, 2)} s, drawn after ${number((performance.now() - began) / 1000, 2)} s.`;
      }
    } catch (e) {
      this.complain(`The program that serves this page does not answer (${e.message}). Start catseye view --live again; the scenario can be saved here.`);
    }
    this.busy = false;
    this.element.classList.remove("busy");
    this.done = (this.done ?? 0) + 1;
    if (this.again) {
      this.again = false;
      await this.simulate();
    }
  }

  async show(told) {
    const same = this.view && JSON.stringify(data.radars?.map((r) => r.name)) === JSON.stringify(told.data.radars.map((r) => r.name));
    renew(told.data, told.frames);
    if (same) return this.view.renew();
    this.view = new RunView();
    this.place.replaceChildren(this.view.element);
    await this.view.start();
  }

  complain(text) {
    this.told.textContent = text;
    // Errors name file and line.
    const line = /:(\d+)(?::|\b)/.exec(text)?.[1];
    this.wrong = text.includes(this.first.file) ? line : undefined;
    this.judge();
  }

  judge() {
    for (const row of this.form.querySelectorAll(".row")) {
      const field = row.querySelector('input[type="text"]');
      if (this.wrong && row.dataset.line === this.wrong) field.setAttribute("aria-invalid", "true");
      else field.removeAttribute("aria-invalid");
    }
  }

  save() {
    const link = el("a", { href: URL.createObjectURL(new Blob([this.text], { type: "application/toml" })), download: this.first.file });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }

  key_press(e) {
    this.view?.key_press(e);
  }

  shortcut(e) {
    if (e.target === this.editor) return false;
    if (e.key === "z") this.undo();
    else if (e.key === "y") this.redo();
    else return false;
    return true;
  }

  theme() {
    this.view?.theme();
  }
}
