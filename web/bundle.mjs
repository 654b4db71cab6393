// The page's modules for Node.js: `bundled("policy", "simulation")` gives what they export.
import { mkdirSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { build } from "esbuild";
import { mujocoScript } from "./mujoco-script.mjs";

const here = dirname(fileURLToPath(import.meta.url));

export async function bundled(...names) {
  const outfile = join(here, "node_modules", ".cache", `bundled-${process.pid}.mjs`);
  mkdirSync(dirname(outfile), { recursive: true });
  await build({
    stdin: { contents: names.map((name) => `export * from "./src/${name}";`).join("\n"), resolveDir: here },
    outfile,
    bundle: true,
    format: "esm",
    platform: "node",
    plugins: [mujocoScript],
    logLevel: "warning",
  });
  return import(pathToFileURL(outfile).href);
}
