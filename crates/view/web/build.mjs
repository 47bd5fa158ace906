// Builds the page's script and style into ../assets, which the program embeds.
import { build } from "esbuild";

await build({
  entryPoints: { view: "src/main.js" },
  bundle: true,
  minify: true,
  format: "iife",
  target: ["es2022"],
  charset: "ascii",
  legalComments: "eof",
  loader: { ".css": "css" },
  outdir: "../assets",
});
