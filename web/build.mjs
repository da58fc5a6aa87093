// node build.mjs FOLDER: bundles the page into a folder, with the licences of what is bundled.
import { build } from "esbuild";
import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2];
if (!out) {
  console.error("usage: node build.mjs FOLDER");
  process.exit(2);
}
mkdirSync(out, { recursive: true });
await build({
  entryPoints: [join(here, "src/main.ts")],
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "none", // they are in licences.txt
  outfile: join(out, "studio.js"),
  logLevel: "warning",
});
const uplot = readFileSync(join(here, "node_modules/uplot/dist/uPlot.min.css"), "utf8");
writeFileSync(join(out, "studio.css"), uplot + "\n" + readFileSync(join(here, "studio.css"), "utf8"));
copyFileSync(join(here, "index.html"), join(out, "index.html"));
const licences = ["three", "uplot"].map((name) => {
  const folder = join(here, "node_modules", name);
  const version = JSON.parse(readFileSync(join(folder, "package.json"), "utf8")).version;
  return `${name} ${version}\n\n${readFileSync(join(folder, "LICENSE"), "utf8")}`;
});
writeFileSync(
  join(out, "licences.txt"),
  "The page of amontons studio holds these libraries.\n\n" + licences.join("\n----\n\n"),
);
