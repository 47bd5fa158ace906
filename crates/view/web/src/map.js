// A map of levels over two axes, with marks: range-Doppler maps, and cross sections over azimuth and elevation.

import { MAPS } from "./colours.js";
import { canvas, colour, el, number, ticks } from "./dom.js";

/** A tick in words: of a named axis the whole places alone have a name. */
function told(axis, v, digits) {
  if (!axis.names) return number(v, digits);
  const name = axis.names[v] ?? "";
  return name.length > 9 ? `${name.slice(0, 8)}…` : name;
}

const EDGE = { left: 52, right: 66, top: 10, bottom: 38 };

/**
 * `show({columns, rows, at(row, column), x, y, low, high})`: x and y are `{label, first, step}` of the cells' middles, with `names`
 * where the cells have words. `hover` is
 * called with (row, column) or null, `pick` with (row, column, mark) on a click.
 */
export class LevelMap {
  constructor({ hover, pick, name, unit }) {
    this.hover = hover;
    this.pick = pick;
    this.unit = unit;
    this.palette = "viridis";
    const { canvas: c, redraw } = canvas((g, w, h) => this.draw(g, w, h));
    this.canvas = c;
    this.redraw = redraw;
    c.setAttribute("role", "img");
    c.setAttribute("aria-label", name);
    this.note = el("div", { class: "note" });
    this.box = el("div", { class: "map" }, c, this.note);
    c.addEventListener("mousemove", (e) => this.move(e));
    c.addEventListener("mouseleave", () => this.hover?.(null));
    c.addEventListener("click", (e) => {
      const at = this.cell(e);
      if (at) this.pick?.(at[0], at[1], this.mark(e));
    });
  }

  show(map) {
    this.map = map;
    if (!map) return this.redraw();
    const { rows, columns, at, low, high } = map;
    const picture = new ImageData(columns, rows);
    const table = MAPS[this.palette];
    const scale = 255 / Math.max(1e-9, high - low);
    for (let r = 0; r < rows; r++) {
      for (let c = 0; c < columns; c++) {
        const v = at(r, c);
        const k = 4 * ((rows - 1 - r) * columns + c);
        const i = 3 * Math.round(Math.min(255, Math.max(0, (v - low) * scale)));
        picture.data[k] = table[i];
        picture.data[k + 1] = table[i + 1];
        picture.data[k + 2] = table[i + 2];
        picture.data[k + 3] = Number.isNaN(v) ? 0 : 255;
      }
    }
    this.picture = document.createElement("canvas");
    this.picture.width = columns;
    this.picture.height = rows;
    this.picture.getContext("2d").putImageData(picture, 0, 0);
    this.redraw();
  }

  /** Marks `{x, y, colour, shape, id}` in the axes' values, the chosen one's id, and a cell to stress. */
  mark_all(marks, chosen) {
    this.marks = marks;
    this.chosen = chosen;
    this.redraw();
  }

  place(w, h) {
    const { x, y, columns, rows } = this.map;
    const plot = { x: EDGE.left, y: EDGE.top, w: Math.max(10, w - EDGE.left - EDGE.right), h: Math.max(10, h - EDGE.top - EDGE.bottom) };
    const span = (axis, n) => [axis.first - 0.5 * axis.step, axis.first + (n - 0.5) * axis.step];
    const [x0, x1] = span(x, columns), [y0, y1] = span(y, rows);
    return { ...plot, x0, x1, y0, y1, px: (v) => plot.x + ((v - x0) / (x1 - x0)) * plot.w, py: (v) => plot.y + ((y1 - v) / (y1 - y0)) * plot.h };
  }

  draw(g, w, h) {
    if (!this.map) return;
    const p = this.place(w, h);
    g.imageSmoothingEnabled = false;
    g.drawImage(this.picture, p.x, p.y, p.w, p.h);
    const ink = colour("ink");
    g.strokeStyle = colour("grid");
    g.strokeRect(p.x, p.y, p.w, p.h);
    g.fillStyle = ink;
    g.font = "11px system-ui";
    g.textAlign = "center";
    g.textBaseline = "top";
    const tx = ticks(p.x0, p.x1, p.w / 70), ty = ticks(p.y0, p.y1, p.h / 40);
    for (const v of tx.list) g.fillText(told(this.map.x, v, tx.digits), p.px(v), p.y + p.h + 4);
    g.fillText(this.map.x.label, p.x + p.w / 2, p.y + p.h + 20);
    g.textAlign = "right";
    g.textBaseline = "middle";
    for (const v of ty.list) g.fillText(told(this.map.y, v, ty.digits), p.x - 5, p.py(v));
    g.save();
    g.translate(10, p.y + p.h / 2);
    g.rotate(-Math.PI / 2);
    g.textAlign = "center";
    g.fillText(this.map.y.label, 0, 0);
    g.restore();
    this.bar(g, p);
    g.save();
    g.beginPath();
    g.rect(p.x, p.y, p.w, p.h);
    g.clip();
    for (const m of this.marks ?? []) {
      const [x, y] = [p.px(m.x), p.py(m.y)];
      const on = m.id === this.chosen;
      g.lineWidth = on ? 3 : 1.5;
      g.strokeStyle = on ? "#ff2d55" : m.colour;
      g.beginPath();
      const r = on ? 8 : 5;
      if (m.shape === "cross") {
        g.moveTo(x - r, y - r); g.lineTo(x + r, y + r); g.moveTo(x - r, y + r); g.lineTo(x + r, y - r);
      } else g.arc(x, y, r, 0, 2 * Math.PI);
      g.stroke();
    }
    g.restore();
  }

  bar(g, p) {
    const x = p.x + p.w + 10, { low, high } = this.map, table = MAPS[this.palette];
    for (let i = 0; i < p.h; i++) {
      const k = 3 * Math.round(255 * (1 - i / p.h));
      g.fillStyle = `rgb(${table[k]},${table[k + 1]},${table[k + 2]})`;
      g.fillRect(x, p.y + i, 10, 1.5);
    }
    g.fillStyle = colour("ink");
    g.textAlign = "left";
    g.textBaseline = "middle";
    const t = ticks(low, high, p.h / 40);
    for (const v of t.list) g.fillText(number(v, t.digits), x + 13, p.y + p.h * (1 - (v - low) / (high - low)));
    g.textBaseline = "top";
    g.fillText(this.unit, x, p.y + p.h + 4);
  }

  cell(e) {
    if (!this.map) return null;
    const box = this.canvas.getBoundingClientRect();
    const p = this.place(box.width, box.height);
    const fx = (e.clientX - box.left - p.x) / p.w, fy = (e.clientY - box.top - p.y) / p.h;
    if (fx < 0 || fx >= 1 || fy < 0 || fy >= 1) return null;
    return [this.map.rows - 1 - Math.floor(fy * this.map.rows), Math.floor(fx * this.map.columns)];
  }

  /** The mark under the pointer. */
  mark(e) {
    const box = this.canvas.getBoundingClientRect();
    const p = this.place(box.width, box.height);
    let best = null, least = 10;
    for (const m of this.marks ?? []) {
      const d = Math.hypot(p.px(m.x) - (e.clientX - box.left), p.py(m.y) - (e.clientY - box.top));
      if (d < least) [best, least] = [m, d];
    }
    return best;
  }

  move(e) {
    const at = this.cell(e);
    this.hover?.(at && at[0], at && at[1]);
  }
}
