// The physics of the program, built for the browser: bindings that `scripts/page-module` makes, and the module that the page carries.

import * as bindings from "../module/catseye_design.js";

export { bindings };

/** Unpacks the module from the page and makes it ready. */
export async function start() {
  const text = atob(document.getElementById("module").textContent);
  const packed = Uint8Array.from(text, (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  bindings.initSync({ module: await new Response(stream).arrayBuffer() });
}
