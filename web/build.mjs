// Build what `mjcartpole page` puts into a page: one script, one style sheet, MuJoCo's WebAssembly.
import { createRequire } from "node:module";
import { mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";
import { mujocoScript } from "./mujoco-script.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const target = join(here, "..", "src", "mjcartpole", "page", "assets");
const mujoco = createRequire(import.meta.url).resolve("@mujoco/mujoco");

rmSync(target, { recursive: true, force: true });
mkdirSync(target, { recursive: true });
await build({
  absWorkingDir: here,
  entryPoints: { page: "src/main.ts", style: "src/style.css" },
  outdir: target,
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "ascii",
  legalComments: "none",
  external: ["node:*", "module"],
  define: { "import.meta.url": JSON.stringify("https://nowhere.invalid/") },
  plugins: [mujocoScript],
  logLevel: "warning",
});
const wasm = readFileSync(join(dirname(mujoco), "mujoco.wasm"));
writeFileSync(join(target, "mujoco.wasm.gz"), gzipSync(wasm, { level: 9 }));
