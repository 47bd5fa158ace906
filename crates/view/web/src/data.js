// What the page was given: the data element, and frames that stand in the page or lie beside it.

const TYPES = { u8: Uint8Array, f32: Float32Array, f64: Float64Array, u32: Uint32Array, u16: Uint16Array };

/** Numbers as a typed array or a plain one; null stays null. */
export function numbers(packed) {
  if (packed == null || Array.isArray(packed)) return packed;
  for (const [key, type] of Object.entries(TYPES)) {
    if (key in packed) {
      const text = atob(packed[key]);
      const bytes = new Uint8Array(text.length);
      for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
      return new type(bytes.buffer);
    }
  }
  return null;
}

/** Levels in dB: a function from an index to the level, NaN where there is none. */
export function levels(packed) {
  const codes = numbers(packed);
  const { low, step } = packed;
  return { codes, low, high: low + 65534 * step, at: (i) => (codes[i] === 65535 ? NaN : low + step * codes[i]) };
}

function element(id) {
  return JSON.parse(document.getElementById(id).textContent);
}

export const data = element("data");
let inline = element("frames");
export let frameCount = data.frames?.length ?? 0;

/** Takes other data with all its frames in the place of what the page was given. */
export function renew(other, frames) {
  for (const key of Object.keys(data)) delete data[key];
  Object.assign(data, other);
  inline = frames;
  frameCount = data.frames?.length ?? 0;
}

const kept = new Map();
const waiting = new Map();
/** Frames beside the page that stay in memory. */
const MOST_KEPT = 24;

window.catseyeFrame = (index, frame) => {
  kept.set(index, frame);
  while (kept.size > MOST_KEPT) kept.delete(kept.keys().next().value);
  waiting.get(index)?.resolve(frame);
  waiting.delete(index);
};

/** The frame of a number, as a promise. */
export function frame(index) {
  if (index < inline.length) return Promise.resolve(inline[index]);
  if (kept.has(index)) return Promise.resolve(kept.get(index));
  if (waiting.has(index)) return waiting.get(index).promise;
  const entry = {};
  entry.promise = new Promise((resolve, reject) => Object.assign(entry, { resolve, reject }));
  waiting.set(index, entry);
  const script = document.createElement("script");
  script.src = `${encodeURIComponent(data.beside)}/${String(index).padStart(6, "0")}.js`;
  script.onerror = () => {
    waiting.delete(index);
    entry.reject(new Error(`Frame ${data.frames[index].index} is not there: the folder ${data.beside} has to lie beside this page.`));
  };
  script.onload = () => script.remove();
  document.head.append(script);
  return entry.promise;
}

/** A column of a table as an array that may be indexed. */
export function column(table, name) {
  return numbers(table?.[name]) ?? [];
}

export function rows(table) {
  const first = table && Object.keys(table)[0];
  return first ? column(table, first).length : 0;
}

/** The unit that the end of a column's name says, as the program has it. */
const UNITS = [
  ["_rad_per_s", "rad/s"], ["_mps", "m/s"], ["_deg", "°"], ["_dbsm", "dBsm"], ["_dbm", "dBm"], ["_db", "dB"],
  ["_ghz", "GHz"], ["_hz", "Hz"], ["_m", "m"], ["_s", "s"],
];
export function unit(name) {
  return UNITS.find(([end]) => name.endsWith(end))?.[1] ?? "";
}
export function words(name) {
  const end = UNITS.find(([e]) => name.endsWith(e))?.[0] ?? "";
  return name.slice(0, name.length - end.length).replaceAll("_", " ");
}
