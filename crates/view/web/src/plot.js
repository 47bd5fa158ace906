// Lines over an axis, by uPlot.

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { colour, el } from "./dom.js";

/** Ticks with as many decimals as tell them apart. */
function decimals(_, at) {
  const digits = [0, 1, 2, 3, 4, 5, 6, 7, 8].find((d) => at.every((v) => v == null || Math.abs(v - Number(v.toFixed(d))) <= 1e-9 * Math.abs(v))) ?? 8;
  return at.map((v) => (v == null ? "" : v.toFixed(digits).replace("-", "−")));
}

/** Room for the longest of an axis's ticks beside its label. */
const broad = (_, ticks) => 16 + 7 * Math.max(3, ...(ticks ?? []).map((t) => t?.length ?? 0));

/**
 * A plot of lines. `series` are `{label, colour, values, points, told}` over the common `x`; gaps are null, and `told` puts a value into words.
 * `names` are those of x = 0, 1, 2, … where it counts words. `pick` is called with the index under the pointer.
 */
export class Lines {
  constructor({ x, y, pick, height }) {
    this.box = el("div", { class: "plot" });
    this.labels = { x, y };
    this.pick = pick;
    this.height = height;
    new ResizeObserver(() => this.size()).observe(this.box);
  }

  size() {
    if (this.plot && this.box.clientWidth > 0) this.plot.setSize({ width: this.box.clientWidth, height: this.room() });
  }

  room() {
    const beside = [".u-legend", ".u-title"].map((name) => this.plot?.root.querySelector(name)?.offsetHeight ?? 26);
    return this.height ?? Math.max(120, this.box.clientHeight - 10 - beside[0] - beside[1]);
  }

  show(x, series, { title, marks, y, names } = {}) {
    this.last = [x, series, { title, marks, y, names }];
    this.plot?.destroy();
    const ink = colour("ink"), grid = colour("grid");
    const axis = (label) => ({ label, stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid }, labelSize: 18, size: 42, labelFont: "12px system-ui", font: "11px system-ui" });
    const named = names && { splits: () => names.map((_, i) => i), values: (_, at) => at.map((v) => names[v] ?? "") };
    this.plot = new uPlot(
      {
        width: Math.max(100, this.box.clientWidth), height: this.room(), title,
        scales: { x: { time: false, ...(names && { range: [-0.3, names.length - 0.7] }) }, y: { range: y } },
        axes: [{ ...axis(this.labels.x), values: decimals, ...named }, { ...axis(this.labels.y), values: decimals, size: broad }],
        cursor: { drag: { x: true, y: false }, points: { size: 6 } },
        series: [{ label: this.labels.x, ...(names && { value: (_, v) => names[v] ?? "–" }) }, ...series.map((s) => ({
          label: s.label, stroke: s.colour, width: s.points ? 0 : (s.width ?? 1.5), dash: s.dash,
          points: { show: Boolean(s.points), size: 7, fill: s.colour }, value: (_, v) => (v == null ? "–" : (s.told?.(v) ?? v.toFixed(2))),
        }))],
        hooks: {
          draw: [(u) => {
            for (const m of marks ?? []) {
              const at = u.valToPos(m.x, "x", true);
              u.ctx.save();
              u.ctx.strokeStyle = m.colour ?? ink;
              u.ctx.setLineDash([4, 3]);
              u.ctx.beginPath();
              u.ctx.moveTo(at, u.bbox.top);
              u.ctx.lineTo(at, u.bbox.top + u.bbox.height);
              u.ctx.stroke();
              u.ctx.restore();
            }
          }],
          setCursor: [(u) => u.cursor.idx != null && self.pick?.(u.cursor.idx)],
        },
      },
      [x, ...series.map((s) => s.values)],
      this.box,
    );
    requestAnimationFrame(() => this.size());
  }

  again() {
    if (this.last) this.show(...this.last);
  }
}
