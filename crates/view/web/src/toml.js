// The numbers of a TOML text with their places in it. What surrounds them stays as it was written.

import { parseTOML } from "toml-eslint-parser";

/** What a field may hold: a decimal number as TOML writes it. */
export const NUMBER = /^[+-]?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?$/;

/**
 * All numbers of a text: `{from, to, whole, line, path, group}` with the offsets of the number, whether it is written as a whole one, the line
 * of its key, the path to it (`["object 2", "position_m 1"]`; what is several is counted from 1), and the part of the path that its table
 * has. Throws an error with the line where the text is no TOML.
 */
export function numbersOf(text) {
  const out = [];
  const name = (parts) => parts.reduce((list, part) => (typeof part === "number" ? [...list.slice(0, -1), `${list.at(-1)} ${part + 1}`] : [...list, String(part)]), []);
  const key = (node) => node.keys.map((k) => (k.type === "TOMLBare" ? k.name : k.value));
  const value = (node, path, group, line) => {
    if (node.type === "TOMLArray") node.elements.forEach((e, i) => value(e, node.elements.length > 1 ? [...path, i] : path, group, line));
    else if (node.type === "TOMLInlineTable") for (const pair of node.body) value(pair.value, [...path, ...key(pair.key)], group, pair.key.loc.start.line);
    else if (node.kind === "integer" || node.kind === "float") {
      const whole = node.kind === "integer";
      // Numbers to other bases, and those that are none, are left to the text.
      if (NUMBER.test(text.slice(...node.range).replaceAll("_", ""))) out.push({ from: node.range[0], to: node.range[1], whole, line, path: name(path), group: name(group) });
    }
  };
  for (const node of parseTOML(text).body[0].body) {
    const pairs = node.type === "TOMLTable" ? node.body : [node];
    const above = node.type === "TOMLTable" ? node.resolvedKey : [];
    for (const pair of pairs) value(pair.value, [...above, ...key(pair.key)], above, pair.key.loc.start.line);
  }
  return out;
}

/** Puts another number in the place of the k-th of `numbers`, whose places move along; the text with it. */
export function put(text, numbers, k, written) {
  const { from, to } = numbers[k];
  const longer = written.length - (to - from);
  for (const n of numbers) {
    if (n.from > from) n.from += longer;
    if (n.to > from) n.to += longer;
  }
  return text.slice(0, from) + written + text.slice(to);
}
