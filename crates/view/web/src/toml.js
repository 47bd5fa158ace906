// The numbers of a TOML text with their places in it. A form needs no more, and what surrounds them stays as it was written.

const NUMBER = /^[+-]?(?:\d[\d_]*)(?:\.\d[\d_]*)?(?:[eE][+-]?\d+)?$/;

/**
 * All numbers outside strings, comments and headers: `{from, to, line, table, key, place}` with the offsets of the text, the line from 1, the
 * header of the table, the key, and the number's place among several of its key.
 */
export function numbersOf(text) {
  const out = [];
  const seen = new Map();
  let table = "", key = "", place = 0, line = 1, i = 0, fresh = true;
  const skip = (quote) => {
    const long = text.startsWith(quote.repeat(3), i);
    const end = long ? quote.repeat(3) : quote;
    i += end.length;
    while (i < text.length && !text.startsWith(end, i)) {
      if (text[i] === "\n") line++;
      i += text[i] === "\\" && quote === '"' ? 2 : 1;
    }
    i += end.length;
  };
  while (i < text.length) {
    const c = text[i];
    if (c === "\n") {
      line++;
      i++;
      fresh = true;
    } else if (c === "#") {
      while (i < text.length && text[i] !== "\n") i++;
    } else if (c === '"' || c === "'") {
      fresh = false;
      skip(c);
    } else if (fresh && c === "[") {
      // A header; arrays begin behind their key.
      const header = /^\[+\s*([^\]\n]*?)\s*\]+/.exec(text.slice(i));
      if (header && depth(text, i) === 0) {
        const count = (seen.get(header[0]) ?? 0) + 1;
        seen.set(header[0], count);
        table = header[0].startsWith("[[") ? `${header[1]} ${count}` : header[1];
        i += header[0].length;
      } else i++;
      fresh = false;
    } else if (/[A-Za-z0-9_+-]/.test(c)) {
      const word = /^[A-Za-z0-9_+.:-]+/.exec(text.slice(i))[0];
      const behind = /^\s*=/.exec(text.slice(i + word.length));
      if (behind) {
        key = word;
        place = 0;
      } else if (NUMBER.test(word)) {
        out.push({ from: i, to: i + word.length, line, table, key, place: place++ });
      }
      i += word.length;
      fresh = false;
    } else {
      if (!/\s/.test(c)) fresh = false;
      i++;
    }
  }
  return out;
}

/** Whether an offset lies inside an array that began on an earlier line: brackets that are open before it. */
function depth(text, at) {
  let open = 0;
  for (const line of text.slice(0, at).split("\n")) {
    const bare = line.replace(/"(?:[^"\\]|\\.)*"|'[^']*'/g, "").replace(/#.*$/, "");
    if (open === 0 && /^\s*\[/.test(bare)) continue;
    for (const c of bare) open += c === "[" || c === "{" ? 1 : c === "]" || c === "}" ? -1 : 0;
  }
  return open;
}

/** The text with another number in the place of one. */
export function withNumber(text, number, value) {
  return text.slice(0, number.from) + value + text.slice(number.to);
}
