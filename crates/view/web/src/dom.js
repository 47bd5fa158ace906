// Elements are made of text alone: nothing that a file says is ever read as markup.

/** An element with attributes (`on…` are listeners, `class`, `title`, …) and children, which are nodes or text. */
export function el(tag, attributes = {}, ...children) {
  const e = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (value == null || value === false) continue;
    if (key.startsWith("on")) e.addEventListener(key.slice(2), value);
    else if (key in e && key !== "list") e[key] = value;
    else if (key === "class") e.className = value;
    else e.setAttribute(key, value);
  }
  e.append(...children.flat().filter((c) => c != null && c !== false).map((c) => (c instanceof Node ? c : String(c))));
  return e;
}

/** A menu of choices: pairs of value and text. */
export function menu(label, choices, value, change) {
  const list = el("select", { "aria-label": label, title: label, onchange: () => change(list.value) },
    choices.map(([v, text]) => el("option", { value: v, selected: v === value }, text)));
  return el("label", { class: "menu" }, el("span", {}, label), list);
}

export function number(x, digits = 2) {
  if (x == null || !Number.isFinite(x)) return "–";
  return x.toFixed(digits).replace("-", "−");
}

/** A canvas as large as its box, redrawn when that changes; `draw` gets the context in CSS pixels. */
export function canvas(draw) {
  const c = el("canvas");
  const redraw = () => {
    const { clientWidth: w, clientHeight: h } = c;
    if (!w || !h) return;
    const scale = window.devicePixelRatio || 1;
    if (c.width !== Math.round(w * scale) || c.height !== Math.round(h * scale)) {
      c.width = Math.round(w * scale);
      c.height = Math.round(h * scale);
    }
    const g = c.getContext("2d");
    g.setTransform(scale, 0, 0, scale, 0, 0);
    g.clearRect(0, 0, w, h);
    draw(g, w, h);
  };
  new ResizeObserver(redraw).observe(c);
  return { canvas: c, redraw };
}

/** Values of the style's variables, for what is drawn. */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** Round ticks over a span, about `count` of them. */
export function ticks(from, to, count) {
  const span = Math.abs(to - from) || 1;
  const raw = span / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
  const out = [];
  for (let k = Math.ceil(Math.min(from, to) / step); k * step <= Math.max(from, to) + 1e-9 * span; k++) out.push(k * step);
  return { list: out, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}
