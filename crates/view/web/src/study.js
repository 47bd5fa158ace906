// Studies: quantities over their axes as lines or as a map, the table itself, and the facts of a document beside this program's numbers.

import { series } from "./colours.js";
import { data, numbers } from "./data.js";
import { el, menu } from "./dom.js";
import { LevelMap } from "./map.js";
import { Lines } from "./plot.js";

/** Most lines that one plot can hold apart; of longer axes as many are taken, evenly. */
const MOST_LINES = 12;
/** Most rows of the table that are in the page at once. */
const MOST_ROWS = 1000;

/** A number as the file has it, with a true minus sign. */
export function exact(v) {
  if (v == null || Number.isNaN(v)) return "–";
  if (!Number.isFinite(v)) return v > 0 ? "∞" : "−∞";
  return String(v).replace(/^-/, "−");
}

/** The numbers of an axis as they are drawn, and its label: frequencies in GHz, words by their place. */
function scaled(axis) {
  if (!axis.numbers) return { values: axis.names.map((_, i) => i), names: axis.names, label: axis.label };
  const giga = axis.label.endsWith("(Hz)") && axis.numbers.every((v) => Math.abs(v) >= 1e8);
  return {
    values: giga ? axis.numbers.map((v) => v / 1e9) : axis.numbers,
    label: giga ? axis.label.replace("(Hz)", "(GHz)") : axis.label,
  };
}

/** A study with its columns as arrays, and the row of each point of its axes. */
function open(s) {
  const columns = (s.columns ?? []).map((c) => ({ ...c, at: numbers(c.at), cells: numbers(c.cells) }));
  const axes = columns.filter((c) => c.at);
  const fields = columns.filter((c) => c.cells && !Array.isArray(c.cells));
  const strides = [];
  let points = 1;
  for (const a of [...axes].reverse()) {
    strides.unshift(points);
    points *= a.names.length;
  }
  const row = new Int32Array(axes.length ? points : 0).fill(-1);
  for (let i = 0; i < (s.rows ?? 0); i++) row[axes.reduce((sum, a, k) => sum + a.at[i] * strides[k], 0)] = i;
  return { ...s, columns, axes, fields, row_of: (places) => row[places.reduce((sum, p, k) => sum + p * strides[k], 0)] };
}

export class StudyView {
  constructor() {
    this.studies = data.studies.map(open);
    this.tools = el("div", { class: "tools" });
    this.lines = new Lines({ x: "", y: "", pick: (i) => this.point(i) });
    this.map = new LevelMap({ name: "values over two axes", unit: "", hover: (r, c) => this.hover(r, c), pick: (r, c) => this.take_cell(r, c) });
    this.note = el("p", { class: "hint told-value" });
    this.list = el("div", { class: "list" });
    this.details = el("div", { class: "details" });
    this.chart = el("div", { class: "chart" }, this.lines.box, this.map.box);
    this.left = el("section", { class: "left" }, this.tools, this.chart, this.note, this.list);
    this.element = el("main", { class: "study" }, this.left, el("section", { class: "right" }, this.details));
  }

  async start() {
    this.take(0);
  }

  /** Shows a study. */
  take(which) {
    this.which = which;
    const s = (this.study = this.studies[which]);
    this.row = null;
    this.sort = { column: null, up: true };
    // A search has what was sought before its goal, and whether a design is on the front after it.
    this.field = Math.max(0, s.fields.findIndex((f) => f.name === "on_front") - 1);
    // Along the first axis, as the study's own picture has it; the second makes lines where it is short.
    this.x = 0;
    this.over = s.axes.length > 1 ? 1 : null;
    this.places = s.axes.map(() => 0);
    this.kind = "lines";
    if (this.over != null && s.axes[1].names.length > MOST_LINES) {
      if (s.axes[1].numbers && s.axes[0].numbers) this.kind = "map";
      else this.over = null;
    }
    this.update();
  }

  /** All that depends on what is chosen. */
  update() {
    const s = this.study;
    this.controls();
    const drawable = s.axes.length > 0 && s.fields.length > 0;
    this.chart.hidden = !drawable && !s.picture;
    this.note.textContent = "";
    this.chart.querySelector("img")?.remove();
    if (s.picture) this.chart.append(el("img", { src: s.picture, alt: `Picture of ${s.title}`, class: "picture" }));
    this.lines.box.hidden = !drawable || this.kind !== "lines";
    this.map.box.hidden = !drawable || this.kind !== "map";
    if (drawable) this.draw();
    this.table();
    this.tell();
  }

  controls() {
    const s = this.study, axes = s.axes;
    const index = (list) => list.map((a, i) => [String(i), a.label]);
    const both = axes.length > 1;
    if (both && this.kind === "map" && this.over == null) this.over = axes.findIndex((_, i) => i !== this.x);
    const choose = (key) => (v) => { this[key] = v === "" ? null : Number(v); if (this.over === this.x) this.over = key === "x" ? axes.findIndex((_, i) => i !== this.x) : null; this.update(); };
    this.tools.replaceChildren(...[
      this.studies.length > 1 && menu("study", index(this.studies.map((t) => ({ label: t.title }))), String(this.which), (v) => this.take(Number(v))),
      s.fields.length > 0 && axes.length > 0 && menu("show", index(s.fields), String(this.field), choose("field")),
      both && menu("as", [["lines", "lines"], ["map", "map"]], this.kind, (v) => { this.kind = v; this.update(); }),
      axes.length > 0 && s.fields.length > 0 && menu("along", index(axes), String(this.x), choose("x")),
      both && menu(this.kind === "map" ? "upward" : "a line for each", [...(this.kind === "map" ? [] : [["", "nothing"]]), ...index(axes).filter(([i]) => Number(i) !== this.x)], this.over == null ? "" : String(this.over), choose("over")),
      ...axes.map((a, k) => {
        if (k === this.x || k === this.over || a.names.length < 2) return null;
        const slider = el("input", { type: "range", min: 0, max: a.names.length - 1, value: this.places[k], "aria-label": a.label, oninput: () => { this.places[k] = Number(slider.value); text.textContent = this.named(a, this.places[k]); this.draw(); } });
        const text = el("output", {}, this.named(a, this.places[k]));
        return el("label", { class: "menu" }, el("span", {}, a.label), slider, text);
      })].filter(Boolean));
  }

  /** The row of the table where the axes have these places beside the sliders'. */
  at(x, over) {
    const places = [...this.places];
    places[this.x] = x;
    if (this.over != null) places[this.over] = over;
    return this.study.row_of(places);
  }

  draw() {
    const s = this.study, field = s.fields[this.field], axis = s.axes[this.x];
    if (this.kind === "map") return this.draw_map(field);
    const x = scaled(axis);
    this.order = x.values.map((_, i) => i).sort((a, b) => x.values[a] - x.values[b]);
    const over = this.over == null ? null : s.axes[this.over];
    const n = over ? over.names.length : 1;
    const shown = n <= MOST_LINES ? Array.from({ length: n }, (_, i) => i) : Array.from({ length: MOST_LINES }, (_, i) => Math.round((i * (n - 1)) / (MOST_LINES - 1)));
    this.drawn = shown.map((k) => this.order.map((i) => this.at(i, k)));
    const lines = shown.map((k, j) => ({
      label: over ? this.named(over, k) : field.label,
      colour: series(j), dash: j < 7 ? undefined : [6, 4], told: exact,
      // A line of one point would not be seen.
      points: this.order.length === 1,
      values: this.drawn[j].map((row) => (row >= 0 && Number.isFinite(field.cells[row]) ? field.cells[row] : null)),
    }));
    this.shown = shown;
    Object.assign(this.lines.labels, { x: x.label, y: field.label });
    const chosen = this.row == null ? [] : [{ x: x.values[axis.at[this.row]], colour: "#ff2d55" }];
    this.lines.show(this.order.map((i) => x.values[i]), lines, { names: x.names, marks: chosen, title: over ? `a line for each ${over.label}` : undefined });
    const lost = this.drawn.flat().filter((row) => row >= 0 && !Number.isFinite(field.cells[row])).length;
    this.hint = [n > shown.length && `${shown.length} of ${n} lines are drawn; the map and the table have all.`, lost > 0 && `${lost} of the values are missing or infinite, and are gaps.`].filter(Boolean).join(" ");
    this.note.textContent = this.hint;
  }

  draw_map(field) {
    const s = this.study, [a, b] = [s.axes[this.x], s.axes[this.over]];
    const side = (axis) => {
      const x = scaled(axis), v = x.values, step = (v.at(-1) - v[0]) / Math.max(1, v.length - 1) || 1;
      const even = !x.names && v.every((y, i) => Math.abs(y - v[0] - i * step) < 1e-6 * Math.abs(step) * v.length) && step > 0;
      return even ? { label: x.label, first: v[0], step } : { label: x.label, first: 0, step: 1, names: axis.names };
    };
    const at = (r, c) => { const row = this.at(c, r); return row < 0 ? NaN : field.cells[row]; };
    let low = Infinity, high = -Infinity;
    for (let r = 0; r < b.names.length; r++) for (let c = 0; c < a.names.length; c++) {
      const v = at(r, c);
      if (Number.isFinite(v)) [low, high] = [Math.min(low, v), Math.max(high, v)];
    }
    if (!(high > low)) [low, high] = Number.isFinite(low) ? [low - 1, low + 1] : [0, 1];
    this.map.unit = /\(([^()]*)\)$/.exec(field.label)?.[1] ?? "";
    this.map.show({ columns: a.names.length, rows: b.names.length, at, x: side(a), y: side(b), low, high });
    const row = this.row;
    const mark = (axis, k) => { const place = s.axes[k].at[row]; return axis.first + place * axis.step; };
    this.map.mark_all(row == null ? [] : [{ x: mark(this.map.map.x, this.x), y: mark(this.map.map.y, this.over), colour: "#ff2d55", shape: "ring", id: row }], row);
    this.map.note.textContent = "Point at a cell for its value; a click chooses its row of the table.";
  }

  /** The values at a place of the plot's axis. */
  point(i) {
    const s = this.study, field = s.fields[this.field], axis = s.axes[this.x], place = this.order?.[i];
    if (place == null || this.kind !== "lines") return;
    const over = this.over == null ? null : s.axes[this.over];
    this.note.textContent = `${axis.label} = ${this.named(axis, place)}: ` + this.drawn.map((line, j) => `${over ? `${this.named(over, this.shown[j])}: ` : ""}${exact(field.cells[line[i]])}`).join(" · ");
  }

  hover(r, c) {
    if (r == null) return (this.map.note.textContent = "");
    const s = this.study, [a, b] = [s.axes[this.x], s.axes[this.over]];
    this.map.note.textContent = `${a.label} = ${this.named(a, c)}, ${b.label} = ${this.named(b, r)}: ${exact(s.fields[this.field].cells[this.at(c, r)])}`;
  }

  take_cell(r, c) {
    const row = this.at(c, r);
    if (row >= 0) this.choose(row);
  }

  /** The name of a place of an axis: its word, or its number as it is written elsewhere. */
  named(axis, place) {
    return axis.numbers && Number(axis.names[place]) === axis.numbers[place] ? exact(axis.numbers[place]) : axis.names[place];
  }

  /** What a cell of the table is called, and what it is sorted by. */
  told(column, row) {
    if (column.at) return this.named(column, column.at[row]);
    return typeof column.cells[row] === "number" ? exact(column.cells[row]) : column.cells[row];
  }

  value(column, row) {
    return column.at ? column.numbers?.[column.at[row]] ?? column.names[column.at[row]] : column.cells[row];
  }

  spec(row) {
    const { specs = [], of_row = [] } = this.study.reflectors ?? {};
    return specs[of_row.length ? of_row[row] : 0];
  }

  /** The rows in the order that is chosen. */
  ordered() {
    const rows = Array.from({ length: this.study.rows ?? 0 }, (_, i) => i), { column, up } = this.sort;
    if (column == null) return rows;
    const c = this.study.columns[column], values = rows.map((i) => this.value(c, i));
    const none = (v) => v === "" || v == null || Number.isNaN(v);
    return rows.sort((a, b) => {
      const [x, y] = [values[a], values[b]];
      // What is missing stands last in both directions.
      if (none(x) || none(y)) return none(x) - none(y) || a - b;
      const d = typeof x === "number" && typeof y === "number" ? (x < y ? -1 : x > y ? 1 : 0) : String(x).localeCompare(String(y));
      return (up ? d : -d) || a - b;
    });
  }

  table() {
    const s = this.study;
    this.list.hidden = !s.columns.length;
    if (!s.columns.length) return this.list.replaceChildren();
    const order = this.ordered(), reflector = this.spec(0) != null;
    const head = s.columns.map((c, k) => {
      const own = this.sort.column === k;
      const turn = () => { this.sort = { column: k, up: own ? !this.sort.up : true }; this.table(); };
      return el("th", { "aria-sort": own ? (this.sort.up ? "ascending" : "descending") : "none" }, el("button", { onclick: turn, title: `${c.name}: sort by it` }, c.label, own ? (this.sort.up ? " ▲" : " ▼") : ""));
    });
    const body = el("tbody");
    for (const i of order.slice(0, MOST_ROWS)) {
      const tr = el("tr", { class: i === this.row ? "on" : "", onclick: () => this.choose(i) }, s.columns.map((c) => el("td", {}, this.told(c, i))),
        reflector && el("td", {}, el("button", { title: this.spec(i), onclick: (e) => { e.stopPropagation(); this.choose(i); this.copy(this.spec(i)); } }, "copy")));
      tr.dataset.row = i;
      body.append(tr);
    }
    this.list.replaceChildren(el("table", {}, el("thead", {}, el("tr", {}, head, reflector && el("th", {}, "reflector"))), body),
      order.length > MOST_ROWS ? el("p", { class: "hint" }, `The first ${MOST_ROWS} of ${order.length} rows in this order; the plot has all.`) : "");
  }

  /** Chooses a row: sliders go to it, and its reflector stands as text to copy. */
  choose(row) {
    this.row = row;
    if (row != null) this.places = this.study.axes.map((a) => a.at[row]);
    this.controls();
    if (!this.lines.box.hidden || !this.map.box.hidden) this.draw();
    this.list.querySelector("tr.on")?.classList.remove("on");
    const line = row == null ? null : this.list.querySelector(`tr[data-row="${row}"]`);
    line?.classList.add("on");
    this.tell();
  }

  async copy(text) {
    try {
      await navigator.clipboard.writeText(text);
      this.copied.textContent = "copied";
    } catch {
      // Where the clipboard is closed to pages, the text stands selected.
      const range = document.createRange();
      range.selectNodeContents(this.details.querySelector("code"));
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      this.copied.textContent = document.execCommand("copy") ? "copied" : "selected: copy it with Ctrl+C";
    }
  }

  tell() {
    const s = this.study, judged = s.facts.filter((f) => f.agrees != null), passed = judged.filter((f) => f.agrees).length;
    const list = (items) => el("ul", {}, items.map((t) => el("li", {}, t)));
    const verdict = (f) => (f.agrees == null ? el("td", { class: "soft" }, "not judged") : el("td", { class: f.agrees ? "passed" : "failed" }, f.agrees ? "✓ passed" : "✗ not passed"));
    const value = (v, unit) => (typeof v === "string" ? v : v == null ? "–" : `${short(v)} ${unit}`.trim());
    this.copied = el("span", { class: "hint", role: "status" });
    const spec = this.row == null ? null : this.spec(this.row);
    this.details.replaceChildren(...[
      el("h2", {}, s.title),
      s.reference && el("p", { class: "hint" }, `Set beside ${s.reference}.`),
      s.error && el("p", { class: "told" }, `It did not run: ${s.error}`),
      s.picture && el("p", { class: "hint" }, "The folder holds no table of this study, so that its picture alone is shown."),
      this.row != null && el("h3", {}, `Row ${this.row + 1}`),
      this.row != null && el("dl", { class: "facts" }, s.columns.flatMap((c) => [el("dt", {}, c.label), el("dd", {}, this.told(c, this.row))])),
      spec && el("div", { class: "spec" }, el("code", {}, spec), el("button", { onclick: () => this.copy(spec) }, "copy"), this.copied),
      spec && el("p", { class: "hint" }, "catseye view with this text, in quotes, opens the page in which it can be changed."),
      this.row == null && s.columns.length > 0 && el("p", { class: "hint" }, `Click a row of the table${this.spec(0) ? ": its reflector stands here as text to copy" : " for its values"}.`),
      s.facts.length > 0 && el("h3", {}, judged.length ? `Facts: ${passed} of ${judged.length} that can be judged are passed` : "Facts, all in words, which are not judged"),
      s.facts.length > 0 && el("table", { class: "judged" }, el("thead", {}, el("tr", {}, ["fact", "document", "here", ""].map((t) => el("th", {}, t)))),
        el("tbody", {}, s.facts.map((f) => el("tr", { title: f.why }, el("td", {}, f.text, f.why && el("div", { class: "hint" }, f.why)), el("td", {}, value(f.document, f.unit)), el("td", { title: exact(f.ours) }, value(f.ours, f.unit)), verdict(f))))),
      s.facts.length > 0 && el("p", { class: "hint" }, "Levels pass within 1 dB, other numbers within a tenth of the document's."),
      s.remarks.length > 0 && el("h3", {}, "Remarks"), s.remarks.length > 0 && list(s.remarks),
      s.settings?.length > 0 && el("h3", {}, "Settings"), s.settings?.length > 0 && list(s.settings),
      s.source && el("details", {}, el("summary", {}, "the study's file"), el("pre", {}, s.source)),
    ].filter(Boolean));
  }

  key_press(e) {
    const step = (by) => this.studies.length > 1 && this.take((this.which + by + this.studies.length) % this.studies.length);
    if (e.key === "n") step(1);
    if (e.key === "p") step(-1);
    if (e.key === "Escape" && this.row != null) this.choose(null);
    if ((e.key === "l" || e.key === "m") && this.study.axes.length > 1) {
      this.kind = e.key === "m" ? "map" : "lines";
      this.update();
    }
  }

  theme() {
    this.lines.again();
    this.map.redraw();
  }
}

/** A number of four digits; the table and the pointer tell all. */
function short(v) {
  return exact(Number(v.toPrecision(4)));
}
