// A reflector that is designed in the page: sliders for every parameter, its shape and its cross section at once. The physics is that of
// `catseye rcs`, built for the browser (crates/design), and runs in the page: nothing is asked of a server.

import { triangles_of } from "./glb.js";
import { bindings, start as start_module } from "./module.js";
import { series } from "./colours.js";
import { data, words, unit } from "./data.js";
import { el, menu, number } from "./dom.js";
import { Lines } from "./plot.js";
import { SceneView } from "./scene3d.js";

const PAIRS = ["vv", "vh", "hv", "hh"];
const COLUMNS = ["frequency_hz", "azimuth_deg", "elevation_deg", ...PAIRS.map((p) => `${p}_dbsm`), ...PAIRS.flatMap((p) => [`${p}_re_m`, `${p}_im_m`])];
/** Sliders of spans over decades are even in the logarithm. */
const DECADES = 30;
/** Longest that the page computes before it answers, ms (a single direction may take longer). */
const SLICE_MS = 60;
/** Time between two drawings of a cut that is not complete, ms. */
const REDRAW_MS = 250;

/** 0 … n − 1, the ends first, then ever finer: what is there of a cut shows its shape. */
export function coarse_to_fine(n) {
  const order = new Uint32Array(n), seen = new Uint8Array(n);
  let at = 0;
  const put = (i) => { if (!seen[i]) { seen[i] = 1; order[at++] = i; } };
  put(0);
  put(n - 1);
  for (let step = 2 ** Math.ceil(Math.log2(Math.max(2, n))); step >= 1; step /= 2) for (let i = 0; i < n; i += step) put(i);
  return order;
}

export class DesignView {
  constructor() {
    this.scene = new SceneView({ pick: () => {} });
    this.lines = new Lines({ x: "azimuth / °", y: "cross section / dBsm", pick: (i) => this.look(i) });
    this.controls = el("form", { class: "controls", onsubmit: (e) => e.preventDefault() });
    this.told = el("p", { class: "told", role: "status" });
    this.note = el("p", { class: "hint" });
    this.past = [];
    this.future = [];
    this.done = Promise.resolve();
    this.resolve = () => {};
    const button = (text, title, act) => el("button", { type: "button", title, onclick: act }, text);
    this.tools = el("div", { class: "tools" },
      button("↶", "Undo (Ctrl+Z)", () => this.undo()), button("↷", "Redo (Ctrl+Y)", () => this.redo()), button("hold", "Keep the curve to compare with", () => this.hold()),
      el("span", { class: "hint" }, "save as"), button("CSV", "The cut as a table of cross sections", () => this.save_csv()), button("GLB", "The reflector with its radar material", () => this.save_glb()),
      button("TOML", "A study of this cut for catseye study", () => this.save_toml()), button("PNG", "The plot as a picture", () => this.save_png()));
    this.element = el("main", { class: "design" }, this.tools, el("section", { class: "left" }, this.controls, this.told), el("section", { class: "right" }, this.scene.box, this.lines.box, this.note));
  }

  async start() {
    await start_module();
    Object.assign(this, JSON.parse(bindings.describe()));
    this.state = this.parse(data.spec);
    this.make_controls();
    this.update();
    this.reset();
  }

  /** Kind and values of a specification `KIND:name=value,…`. */
  parse(spec) {
    const [name, list = ""] = spec.split(/:(.*)/s);
    const kind = this.kinds.find((k) => k.name === name.trim()) ?? this.kinds[0];
    const values = Object.fromEntries(kind.parameters.map((p) => [p.name, p.default]));
    let material = kind.material;
    for (const pair of list.split(",").filter(Boolean)) {
      const [key, value] = pair.split("=").map((s) => s.trim());
      if (key === "material") material = value;
      else if (key in values) values[key] = Number.isNaN(Number(value)) ? value : Number(value);
    }
    const [azimuth, elevation] = kind.boresight_deg;
    return { kind: kind.name, values, material, frequency_ghz: 77, along: "azimuth", from: -45, to: 45, steps: 451, azimuth, elevation, bounces: 3, ptd: false };
  }

  spec() {
    const { kind, values, material } = this.state;
    return `${kind}:${[...Object.entries(values), ["material", material]].map(([k, v]) => `${k}=${v}`).join(",")}`;
  }

  /** The specification without what is as by default, for the eye. */
  told_spec() {
    const { kind, values, material } = this.state;
    const own = this.kind.parameters.filter((p) => values[p.name] !== p.default).map((p) => [p.name, values[p.name]]);
    if (material !== this.kind.material) own.push(["material", material]);
    return own.length ? `${kind}:${own.map(([k, v]) => `${k}=${v}`).join(",")}` : kind;
  }

  get kind() {
    return this.kinds.find((k) => k.name === this.state.kind);
  }

  /** Sets a value, to be taken back; `quick` while a slider moves. */
  set(change, quick) {
    if (!quick || !this.moving) this.past.push(structuredClone(this.state));
    this.moving = quick;
    this.future = [];
    change(this.state);
    this.update();
  }

  undo() {
    if (!this.past.length) return;
    this.future.push(this.state);
    this.state = this.past.pop();
    this.make_controls();
    this.update();
  }

  redo() {
    if (!this.future.length) return;
    this.past.push(this.state);
    this.state = this.future.pop();
    this.make_controls();
    this.update();
  }

  make_controls() {
    const s = this.state, k = this.kind;
    const rows = k.parameters.map((p) => this.row(p.name, p.doc, p.allowed, p, () => this.state.values[p.name], (v) => (state) => { state.values[p.name] = v; }));
    const choose = menu("kind", this.kinds.map((x) => [x.name, x.name]), s.kind, (v) => this.set((state) => {
      Object.assign(state, this.parse(v), { frequency_ghz: state.frequency_ghz, bounces: state.bounces, ptd: state.ptd });
      queueMicrotask(() => { this.make_controls(); this.reset(); });
    }));
    const number_row = (name, doc, min, max, whole) => this.row(name, doc, `${min} to ${max}`, { [whole ? "whole" : "number"]: true, min, max, default: s[name] }, () => this.state[name], (v) => (state) => { state[name] = v; });
    this.controls.replaceChildren(
      choose, el("p", { class: "hint" }, `${k.summary}. ${k.pose}`), ...rows,
      menu("material", this.materials.map((m) => [m, m]), s.material, (v) => this.set((state) => { state.material = v; })),
      el("h3", {}, "The cut"),
      number_row("frequency_ghz", "Frequency, GHz", 1, 300), menu("along", [["azimuth", "azimuth"], ["elevation", "elevation"]], s.along, (v) => this.set((state) => { state.along = v; queueMicrotask(() => this.make_controls()); })),
      number_row("from", "First angle, degrees", -180, 180), number_row("to", "Last angle, degrees", -180, 180), number_row("steps", "Number of directions", 2, 2001, true),
      number_row(s.along === "azimuth" ? "elevation" : "azimuth", "The other angle, degrees", s.along === "azimuth" ? -90 : -180, s.along === "azimuth" ? 90 : 180),
      number_row("bounces", "Reflections that are followed", 1, 8, true),
      el("label", { class: "toggle" }, el("input", { type: "checkbox", checked: s.ptd, onchange: (e) => this.set((state) => { state.ptd = e.target.checked; }) }), "edges diffract (PTD)"));
  }

  /** A slider and a field; what is out of range is told with what is allowed, and changes nothing. */
  row(name, doc, allowed, range, get, put) {
    const title = `${doc}; ${allowed}`;
    if (range.choice) return menu(name, range.choice.map((w) => [w, w]), get(), (v) => this.set(put(v)));
    if (range.material) return menu(words(name), [["none", "none"], ...this.materials.map((m) => [m, m])], get(), (v) => this.set(put(v)));
    const log = range.number && range.min > 0 && range.max / range.min > DECADES;
    // A slider of sizes from micrometres to a hundred metres would have its middle where nobody looks.
    const [lo, hi] = log ? [Math.max(range.min, (range.default || 1) / 20), Math.min(range.max, (range.default || 1) * 20)] : [range.min, range.max];
    const to = (v) => (log ? (1000 * Math.log(v / lo)) / Math.log(hi / lo) : (1000 * (v - lo)) / (hi - lo));
    const from = (x) => (log ? lo * (hi / lo) ** (x / 1000) : lo + ((hi - lo) * x) / 1000);
    const tidy = (v) => (range.whole ? Math.round(v) : Number(v.toPrecision(4)));
    const field = el("input", { type: "text", inputMode: "decimal", value: get(), "aria-label": name, title, onchange: () => {
      const v = Number(field.value.replace(",", "."));
      if (field.value.trim() === "" || !(v >= range.min && v <= range.max) || (range.whole && !Number.isInteger(v))) {
        this.complain(`${name} = ${field.value}: allowed: ${allowed}`);
        field.setAttribute("aria-invalid", "true");
        return;
      }
      field.removeAttribute("aria-invalid");
      slider.value = to(v);
      this.set(put(v));
    } });
    const slider = el("input", { type: "range", min: 0, max: 1000, step: range.whole ? 1000 / Math.max(1, hi - lo) : 1, "aria-label": `${name} by a slider`, title, oninput: () => {
      const v = tidy(from(Number(slider.value)));
      field.value = v;
      field.removeAttribute("aria-invalid");
      this.set(put(v), true);
    }, onchange: () => { this.moving = false; } });
    slider.value = to(get());
    return el("label", { class: "row", title }, el("span", {}, `${words(name)}${unit(name) ? ` / ${unit(name)}` : ""}`), slider, field);
  }

  complain(text) {
    this.told.textContent = text;
  }

  directions() {
    const { along, from, to, steps, azimuth, elevation } = this.state;
    const x = Float64Array.from({ length: steps }, (_, i) => from + ((to - from) * i) / Math.max(1, steps - 1));
    const other = new Float64Array(steps).fill(along === "azimuth" ? elevation : azimuth);
    return along === "azimuth" ? [x, other, x] : [other, x, x];
  }

  /** Makes the reflector anew and begins its cut: what takes no longer than a slice is there on return, the rest when `done` is. */
  update() {
    clearTimeout(this.next);
    this.finish();
    let target, parts;
    try {
      target = new bindings.Target(this.spec());
      parts = triangles_of(target.glb());
    } catch (e) {
      target?.free();
      this.refuse(e);
      return;
    }
    const [azimuth, elevation, x] = this.directions();
    this.target = target;
    this.cut = { azimuth, elevation, x, found: new Float64Array(8 * x.length), order: coarse_to_fine(x.length), at: 0, count: 1 };
    this.ms = 0;
    this.drawn = -Infinity;
    this.done = new Promise((resolve) => { this.resolve = resolve; });
    this.advance(parts);
  }

  /** Shows the error of a target; a fault in the module is none of the user's, and leaves it unusable. */
  refuse(e) {
    if (e instanceof WebAssembly.RuntimeError) throw e;
    this.complain(e.message);
  }

  /** Computes directions for a slice of time, draws them, and leaves the rest to later slices so that the page answers meanwhile. */
  advance(parts) {
    const { cut, target } = this;
    const { frequency_ghz, bounces, ptd } = this.state;
    const began = performance.now();
    try {
      while (cut.at < cut.order.length) {
        const some = cut.order.slice(cut.at, cut.at + cut.count);
        const start = performance.now();
        const found = target.cut(1e9 * frequency_ghz, Float64Array.from(some, (i) => cut.azimuth[i]), Float64Array.from(some, (i) => cut.elevation[i]), bounces, ptd);
        some.forEach((i, k) => cut.found.set(found.subarray(8 * k, 8 * k + 8), 8 * i));
        cut.at += some.length;
        // As many directions at once as fit into a slice: a call has a fixed cost, which is most of that of flat metal.
        const ms = performance.now() - start;
        cut.count = Math.max(1, Math.floor(cut.count * Math.min(8, SLICE_MS / Math.max(ms, 0.01))));
        if (performance.now() - began > SLICE_MS) break;
      }
    } catch (e) {
      this.finish();
      this.refuse(e);
      return;
    }
    this.ms += performance.now() - began;
    const complete = cut.at === cut.order.length;
    if (parts) {
      this.complain("");
      this.scene.triangles(parts);
    }
    if (complete || performance.now() - this.drawn > REDRAW_MS) {
      this.take();
      this.draw();
      this.drawn = performance.now();
    }
    if (!complete) {
      this.next = setTimeout(() => this.advance());
      return;
    }
    this.finish();
  }

  /** Ends the cut that is being computed, if there is one. */
  finish() {
    this.target?.free();
    this.target = undefined;
    this.resolve();
  }

  /** Levels of the directions that are there, in the order of their angles. */
  take() {
    const { cut } = this;
    const has = Uint32Array.from(cut.order.subarray(0, cut.at)).sort();
    const those = (list) => Float64Array.from(has, (i) => list[i]);
    const found = new Float64Array(8 * has.length);
    has.forEach((i, k) => found.set(cut.found.subarray(8 * i, 8 * i + 8), 8 * k));
    this.result = { azimuth: those(cut.azimuth), elevation: those(cut.elevation), x: those(cut.x), found };
    this.levels = PAIRS.map((_, p) => Array.from(has, (_, k) => {
      const [re, im] = [found[8 * k + 2 * p], found[8 * k + 2 * p + 1]];
      const level = 10 * Math.log10(4 * Math.PI * (re * re + im * im));
      return Number.isFinite(level) ? level : null;
    }));
    const best = this.levels[0].reduce((b, v, i) => (v != null && (this.levels[0][b] == null || v > this.levels[0][b]) ? i : b), 0);
    const count = cut.at === cut.x.length ? `${cut.x.length}` : `${cut.at} of ${cut.x.length}`;
    this.note.textContent = `${this.told_spec()} · VV ${number(this.levels[0][best])} dBsm at ${number(this.result.x[best])}° at most · ${count} directions in ${number(this.ms, 1)} ms`;
  }

  draw() {
    const lines = [["VV", 0], ["HH", 3]].map(([label, k], n) => ({ label, colour: series(n), values: this.levels[k] }));
    // Cross-polarised echoes of a symmetrical corner are none.
    const best = Math.max(...this.levels.flat().filter((v) => v != null));
    if (Math.max(...this.levels[1].filter((v) => v != null)) > best - 40) lines.push({ label: "VH", colour: series(3), values: this.levels[1] });
    if (this.held) lines.push({ label: "VV held", colour: "#999", dash: [5, 4], values: this.held_values() });
    this.lines.labels.x = `${this.state.along} / °`;
    this.lines.show(Array.from(this.result.x), lines, { y: (_, lo, hi) => [Math.max(lo, best - 60) - 2, hi + 2] });
  }

  held_values() {
    const { x, values } = this.held;
    return Array.from(this.result.x, (v) => {
      const k = x.findIndex((u) => u >= v);
      if (k < 0 || (k === 0 && x[0] > v)) return null;
      if (x[k] === v || k === 0) return values[k];
      const [a, b] = [values[k - 1], values[k]];
      return a == null || b == null ? null : a + ((b - a) * (v - x[k - 1])) / (x[k] - x[k - 1]);
    });
  }

  hold() {
    this.held = { x: Array.from(this.result.x), values: [...this.levels[0]] };
    this.draw();
  }

  look(i) {
    if (!this.result || !this.scene.camera) return;
    const rad = Math.PI / 180;
    const [a, e] = [this.result.azimuth[i] * rad, Math.min(89.9, Math.max(-89.9, this.result.elevation[i])) * rad];
    const { middle, size } = this.scene.extent();
    const d = 1.6 * size;
    this.scene.look(middle, [middle[0] + d * Math.cos(e) * Math.cos(a), middle[1] + d * Math.cos(e) * Math.sin(a), middle[2] + d * Math.sin(e)]);
  }

  reset() {
    this.look(this.levels?.[0].reduce((b, v, i) => (v > (this.levels[0][b] ?? -Infinity) ? i : b), 0) ?? 0);
  }

  save(name, type, content) {
    const link = el("a", { href: URL.createObjectURL(new Blob([content], { type })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }

  /** The whole cut as a table, when it is complete. */
  async csv() {
    while (this.target) await this.done;
    const { azimuth, elevation, found } = this.result;
    const s = this.state;
    const lines = [`# target: ${this.spec()}`, `# convention: every (which bounces radiate)`, `# bounces: ${s.bounces}`, `# range_m: inf`, `# diffraction: ${s.ptd ? "ptd" : "none"}`, `# engine: cpu (f64) in a page of the browser`, `# version: catseye ${data.version}`, COLUMNS.join(",")];
    for (let i = 0; i < azimuth.length; i++) {
      const own = [...found.subarray(8 * i, 8 * i + 8)];
      const dbsm = PAIRS.map((_, k) => { const v = 10 * Math.log10(4 * Math.PI * (own[2 * k] ** 2 + own[2 * k + 1] ** 2)); return Number.isFinite(v) ? v.toFixed(6) : "-inf"; });
      lines.push([1e9 * s.frequency_ghz, azimuth[i], elevation[i], ...dbsm, ...own].join(","));
    }
    return `${lines.join("\n")}\n`;
  }

  async save_csv() {
    this.save(`${this.state.kind}.csv`, "text/csv", await this.csv());
  }

  save_glb() {
    const target = new bindings.Target(this.spec());
    this.save(`${this.state.kind}.glb`, "model/gltf-binary", target.glb());
    target.free();
  }

  toml() {
    const s = this.state;
    const other = s.along === "azimuth" ? "elevation" : "azimuth";
    const step = Number(((s.to - s.from) / Math.max(1, s.steps - 1)).toPrecision(9));
    return `# Made in a page of catseye view. catseye study ${s.kind}.toml -o out\nname = "${s.kind}"\ntitle = "${s.kind} over ${s.along}"\nquantities = ["rcs_dbsm"]\n\n[set]\ntarget = "${this.spec()}"\nfrequency_hz = ${1e9 * s.frequency_ghz}\n${other}_deg = ${s[other]}\n\n[solver]\nbounces = ${s.bounces}\ndiffraction = "${s.ptd ? "ptd" : "none"}"\n\n[[sweep]]\nparameter = "${s.along}_deg"\nstart = ${s.from}\nstop = ${s.to}\nstep = ${step}\n`;
  }

  save_toml() {
    this.save(`${this.state.kind}.toml`, "application/toml", this.toml());
  }

  save_png() {
    this.lines.plot.ctx.canvas.toBlob((blob) => this.save(`${this.state.kind}.png`, "image/png", blob));
  }

  key_press(e) {
    if (e.key === "r") this.reset();
  }

  shortcut(e) {
    if (e.key === "z") this.undo();
    else if (e.key === "y") this.redo();
    else return false;
    return true;
  }

  theme() {
    this.scene.theme();
    this.lines.again();
  }
}
