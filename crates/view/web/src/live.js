// A scenario that is changed in the page. The program that serves the page simulates it anew after each change.

import { data, renew, unit, words } from "./data.js";
import { el, number } from "./dom.js";
import { RunView } from "./run.js";
import { NUMBER, numbersOf, put } from "./toml.js";

/** Typing waits so long for its next letter before it is simulated, ms. */
const PAUSE_MS = 400;

export class LiveView {
  constructor() {
    // The first text and the file's name do not change with what is simulated.
    this.first = { text: data.text, file: data.file };
    this.text = data.text;
    this.past = [];
    this.future = [];
    this.form = el("form", { class: "controls", onsubmit: (e) => e.preventDefault() });
    this.editor = el("textarea", { spellcheck: false, wrap: "off", "aria-label": "the scenario as text", oninput: () => this.typed() });
    this.told = el("p", { class: "told", role: "status" });
    this.note = el("p", { class: "hint", role: "status" });
    const button = (text, title, act) => el("button", { type: "button", title, onclick: act }, text);
    this.switch = button("text", "The scenario as text, or its numbers with sliders", () => this.turn());
    this.tools = el("div", { class: "tools" }, this.switch, button("↶", "Undo (Ctrl+Z)", () => this.undo()), button("↷", "Redo (Ctrl+Y)", () => this.redo()),
      button("as it was", "The scenario as the program was given it", () => this.set(this.first.text)), button("save TOML", "The scenario with its changes, as a file", () => this.save()));
    this.editor.hidden = true;
    this.bench = el("section", { class: "bench" }, this.tools, this.told, this.form, this.editor, this.note);
    this.place = el("section", { class: "place" }, el("p", { class: "missing" }, "The first frame is being simulated."));
    this.element = el("main", { class: "live" }, this.bench, this.place);
  }

  async start() {
    this.make_form();
    await this.simulate();
  }

  /** Whether the text is shown in place of its numbers. */
  turn() {
    this.settle();
    this.editor.hidden = !this.editor.hidden;
    this.form.hidden = !this.editor.hidden;
    this.switch.textContent = this.editor.hidden ? "text" : "numbers";
    if (this.editor.hidden) this.make_form();
    else this.editor.value = this.text;
  }

  typed() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.settle(), PAUSE_MS);
  }

  /** Takes what was typed into the text up to now. */
  settle() {
    clearTimeout(this.timer);
    if (!this.editor.hidden) this.set(this.editor.value, false, true);
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
    try {
      this.numbers = numbersOf(this.text);
    } catch (e) {
      this.numbers = [];
      this.form.replaceChildren(el("p", { class: "hint" }, `The text is no TOML (${e.message}): mend it as text, or take the change back.`));
      return;
    }
    const rows = [];
    let group;
    this.numbers.forEach((n, k) => {
      const own = n.group.join(" ");
      if (own !== group) rows.push(el("h3", {}, own || "scenario"));
      group = own;
      rows.push(this.row(k, n));
    });
    this.form.replaceChildren(...rows);
    this.judge();
  }

  /** A slider and a field for one number. The slider spans the number as it was given, once to each side; the field takes any. */
  row(k, n) {
    const written = this.text.slice(n.from, n.to);
    const given = Number(written.replaceAll("_", ""));
    const label = n.path.join(" "), own = n.path.slice(n.group.length).join(" ");
    const [key, place] = /^(.*?)( \d+)?$/.exec(own).slice(1);
    const span = key.endsWith("_deg") ? 180 : Math.max(Math.abs(given), n.whole ? 10 : 1);
    const low = given - span;
    const field = el("input", { type: "text", inputMode: "decimal", value: written, "aria-label": label, title: label, onchange: () => {
      const text = field.value.trim().replace(",", ".").replace(/^([+-]?)\./, "$10.").replace(/\.$/, ".0");
      if (NUMBER.test(text)) this.set(put(this.text, this.numbers, k, text), false);
      else {
        field.setAttribute("aria-invalid", "true");
        this.told.textContent = `${label} = ${field.value}: no number; allowed: decimal numbers, as 1.5, -3 or 76.5e9`;
      }
    } });
    const slider = el("input", { type: "range", min: 0, max: 1000, value: 500, "aria-label": `${label} by a slider`, title: label, oninput: () => {
      const v = Number((low + (2 * span * Number(slider.value)) / 1000).toPrecision(4));
      // What was written with a point stays so: it need not be a whole number.
      field.value = n.whole ? String(Math.round(v)) : Number.isInteger(v) && Math.abs(v) < 1e15 ? v.toFixed(1) : String(v);
      this.set(put(this.text, this.numbers, k, field.value), true);
    }, onchange: () => { this.moving = false; } });
    const row = el("label", { class: "row", title: label }, el("span", {}, `${words(key)}${place ?? ""}${unit(key) ? ` / ${unit(key)}` : ""}`), slider, field);
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
    let told;
    try {
      const answer = await fetch("simulate", { method: "POST", headers: { "Content-Type": "text/plain; charset=utf-8" }, body: this.text });
      told = await answer.json();
    } catch (e) {
      told = { error: `The program that serves this page does not answer (${e.message}). Start catseye view --live again; the scenario can be saved here.` };
    }
    if (told.error) this.complain(told.error);
    else {
      try {
        await this.show(told);
        this.complain("");
        this.note.textContent = `Simulated in ${number(told.seconds, 2)} s, drawn after ${number((performance.now() - began) / 1000, 2)} s.`;
      } catch (e) {
        this.complain(`The frame cannot be drawn: ${e.message}`);
      }
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
    // Errors name file and line, that of the key.
    const at = text.indexOf(`${this.first.file}:`);
    this.wrong = at < 0 ? undefined : /^\d+/.exec(text.slice(at + this.first.file.length + 1))?.[0];
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
    this.settle();
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
