// Cross sections: cuts in Cartesian and polar form, and maps over azimuth and elevation, of several tables together.

import { series } from "./colours.js";
import { data, numbers } from "./data.js";
import { canvas, colour, el, menu, number, ticks } from "./dom.js";
import { LevelMap } from "./map.js";
import { Lines } from "./plot.js";
import { image, sizes } from "./isar.js";
import { SceneView } from "./scene3d.js";

const PAIRS = [["vv", "VV"], ["hh", "HH"], ["vh", "VH"], ["hv", "HV"]];
const AXES = { azimuth_deg: "azimuth / °", elevation_deg: "elevation / °", frequency_hz: "frequency / GHz" };
const NAMES = Object.keys(AXES);

/** A table with its values as arrays and the sorted different values of each axis. */
function open(table) {
  const t = { name: table.name, comments: table.comments ?? [] };
  for (const key of [...NAMES, ...PAIRS.map(([p]) => `${p}_dbsm`), "vv_re_m", "vv_im_m"]) t[key] = numbers(table[key]);
  t.axes = Object.fromEntries(NAMES.map((n) => [n, [...new Set(t[n])].sort((a, b) => a - b)]));
  return t;
}

/** A table of cross sections from the text of a CSV file; complains in one line. */
export function parse(name, text) {
  const lines = text.split(/\r?\n/).filter((l) => l.trim() !== "");
  const comments = lines.filter((l) => l.startsWith("#")).map((l) => l.slice(1).trim());
  const [head, ...body] = lines.filter((l) => !l.startsWith("#"));
  const header = (head ?? "").split(",").map((h) => h.trim());
  const wanted = [...NAMES, "vv_dbsm"];
  const missing = wanted.filter((w) => !header.includes(w));
  if (missing.length) throw new Error(`${name} has no column ${missing[0]}; a table of cross sections has ${wanted.join(", ")}.`);
  const table = { name, comments };
  for (const key of [...NAMES, ...PAIRS.map(([p]) => `${p}_dbsm`)]) {
    const k = header.indexOf(key);
    table[key] = body.map((line, i) => {
      if (k < 0) return NaN;
      const cell = line.split(",")[k]?.trim();
      const v = cell === "" || cell == null ? NaN : Number(cell === "inf" ? Infinity : cell === "-inf" ? -Infinity : cell);
      if (Number.isNaN(v) && cell && cell !== "NaN" && cell !== "nan") throw new Error(`${name}: row ${i + 1} of ${key} is no number.`);
      return v;
    });
  }
  if (!body.length) throw new Error(`${name} has no rows.`);
  return table;
}

export class RcsView {
  constructor() {
    this.tables = data.rcs.map(open);
    this.pair = "vv";
    this.axis = NAMES.reduce((a, b) => (this.tables[0].axes[b].length > this.tables[0].axes[a].length ? b : a));
    // Cuts begin through the strongest direction.
    const first = this.tables[0];
    const best = first.vv_dbsm.reduce((b, v, i) => (v > first.vv_dbsm[b] || !Number.isFinite(first.vv_dbsm[b]) ? i : b), 0);
    this.fixed = Object.fromEntries(NAMES.map((n) => [n, first.axes[n].indexOf(first[n][best])]));
    this.lines = new Lines({ x: AXES[this.axis], y: "cross section / dBsm", pick: (i) => this.at(i) });
    this.polar = canvas((g, w, h) => this.draw_polar(g, w, h));
    this.polar.canvas.className = "polar";
    this.map = new LevelMap({ name: "cross section over azimuth and elevation", unit: "dBsm", hover: (r, c) => this.hover(r, c), pick: (r, c) => this.pick(r, c) });
    this.note = el("p", { class: "hint" });
    this.shown = "map";
    if (data.scene) this.body = new SceneView({ pick: () => {} });
    this.tools = el("div", { class: "tools" });
    this.names = el("div", { class: "names" });
    const file = el("input", { type: "file", accept: ".csv", multiple: true, hidden: true, onchange: () => this.take([...file.files]) });
    this.element = el("main", { class: "rcs" }, this.tools, this.names,
      el("div", { class: this.body ? "cuts three" : "cuts" }, this.lines.box, this.polar.canvas, this.body?.box), this.map.box,
      el("div", { class: "note" }, this.note, el("button", { onclick: () => file.click() }, "lay another CSV over it"), file, el("span", { class: "hint" }, " or drop it here")));
    this.element.addEventListener("dragover", (e) => e.preventDefault());
    this.element.addEventListener("drop", (e) => {
      e.preventDefault();
      this.take([...e.dataTransfer.files]);
    });
  }

  async start() {
    if (this.body) {
      this.body.set(data.scene);
      this.body.legend(SceneView.used(data.scene));
      this.body.controls && (this.body.controls.maxPolarAngle = Math.PI);
    }
    this.update();
    this.turn(0, 0);
  }

  /** Looks at the target from where the radar stands, degrees. */
  turn(azimuth, elevation) {
    if (!this.body?.renderer) return;
    const [lo, hi] = this.body.bounds();
    const middle = lo.map((v, i) => 0.5 * (v + hi[i]));
    const size = Math.max(0.01, Math.hypot(...lo.map((v, i) => hi[i] - v)));
    Object.assign(this.body.camera, { near: size / 1000, far: 20 * size });
    this.body.camera.updateProjectionMatrix();
    // Straight from above, up would be undecided.
    const [a, e] = [(azimuth * Math.PI) / 180, (Math.min(89.9, Math.max(-89.9, elevation)) * Math.PI) / 180];
    const d = 1.5 * size;
    this.body.look(middle, [middle[0] + d * Math.cos(e) * Math.cos(a), middle[1] + d * Math.cos(e) * Math.sin(a), middle[2] + d * Math.sin(e)]);
  }

  /** Tables that are dropped onto the page. */
  async take(files) {
    for (const f of files) {
      try {
        this.tables.push(open(parse(f.name, await f.text())));
      } catch (e) {
        this.note.textContent = e.message;
        return;
      }
    }
    this.note.textContent = "";
    this.update();
  }

  update() {
    const first = this.tables[0];
    const own = NAMES.filter((n) => first.axes[n].length > 1);
    const show = (n, v) => (n === "frequency_hz" ? `${v / 1e9} GHz` : `${number(v, 3).replace(/\.?0+$/, "")}°`);
    this.tools.replaceChildren(...[
      menu("polarisation", PAIRS, this.pair, (v) => { this.pair = v; this.draw(); }),
      this.can_image() && menu("below", [["map", "map over angles"], ["image", "image (ISAR)"]], this.shown, (v) => { this.shown = v; this.draw_map(); }),
      menu("along", NAMES.filter((n) => own.includes(n) || n === this.axis).map((n) => [n, AXES[n].split(" ")[0]]), this.axis, (v) => { this.axis = v; this.update(); }),
      ...NAMES.filter((n) => n !== this.axis && first.axes[n].length > 1).map((n) => {
        const slider = el("input", { type: "range", min: 0, max: first.axes[n].length - 1, value: this.fixed[n], "aria-label": n, oninput: () => { this.fixed[n] = Number(slider.value); text.textContent = show(n, first.axes[n][this.fixed[n]]); this.draw(); } });
        const text = el("output", {}, show(n, first.axes[n][this.fixed[n]]));
        return el("label", { class: "menu" }, el("span", {}, AXES[n].split(" ")[0]), slider, text);
      })].filter(Boolean));
    this.names.replaceChildren(...this.tables.map((t, k) => el("span", { title: t.comments.join("\n") }, el("i", { style: `background:${series(k)}` }), t.name)));
    this.draw();
  }

  /** The values of a table along the axis, the others as near as it has them to what is chosen. */
  cut(t) {
    const first = this.tables[0];
    const near = NAMES.filter((n) => n !== this.axis).map((n) => {
      const want = first.axes[n][Math.min(this.fixed[n], first.axes[n].length - 1)];
      return [n, t.axes[n].reduce((a, b) => (Math.abs(b - want) < Math.abs(a - want) ? b : a))];
    });
    const level = t[`${this.pair}_dbsm`], out = [];
    for (let i = 0; i < level.length; i++) if (near.every(([n, v]) => t[n][i] === v)) out.push([t[this.axis][i], level[i]]);
    return out.sort((a, b) => a[0] - b[0]);
  }

  draw() {
    const scale = this.axis === "frequency_hz" ? 1e-9 : 1;
    this.cuts = this.tables.map((t) => this.cut(t).map(([x, y]) => [scale * x, y]));
    const xs = [...new Set(this.cuts.flat().map(([x]) => x))].sort((a, b) => a - b);
    const at = new Map(xs.map((x, i) => [x, i]));
    const lines = this.cuts.map((cut, k) => {
      const values = new Array(xs.length).fill(null);
      for (const [x, y] of cut) values[at.get(x)] = Number.isFinite(y) ? y : null;
      // Another table's grid leaves gaps in this one's line, which are bridged.
      if (cut.length < xs.length) for (let i = 0; i < xs.length; i++) if (values[i] === null && !cut.some(([x]) => x === xs[i])) values[i] = undefined;
      return { label: `${this.tables[k].name} ${this.pair.toUpperCase()}`, colour: series(k), values };
    });
    this.lines.labels.x = AXES[this.axis];
    this.xs = xs;
    const best = Math.max(...this.cuts.flat().map(([, y]) => y).filter(Number.isFinite));
    this.lines.show(xs, lines, { y: (_, lo, hi) => [Math.max(lo, best - 60) - 2, hi + 2] });
    this.polar.canvas.hidden = this.axis === "frequency_hz";
    this.polar.redraw();
    this.draw_map();
  }

  at(i) {
    const x = this.xs?.[i];
    if (x == null) return;
    const spot = Object.fromEntries(NAMES.map((n) => [n, this.tables[0].axes[n][Math.min(this.fixed[n], this.tables[0].axes[n].length - 1)]]));
    if (this.axis !== "frequency_hz") spot[this.axis] = x;
    this.turn(spot.azimuth_deg, spot.elevation_deg);
    this.note.textContent = this.cuts.map((cut, k) => {
      const row = cut.find(([v]) => v === x);
      return row ? `${this.tables[k].name}: ${number(row[1])} dBsm` : "";
    }).filter(Boolean).join(" · ") + ` at ${number(x, 3)}`;
  }

  draw_polar(g, w, h) {
    if (!this.cuts || this.axis === "frequency_hz") return;
    const all = this.cuts.flat().map(([, y]) => y).filter(Number.isFinite);
    const high = Math.ceil(Math.max(...all) / 10) * 10, low = high - 50, r = Math.min(w, h) / 2 - 26;
    const [cx, cy] = [w / 2, h / 2];
    // Azimuth 0 points up and grows to the left, as seen from above; elevation 0 points right and grows upwards.
    const spot = (deg, level) => {
      const a = ((this.axis === "azimuth_deg" ? deg + 90 : deg) * Math.PI) / 180, d = (r * Math.max(0, level - low)) / (high - low);
      return [cx + d * Math.cos(a), cy - d * Math.sin(a)];
    };
    g.strokeStyle = colour("grid");
    g.fillStyle = colour("ink");
    g.font = "11px system-ui";
    g.textAlign = "center";
    g.textBaseline = "middle";
    for (const level of ticks(low, high, 5).list) {
      g.beginPath();
      g.arc(cx, cy, (r * (level - low)) / (high - low), 0, 2 * Math.PI);
      g.stroke();
      g.fillText(number(level, 0), ...spot(this.axis === "azimuth_deg" ? 180 : -90, level));
    }
    for (let deg = -150; deg <= 180; deg += 30) {
      g.beginPath();
      g.moveTo(cx, cy);
      g.lineTo(...spot(deg, high));
      g.stroke();
      const [x, y] = spot(deg, high + (14 * (high - low)) / r);
      g.fillText(`${number(deg, 0)}°`, x, y);
    }
    this.cuts.forEach((cut, k) => {
      g.strokeStyle = series(k);
      g.lineWidth = 1.5;
      g.beginPath();
      let on = false;
      for (const [x, y] of cut) {
        if (!Number.isFinite(y)) { on = false; continue; }
        const p = spot(x, y);
        on ? g.lineTo(...p) : g.moveTo(...p);
        on = true;
      }
      g.stroke();
    });
  }

  can_image() {
    const t = this.tables[0];
    return t.axes.frequency_hz.length >= 8 && t.axes.azimuth_deg.length >= 8 && t.vv_re_m;
  }

  /** Where in the target the echoes come from: an image of the first table's sweep over frequency and azimuth. */
  draw_image() {
    const t = this.tables[0];
    const elevation = t.axes.elevation_deg[Math.min(this.fixed.elevation_deg, t.axes.elevation_deg.length - 1)];
    const box = sizes(t);
    const levels = image(t, elevation, box);
    const high = levels.reduce((m, v) => (v > m ? v : m), -Infinity);
    this.grid = null;
    const axis = (label, span, n) => ({ label, first: -0.5 * span + (0.5 * span) / n, step: span / n });
    this.map.box.hidden = false;
    this.map.show({ columns: box.n, rows: box.n, at: (r, c) => levels[r * box.n + c], x: axis("y / m, positive left", box.y_m, box.n), y: axis("x / m, positive towards the radar at azimuth 0", box.x_m, box.n), low: high - 40, high });
    this.map.note.textContent = `VV, cells of ${number(box.dx_m, 3)} m along x and ${number(box.dy_m, 3)} m along y`;
  }

  /** The first table's map over azimuth and elevation, where it has both. */
  draw_map() {
    if (this.shown === "image" && this.can_image()) return this.draw_image();
    const t = this.tables[0], a = t.axes.azimuth_deg, e = t.axes.elevation_deg;
    const even = (l) => l.length > 1 && l.every((v, i) => Math.abs(v - l[0] - (i * (l.at(-1) - l[0])) / (l.length - 1)) < 1e-6 * (1 + Math.abs(v)) + 1e-3 * ((l.at(-1) - l[0]) / (l.length - 1)));
    this.map.box.hidden = !(even(a) && even(e));
    if (this.map.box.hidden) return;
    const f = t.axes.frequency_hz[Math.min(this.fixed.frequency_hz, t.axes.frequency_hz.length - 1)];
    const grid = new Float64Array(a.length * e.length).fill(NaN), level = t[`${this.pair}_dbsm`];
    const step = (l) => (l.at(-1) - l[0]) / (l.length - 1);
    for (let i = 0; i < level.length; i++) {
      if (t.frequency_hz[i] !== f) continue;
      grid[Math.round((t.elevation_deg[i] - e[0]) / step(e)) * a.length + Math.round((t.azimuth_deg[i] - a[0]) / step(a))] = Number.isFinite(level[i]) ? level[i] : NaN;
    }
    const high = grid.reduce((m, v) => (v > m ? v : m), -Infinity);
    this.grid = { grid, a, e, step };
    this.map.show({ columns: a.length, rows: e.length, at: (r, c) => grid[r * a.length + c], x: { label: "azimuth / °", first: a[0], step: step(a) }, y: { label: "elevation / °", first: e[0], step: step(e) }, low: high - 50, high });
  }

  hover(r, c) {
    if (r == null || !this.grid) return;
    const { grid, a, e } = this.grid;
    this.turn(a[c], e[r]);
    this.map.note.textContent = `azimuth ${number(a[c])}°, elevation ${number(e[r])}°: ${number(grid[r * a.length + c])} dBsm; a click cuts here`;
  }

  pick(r, c) {
    if (!this.grid) return;
    this.fixed.azimuth_deg = c;
    this.fixed.elevation_deg = r;
    this.update();
  }

  key_press() {}

  theme() {
    this.body?.theme();
    this.lines.again();
    this.polar.redraw();
    this.map.redraw();
  }
}
