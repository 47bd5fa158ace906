// A run: scene, map, profile and points of each frame, linked.

import { classColour, MAPS, series, shade } from "./colours.js";
import { column, data, frame, frameCount, levels, numbers, rows, unit, words } from "./data.js";
import { canvas, colour, el, menu, number } from "./dom.js";
import { LevelMap } from "./map.js";
import { Lines } from "./plot.js";
import { ESTIMATE, lookAxes, SceneView, toWorld, TRUTH } from "./scene3d.js";

const PATHS = [[230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0], [240, 228, 66]];
/** Colours of the classes of a mask's cells: undefined, lane, vehicle, guard rail, marker; the first is not drawn. */
const MASK = [null, [86, 180, 233], [230, 159, 0], [0, 114, 178], [0, 158, 115]];
const COLOURS = [["range_rate_mps", "range rate"], ["rcs_dbsm", "cross section"], ["snr_db", "SNR"], ["power_dbm", "power"], ["class", "class"], ["ghost", "ghost or not"]];

export class RunView {
  constructor() {
    this.index = 0;
    this.radar = 0;
    this.by = "range_rate_mps";
    this.names = new Map((data.scene?.objects ?? []).map((o) => [o.id, o]));
    this.scene = new SceneView({ pick: (hit) => this.hit(hit) });
    this.map = new LevelMap({ name: "range-Doppler map", unit: "dBm", hover: (r, c) => this.hover(r, c), pick: (r, c, mark) => (mark ? this.choose(mark.id) : this.cell(r, c)) });
    this.profile = new Lines({ x: "range / m", y: "power / dBm" });
    this.spectrum = new Lines({ x: "azimuth / °", y: "level / dB" });
    this.details = el("div", { class: "details" });
    this.list = el("div", { class: "list" });
    this.element = this.layout();
  }

  async start() {
    this.scene.set(data.scene);
    await this.go(0);
    this.reset();
  }

  /** Shows other data of the same radars in place of those before; the view stays where it is. */
  async renew() {
    this.names = new Map((data.scene?.objects ?? []).map((o) => [o.id, o]));
    this.scene.set(data.scene);
    this.slider.max = Math.max(0, frameCount - 1);
    await this.go(Math.min(this.index, frameCount - 1));
  }

  layout() {
    const choices = el("div", { class: "tools" },
      data.radars.length > 1 && menu("radar", data.radars.map((r, k) => [String(k), r.name]), "0", (v) => this.take(Number(v))),
      menu("colour", COLOURS, this.by, (v) => { this.by = v; this.paint(); }),
      menu("map", [["viridis", "viridis"], ["cividis", "cividis"]], "viridis", (v) => { this.map.palette = v; this.draw(); }),
      this.follower(), this.toggle("lanes", "lanes"), data.lanes && this.toggle("lane estimates", "estimates"), this.toggle("field of view", "field"), this.toggle("tracks", "tracks"), this.toggle("mask", "mask"),
      el("button", { onclick: () => this.reset(), title: "Behind the vehicle (r)" }, "behind"),
      el("button", { onclick: () => this.top(), title: "From above (t)" }, "above"));
    this.legend = canvas((g, w, h) => this.key(g, w, h));
    this.legend.canvas.className = "key";
    this.legendText = el("div", { class: "key-text" });
    this.found = el("div", { class: "legend found" });
    this.part = el("p", { class: "part", role: "status", hidden: true });
    const left = el("section", { class: "left" }, choices, this.part, this.scene.box, el("div", { class: "legend" }, this.legend.canvas, this.legendText), data.lanes && this.found);
    this.tabs = {};
    const bodies = [["map", "range-Doppler", this.map.box], ["profile", "profile", this.profile.box], ["spectrum", "angles", this.spectrum.box], ["list", "points", this.list]];
    const buttons = bodies.map(([id, text, body], k) => {
      const b = el("button", { role: "tab", title: `${text} (${k + 1})`, onclick: () => this.tab(id) }, text);
      this.tabs[id] = { button: b, body };
      return b;
    });
    const right = el("section", { class: "right" }, el("div", { class: "tabs", role: "tablist" }, buttons), el("div", { class: "panes" }, bodies.map((b) => b[2])), this.details);
    this.slider = el("input", { type: "range", min: 0, max: Math.max(0, frameCount - 1), value: 0, step: 1, "aria-label": "frame", oninput: () => this.go(Number(this.slider.value)) });
    this.play = el("button", { onclick: () => this.toggle_play(), title: "Play or stop (space)" }, "▶");
    this.clock = el("span", { class: "clock" });
    this.bars = canvas((g, w, h) => this.figures(g, w, h));
    this.bars.canvas.className = "bars";
    const time = el("footer", { class: frameCount > 1 ? "time" : "time single" },
      el("button", { onclick: () => this.step(-1), title: "Frame before (←)" }, "|◀"), this.play,
      el("button", { onclick: () => this.step(1), title: "Next frame (→)" }, "▶|"),
      el("div", { class: "track" }, this.bars.canvas, this.slider), this.clock);
    this.tab("map");
    return el("main", { class: "run" }, left, right, time);
  }

  follower() {
    this.follow = el("input", { type: "checkbox", checked: true });
    return el("label", { class: "toggle", title: "Whether the view goes along with the vehicle" }, this.follow, "follow");
  }

  toggle(text, layer) {
    const box = el("input", { type: "checkbox", checked: true, onchange: () => this.scene.show(layer, box.checked) });
    return el("label", { class: "toggle" }, box, text);
  }

  tab(id) {
    for (const [k, { button, body }] of Object.entries(this.tabs)) {
      button.setAttribute("aria-selected", String(k === id));
      body.hidden = k !== id;
    }
    this.map.redraw();
    this.profile.size();
    this.spectrum.size();
  }

  key_press(e) {
    const act = { " ": () => this.toggle_play(), ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1), r: () => this.reset(), t: () => this.top(), n: () => this.next(1), p: () => this.next(-1), Escape: () => this.choose(null) }[e.key];
    const tab = ["map", "profile", "spectrum", "list"][Number(e.key) - 1];
    if (tab) this.tab(tab);
    else if (act) {
      e.preventDefault();
      act();
    }
  }

  next(by) {
    if (this.count) this.choose(((this.chosen ?? (by > 0 ? -1 : this.count)) + by + this.count) % this.count);
  }

  step(by) {
    this.go(Math.min(frameCount - 1, Math.max(0, this.index + by)));
  }

  toggle_play() {
    this.playing = !this.playing;
    this.play.textContent = this.playing ? "❚❚" : "▶";
    const on = async () => {
      if (!this.playing) return;
      const began = performance.now();
      await this.go((this.index + 1) % frameCount);
      const wait = 1000 * Math.max(0.03, Math.min(0.5, this.interval()));
      setTimeout(on, Math.max(0, wait - (performance.now() - began)));
    };
    on();
  }

  interval() {
    return frameCount > 1 ? (data.frames.at(-1).time_s - data.frames[0].time_s) / (frameCount - 1) : 0.1;
  }

  /** Shows a frame. Later calls win over earlier ones whose frames arrive late. */
  async go(index) {
    const ticket = (this.ticket = (this.ticket ?? 0) + 1);
    let f;
    try {
      f = await frame(index);
    } catch (e) {
      if (ticket === this.ticket) this.complain(e.message);
      return;
    }
    if (ticket !== this.ticket) return;
    this.index = index;
    this.frame = f;
    this.slider.value = index;
    this.scene.move(index);
    this.scene.boxes(f.boxes);
    this.scene.lanes(f.lanes);
    if (data.lanes) this.lane_figures(f.estimate);
    this.take(this.radar);
  }

  complain(text) {
    this.playing = false;
    this.play.textContent = "▶";
    this.details.replaceChildren(el("p", { class: "missing" }, text));
  }

  take(radar) {
    this.radar = radar;
    this.about = data.radars[radar];
    this.own = this.frame.radars[radar];
    const before = this.pose;
    this.chosen = null;
    this.count = rows(this.own.points);
    const pose = (this.pose = this.own.pose ?? [0, 0, 0, 0, 0, 0, 1]);
    // The view goes along with the vehicle; where another scene begins, it starts anew.
    if (before && this.follow.checked) this.scene.along(before, pose);
    this.scene.sensors(this.frame.ego, this.frame.radars.map((r, k) => ({ pose: r.pose, halfAngle: (data.radars[k].max_azimuth_deg * Math.PI) / 180, range: Math.min(data.radars[k].max_range_m, 120) })));
    const world = toWorld(pose);
    const [x, y, z] = ["x_m", "y_m", "z_m"].map((c) => column(this.own.points, c));
    this.positions = new Float32Array(3 * this.count);
    for (let i = 0; i < this.count; i++) this.positions.set(world(x[i], y[i], z[i] ?? 0), 3 * i);
    const mask = this.own.mask_road ?? this.own.mask_markers;
    this.scene.mask(mask && { ...mask, classes: numbers(mask.classes) }, pose, MASK);
    const t = data.tables?.tracks;
    const at = column(t, "frame");
    const tracks = [];
    for (let i = 0; i < at.length; i++) if (at[i] === this.frame.index) tracks.push({ id: column(t, "track_id")[i], x: column(t, "x_m")[i], y: column(t, "y_m")[i], vx: column(t, "vx_mps")[i], vy: column(t, "vy_mps")[i] });
    this.scene.tracks(tracks);
    this.levels = this.own.map && levels(this.own.map);
    this.limits = this.own.threshold && levels(this.own.threshold);
    this.clock.textContent = `frame ${this.frame.index}${this.frame.told ? ` · ${this.frame.told}` : ""} · ${number(this.frame.time_s, 3)} s · ${this.count}${this.own.points_in_file ? ` of ${this.own.points_in_file}` : ""} points${tracks.length ? ` · ${tracks.length} tracks` : ""}`;
    this.part.hidden = !this.own.points_in_file;
    this.part.textContent = `Only the strongest ${this.count} of the ${this.own.points_in_file} points of this frame are shown.`;
    this.file_rows = numbers(this.own.point_rows);
    this.bars.redraw();
    this.paint();
    this.draw();
    this.table();
    this.choose(null);
  }

  /** The lines that were found in this frame, and how far they are from the truth. */
  lane_figures(e) {
    this.scene.estimates(e?.lines);
    const key = (c, text) => el("span", {}, el("i", { style: `background:rgb(${c.join(",")})` }), text);
    const signed = (v, unit, digits) => (v == null ? "–" : `${number(v, digits)} ${unit}`);
    const degrees = e?.heading_error_rad == null ? null : (e.heading_error_rad * 180) / Math.PI;
    const share = (v) => (v == null ? "–" : `${number(100 * v, 1)} %`);
    const figures = [["offset error", signed(e?.offset_error_m, "m", 3)], ["heading error", signed(degrees, "°", 3)], ["curvature error", signed(e?.curvature_error_per_m, "1/m", 5)], ["precision", share(e?.precision)], ["recall", share(e?.recall)]];
    this.found.replaceChildren(key(TRUTH, "true lanes"), key(ESTIMATE, data.lanes.method ? `found by catseye ${data.lanes.method}` : "lane estimates"),
      ...(!e ? [el("span", { class: "hint" }, "no look at this frame")]
        : [e.no_lane && el("span", { class: "hint" }, `no lane: ${e.no_lane}`), e.mirror && el("span", { class: "hint" }, "the mirrored lane fits as well"), ...figures.map(([k, v]) => el("span", {}, `${k} `, el("b", {}, v)))].filter(Boolean)),
      data.lanes.remark ? el("span", { class: "hint" }, data.lanes.remark) : "");
  }

  /** Colours of the points by what is chosen. */
  paint() {
    const values = column(this.own.points, this.by);
    this.colours = new Float32Array(3 * this.count);
    let low = Infinity, high = -Infinity;
    const named = this.by === "class" || this.by === "ghost";
    for (let i = 0; i < this.count && !named; i++) if (Number.isFinite(values[i])) [low, high] = [Math.min(low, values[i]), Math.max(high, values[i])];
    if (this.by === "range_rate_mps") high = -(low = -Math.max(Math.abs(low), Math.abs(high), 1e-3));
    if (!(high > low)) [low, high] = [low - 1 || 0, low + 1 || 1];
    const table = this.by === "range_rate_mps" ? MAPS.diverging : MAPS.viridis;
    this.rgb = (i) => (this.by === "class" ? classColour(values[i]) : this.by === "ghost" ? (values[i] ? [213, 94, 0] : [86, 180, 233]) : shade(table, (values[i] - low) / (high - low)));
    for (let i = 0; i < this.count; i++) this.colours.set(this.rgb(i).map((c) => c / 255), 3 * i);
    this.scene.points(this.positions, this.colours);
    this.scale = { low, high, table, named };
    const classes = this.by === "class" ? [...new Set(values)].sort() : [];
    this.legendText.replaceChildren(...(this.by === "class"
      ? classes.map((c) => el("span", {}, el("i", { style: `background:rgb(${classColour(c).join(",")})` }), c || "no object"))
      : this.by === "ghost" ? [["86,180,233", "where something stands"], ["213,94,0", "ghost"]].map(([c, text]) => el("span", {}, el("i", { style: `background:rgb(${c})` }), text))
        : [el("span", {}, `${words(this.by)} / ${unit(this.by)}`)]));
    this.legend.redraw();
    this.marks();
  }

  key(g, w, h) {
    if (!this.scale || this.scale.named) return;
    const { low, high, table } = this.scale;
    for (let x = 0; x < w; x++) {
      g.fillStyle = `rgb(${shade(table, x / w).join(",")})`;
      g.fillRect(x, 0, 1.5, h - 14);
    }
    g.fillStyle = colour("ink");
    g.font = "11px system-ui";
    g.textBaseline = "bottom";
    g.textAlign = "left";
    g.fillText(number(low, 1), 0, h);
    g.textAlign = "right";
    g.fillText(number(high, 1), w, h);
  }

  draw() {
    const { range_m: x, range_rate_mps: y } = this.about;
    if (!this.levels) {
      this.map.show(null);
      this.hover(null);
      return;
    }
    const all = Array.from({ length: x.count * y.count }, (_, i) => this.levels.at(i)).filter(Number.isFinite).sort((a, b) => a - b);
    const low = all[Math.floor(0.3 * all.length)] ?? 0, high = all.at(-1) ?? 1;
    this.map.show({ columns: x.count, rows: y.count, at: (r, c) => this.levels.at(r * x.count + c), x: { ...x, label: "range / m" }, y: { ...y, label: "range rate / (m/s)" }, low, high });
    this.marks();
  }

  /** A range rate where the map has it: speeds beyond its ends fold. */
  fold(rate) {
    const { first, step, count } = this.about.range_rate_mps;
    const span = step * count, low = first - 0.5 * step;
    const folds = Math.floor((rate - low) / span);
    return { rate: rate - folds * span, folds };
  }

  marks() {
    if (!this.levels) return;
    const [range, rate] = ["range_m", "range_rate_mps"].map((c) => column(this.own.points, c));
    const marks = [];
    for (let i = 0; i < this.count; i++) {
      const f = this.fold(rate[i]);
      marks.push({ x: range[i], y: f.rate, id: i, colour: f.folds ? "#ff2d55" : "#ffffff", shape: f.folds ? "cross" : "ring" });
    }
    this.map.mark_all(marks, this.chosen);
  }

  hover(r, c) {
    if (!this.levels) {
      this.map.note.textContent = "There is no map with this frame: [output] range_doppler = true of a scenario, or [keep] of a recipe, keeps it.";
      return;
    }
    if (r == null) {
      this.map.note.textContent = this.chosen == null ? "Point at a cell for its level; click a ring for its point." : "";
      return;
    }
    const { range_m: x, range_rate_mps: y } = this.about;
    const i = r * x.count + c;
    const limit = this.limits ? `, threshold ${number(this.limits.at(i), 1)} dBm` : "";
    this.map.note.textContent = `${number(x.first + c * x.step)} m, ${number(y.first + r * y.step)} m/s: ${number(this.levels.at(i), 1)} dBm${limit}`;
  }

  /** The row of a cell as a profile over range. */
  cell(r, c) {
    this.row(r, c);
    this.tab("profile");
  }

  row(r, c) {
    if (!this.levels) return;
    const { range_m: x, range_rate_mps: y } = this.about;
    const take = (l) => Array.from({ length: x.count }, (_, k) => { const v = l.at(r * x.count + k); return Number.isNaN(v) ? null : v; });
    const lines = [{ label: "power", colour: series(0), values: take(this.levels) }];
    if (this.limits) lines.push({ label: "threshold", colour: series(5), values: take(this.limits), dash: [5, 4] });
    const range = column(this.own.points, "range_m"), rate = column(this.own.points, "range_rate_mps");
    const found = new Array(x.count).fill(null);
    for (let i = 0; i < this.count; i++) {
      const row = Math.round((this.fold(rate[i]).rate - y.first) / y.step);
      const bin = Math.round((range[i] - x.first) / x.step);
      if (row === r && bin >= 0 && bin < x.count) found[bin] = this.levels.at(r * x.count + bin);
    }
    lines.push({ label: "points", colour: series(2), values: found, points: true });
    this.profile.show(Array.from({ length: x.count }, (_, k) => x.first + k * x.step), lines, {
      title: `${number(y.first + r * y.step)} m/s`, marks: c == null ? [] : [{ x: x.first + c * x.step, colour: "#ff2d55" }],
    });
  }

  /** The angle spectrum of the cell that is nearest to a point. */
  angles(i) {
    const cells = this.own.spectrum_cells, azimuth = this.about.azimuth_deg;
    if (!cells || !azimuth?.length) {
      this.spectrum.box.replaceChildren(el("p", { class: "missing" }, "The run has no angle spectra ([output] angle_spectra = true keeps them)."));
      return;
    }
    const [range, rate] = ["range_m", "range_rate_mps"].map((c) => column(cells, c));
    const [pr, pv] = ["range_m", "range_rate_mps"].map((c) => column(this.own.points, c)[i]);
    let best = 0, least = Infinity;
    for (let k = 0; k < range.length; k++) {
      const d = ((range[k] - pr) / this.about.range_m.step) ** 2 + ((this.fold(rate[k]).rate - this.fold(pv).rate) / this.about.range_rate_mps.step) ** 2;
      if (d < least) [best, least] = [k, d];
    }
    const l = levels(this.own.spectra.levels), [, ne, na] = this.own.spectra.shape;
    // Over elevations the largest, as the search takes it.
    const values = Array.from({ length: na }, (_, a) => Math.max(...Array.from({ length: ne }, (_, e) => l.at((best * ne + e) * na + a))));
    this.spectrum.box.querySelector(".missing")?.remove();
    this.spectrum.show(azimuth, [{ label: "level", colour: series(0), values }], { title: `${number(range[best])} m, ${number(rate[best])} m/s`, marks: [{ x: column(this.own.points, "azimuth_deg")[i], colour: "#ff2d55" }] });
  }

  name(id) {
    const o = this.names.get(id) ?? this.frame.boxes?.find((b) => b.id === id);
    return o ? `${o.name || o.class || "object"} (${id})` : id ? `object ${id}` : "nothing known";
  }

  hit(hit) {
    if (hit.point != null) this.choose(hit.point);
    else if (hit.object) {
      this.choose(null);
      const o = hit.object;
      const actor = this.frame.actors?.find((a) => a.parts?.includes(o.id) || a.id === o.id);
      this.details.replaceChildren(el("h2", {}, this.name(o.id)), facts([
        ["class", o.class || "–"], ["material", data.scene?.materials[hit.material] ?? "–"], ["place", hit.at.map((v) => number(v)).join(", ") + " m"],
        ...(o.radar === false ? [["radar", "sees through it"]] : []),
        ...(actor ? [["returns", actor.returns], ["their power", actor.power_dbm == null ? "–" : `${number(actor.power_dbm, 1)} dBm`], ["points", actor.points], ["ghosts of it", actor.ghosts]] : []),
      ]));
    } else this.choose(null);
  }

  /** Chooses a point: marks it everywhere, and says why it is there. */
  choose(i) {
    this.chosen = i;
    this.marks();
    this.list.querySelector("tr.on")?.classList.remove("on");
    if (i == null) {
      this.scene.choose(null);
      this.details.replaceChildren(el("p", { class: "hint" }, "Click a point, a ring in the map or a row of the table: its numbers and the ways of its echoes appear here."));
      this.hover(null);
      return;
    }
    const p = this.own.points, get = (name) => column(p, name)[i];
    const rad = (d) => ((d ?? 0) * Math.PI) / 180;
    const at = [...this.positions.subarray(3 * i, 3 * i + 3)];
    const std = ["range_std_m", "azimuth_std_deg", "elevation_std_deg"].map(get);
    const lengths = [std[0], rad(std[1]) * get("range_m"), rad(std[2]) * get("range_m")].map((s) => Math.max(0.02, 3 * (s || 0)));
    this.scene.choose(at, lookAxes(rad(get("azimuth_deg")), rad(get("elevation_deg")), this.pose), lengths);
    const fold = this.fold(get("range_rate_mps"));
    const row = Math.round((fold.rate - this.about.range_rate_mps.first) / this.about.range_rate_mps.step);
    this.row(row, Math.round((get("range_m") - this.about.range_m.first) / this.about.range_m.step));
    this.angles(i);
    const value = (name) => { const v = get(name); return v === "" || v == null || Number.isNaN(v) ? "–" : `${v} ${unit(name)}`.trim(); };
    const ghost = Boolean(get("ghost"));
    const states = [["ghost", "ghost"], ["side_lobe", "side lobe"], ["folded", "folded"], ["aliased", "aliased"]].filter(([name]) => get(name)).map(([, word]) => word);
    const head = [get("class") || "no object", ...states].join(", ");
    const sum = [["range", `${number(get("range_m"))} ± ${number(std[0], 3)} m`], ["range rate", `${number(get("range_rate_mps"))} m/s${fold.folds ? ` (folds to ${number(fold.rate)})` : ""}`],
      ["azimuth", `${number(get("azimuth_deg"))} ± ${number(std[1], 2)}°`], ["SNR", `${number(get("snr_db"), 1)} dB`], ["cross section", `${number(get("rcs_dbsm"), 1)} dBsm`], ["object", this.name(get("object_id"))], ["its share", `${number(100 * get("share"), 1)} %`]];
    const cause = this.own.causes?.[i];
    const world = toWorld(this.pose);
    const paths = (cause?.echoes ?? []).map((e, k) => {
      const known = e.places.filter(Boolean);
      const whole = known.length === e.bounces && e.bounces > 0;
      return { places: [this.pose.slice(0, 3), ...known.map((q) => world(...q)), this.pose.slice(0, 3)], known: whole, rgb: PATHS[k % PATHS.length], echo: e };
    }).filter((q) => q.places.length > 2);
    this.scene.paths(paths);
    const echoes = (cause?.echoes ?? []).map((e, k) => el("li", {
      onmouseenter: () => this.scene.paths(paths, k), onmouseleave: () => this.scene.paths(paths), tabIndex: 0, onfocus: () => this.scene.paths(paths, k),
    }, el("i", { style: `background:rgb(${PATHS[k % PATHS.length].join(",")})` }), el("b", {}, `${number(e.power_dbm, 1)} dBm`), ` ${e.bounces} ${e.bounces === 1 ? "bounce" : "bounces"}: `,
      ["radar", ...e.chain.map((id) => this.name(id)), "radar"].join(" → ")));
    this.details.replaceChildren(
      el("h2", {}, `Point ${this.file_rows ? this.file_rows[i] : i}: `, el("span", { style: `color:rgb(${classColour(get("class")).join(",")})` }, head)), facts(sum),
      el("h3", {}, "Why it is there"),
      cause ? el("ol", { class: "echoes" }, echoes.length ? echoes : "No echo falls into its cell: noise, or a side lobe of something far away.") : el("p", { class: "missing" }, "There are no returns with this frame: [output] returns = true of a scenario keeps them."),
      cause && cause.in_cell > echoes.length ? el("p", { class: "hint" }, `${cause.in_cell} echoes fall into this cell and beam; those that the beam hears most are listed.`) : "",
      cause && paths.length === 0 && echoes.length ? el("p", { class: "hint" }, "[output] return_places = true keeps the places of bounces, so that ways can be drawn.") : "",
      el("details", {}, el("summary", {}, "all columns of points.csv"), facts(Object.keys(p).map((name) => [name, value(name)]), "columns")));
    const line = this.list.querySelector(`tr[data-row="${i}"]`);
    line?.classList.add("on");
    line?.scrollIntoView({ block: "nearest" });
  }

  /** The points as a table; of very many only the first. */
  table() {
    const MOST = 500;
    const names = ["range_m", "range_rate_mps", "azimuth_deg", "snr_db", "rcs_dbsm", "class", "ghost"];
    const columns = names.map((n) => column(this.own.points, n));
    const body = el("tbody");
    for (let i = 0; i < Math.min(MOST, this.count); i++) {
      const tr = el("tr", { onclick: () => this.choose(i) }, columns.map((c, k) => el("td", {}, k === 6 ? (c[i] ? "ghost" : "") : typeof c[i] === "number" ? number(c[i]) : c[i] ?? "–")));
      tr.dataset.row = i;
      body.append(tr);
    }
    this.list.replaceChildren(el("table", {}, el("thead", {}, el("tr", {}, names.map((n) => el("th", {}, `${words(n)}${unit(n) ? ` / ${unit(n)}` : ""}`)))), body),
      this.count > MOST ? el("p", { class: "hint" }, `The first ${MOST} of ${this.count} points; all are in the scene and the map.`) : "");
  }

  /** Points of each frame as bars behind the slider. */
  figures(g, w, h) {
    const own = data.notes.filter((n) => data.radars.length === 1 || n.radar === data.radars[this.radar].name);
    const most = Math.max(1, ...own.map((n) => n.points));
    own.forEach((n, k) => {
      g.fillStyle = k === this.index ? "#ff2d55" : colour("bar");
      const x = (k / own.length) * w;
      g.fillRect(x, h - (h * n.points) / most, Math.max(1, w / own.length - 1), (h * n.points) / most);
    });
  }

  reset() {
    const [at, ahead] = [toWorld(this.pose)(18, 0, 0), toWorld(this.pose)(-14, 0, 9)];
    this.scene.look(at, ahead);
  }

  top() {
    const at = toWorld(this.pose)(25, 0, 0);
    this.scene.look(at, [at[0] - 0.1, at[1], at[2] + 60]);
  }

  theme() {
    this.scene.theme();
    this.map.redraw();
    this.profile.again();
    this.spectrum.again();
    this.legend.redraw();
    this.bars.redraw();
  }
}

function facts(pairs, cls = "facts") {
  return el("dl", { class: cls }, pairs.flatMap(([k, v]) => [el("dt", {}, k), el("dd", {}, v)]));
}
