// Maps of colours that hold for all kinds of sight: viridis and cividis grow evenly in lightness, the diverging one runs from blue
// over grey to orange, and classes have the eight colours of Okabe and Ito.

/** Anchors of matplotlib's viridis and cividis (CC0), sixteen steps each. */
const VIRIDIS = ["440154", "481a6c", "472f7d", "414487", "39568c", "31688e", "2a788e", "23888e", "1f988b", "22a884", "35b779", "54c568", "7ad151", "a5db36", "d2e21b", "fde725"];
const CIVIDIS = ["00224e", "002d6c", "16396d", "30466b", "434e6c", "535a6e", "61666f", "707173", "7f7c75", "8f8977", "a09676", "b1a372", "c3b16c", "d6bf61", "e9ce52", "fee838"];
const DIVERGING = ["0b4f8a", "2f77b4", "66a3d2", "a3c8e2", "c9cdd2", "f0c08c", "ea9a4a", "d6721f", "a64b00"];

const rgb = (hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16));

function table(anchors) {
  const stops = anchors.map(rgb);
  const out = new Uint8ClampedArray(256 * 3);
  for (let i = 0; i < 256; i++) {
    const x = (i / 255) * (stops.length - 1);
    const k = Math.min(stops.length - 2, Math.floor(x));
    for (let c = 0; c < 3; c++) out[3 * i + c] = stops[k][c] + (x - k) * (stops[k + 1][c] - stops[k][c]);
  }
  return out;
}

export const MAPS = { viridis: table(VIRIDIS), cividis: table(CIVIDIS), diverging: table(DIVERGING) };

/** Red, green and blue from 0 to 255 of a share from 0 to 1. */
export function shade(map, share) {
  const i = 3 * Math.round(255 * Math.min(1, Math.max(0, share)));
  return [map[i], map[i + 1], map[i + 2]];
}

/** Okabe and Ito (2008), without black, which would not show in the dark. */
const QUALITATIVE = ["0072B2", "E69F00", "009E73", "CC79A7", "56B4E9", "D55E00", "F0E442"].map(rgb);
const CLASSES = { car: 1, van: 1, truck: 5, bus: 5, motorcycle: 6, cyclist: 3, pedestrian: 3, child: 3, guard_rail: 0, post: 4, marker: 2, wall: 4, noise: 6, weather: 6 };

/** The colour of a class, the same in every page. */
export function classColour(name) {
  const base = String(name).split(".")[0];
  if (base in CLASSES) return QUALITATIVE[CLASSES[base]];
  let h = 7;
  for (const c of base) h = (31 * h + c.charCodeAt(0)) >>> 0;
  return base ? QUALITATIVE[h % QUALITATIVE.length] : [140, 140, 140];
}

export const series = (k) => `rgb(${QUALITATIVE[k % QUALITATIVE.length].join(",")})`;

/** Colours of surfaces by material: those of the program's table, and words that stand in the names of others. */
const MATERIALS = {
  asphalt: "4a4d52", concrete: "9a9a94", "concrete-pavement": "b0aca0", gravel: "8a8172", soil: "6f6250", "arable-land": "7d5b3a", grass: "5d7a4a", meadow: "7a9a55", leaves: "5d7a4a",
  water: "3f6f8f", ice: "bfe3f0", glass: "7fb2c9", rubber: "2b2b2e", steel: "a3adb8", "stainless-steel": "8d9db0", "galvanised-steel": "93a69d", aluminium: "c3cad1", copper: "b87333", pec: "b9c1ca",
  "paint-white": "f2f2ee", iron: "8f959c", polypropylene: "d07fae", pmma: "57b8ae", wood: "b07f45", skin: "e0a98a", air: "dfe7ee",
};
/** The longest word of the table that a name holds, so that stainless steel is not steel. */
function listed(name) {
  const held = Object.keys(MATERIALS).filter((k) => name.includes(k)).sort((a, b) => b.length - a.length);
  return held.length ? rgb(MATERIALS[held[0]]) : null;
}

/** The colour of a material: layers over a body are mixed with it, and a name that is not listed always has the same colour. */
export function materialColour(name, cls) {
  if (["verge", "terrain", "ground"].includes(cls)) return rgb(MATERIALS.grass);
  const [body, ...layers] = String(name).toLowerCase().split("+").map((part) => part.split(":")[0]);
  const paler = (c) => c.map((v) => Math.round(0.6 * v + 70));
  const of = (part) => listed(part) ?? paler(part ? classColour(`material ${part}`) : classColour(cls));
  const own = of(body), top = layers.length ? of(layers.at(-1)) : own;
  return own.map((v, i) => Math.round(0.5 * (v + top[i])));
}
