// Builds the page's script and style into ../assets, which the program embeds.
import { build } from "esbuild";
import { readFileSync } from "node:fs";

// Their notices have to go with every copy, so with every page.
const notices = ["three", "uplot", "toml-eslint-parser", "eslint-visitor-keys"].map((name) => `${name}\n\n${readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim()}`).join("\n\n");

await build({
  entryPoints: { view: "src/main.js" },
  bundle: true,
  minify: true,
  format: "iife",
  target: ["es2022"],
  charset: "ascii",
  legalComments: "none",
  banner: { js: `/*\n${notices.replaceAll("©", "(c)")}\n*/` },
  outdir: "../assets",
});
