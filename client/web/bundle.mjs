// Writes the page, with a compressed copy of each file beside it, into the folder that PNEUMA_PAGE names (or dist/page).
import { build } from "esbuild";
import { copyFileSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

const folder = process.env.PNEUMA_PAGE ?? "dist/page";
rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
await build({
  entryPoints: { viewer: "viewer/main.ts", "decode-worker": "src/decode_worker.ts", style: "viewer/style.css" },
  bundle: true,
  chunkNames: "[name]-[hash]",
  format: "esm",
  legalComments: "eof",
  logLevel: "warning",
  minify: true,
  outdir: folder,
  preserveSymlinks: true,
  splitting: true,
  target: "es2022",
});
for (const name of ["index.html", "icon.svg"]) copyFileSync(join("viewer", name), join(folder, name));
let bytes = 0;
for (const name of readdirSync(folder)) {
  const compressed = gzipSync(readFileSync(join(folder, name)), { level: 9 });
  writeFileSync(join(folder, `${name}.gz`), compressed);
  bytes += compressed.length;
}
// A second or two of a slow phone line (2 Mbit/s), and twice what it is: three.js, its largest part, is to come in once.
const bytesMax = 350_000;
console.log(`the page is ${Math.ceil(bytes / 1000)} kB compressed`);
if (bytes > bytesMax) throw new Error(`that is past ${bytesMax / 1000} kB`);
