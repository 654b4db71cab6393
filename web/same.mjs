// What the page's code makes of questions, one JSON document on stdin; the answers are held against Python's.
// {edits: [{xml, edits}], policies: [{grid, table, states}], runs: [what run_data returns, …]}
import { readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { bundled } from "./bundle.mjs";

const page = await bundled("cartpole", "data", "edit/meanings", "engine", "parity", "policy", "simulation");
const script = createRequire(import.meta.url).resolve("@mujoco/mujoco");
const mujoco = await page.startEngine(readFileSync(join(dirname(script), "mujoco.wasm")));

function edit({ xml, edits }) {
  try {
    return { xml: page.edited({ mujoco, files: new mujoco.MjVFS(), ownTimestep: true }, xml, edits) };
  } catch (error) {
    return { error: page.wordsOf(error) };
  }
}

function look({ grid, table, states }) {
  const policy = new page.Policy(grid, Float64Array.from(table));
  return states.map((state) => policy.look(state));
}

async function replay(run) {
  const loader = { mujoco, files: new mujoco.MjVFS(), ownTimestep: run.own_timestep };
  const parts = [run.parts, undefined];
  const found = [];
  for (const known of parts) {
    const cartpole = page.loadCartPole(loader, run.document, known);
    const policy = new page.Policy(run.grid, await page.numbersOf(run.table));
    const simulation = new page.Simulation(mujoco, cartpole, run.integrator);
    const { xml: _, model: __, ...understood } = cartpole;
    found.push({ understood, ...page.replay(simulation, policy, await page.numbersOf(run.episode.states)) });
  }
  return found;
}

let text = "";
for await (const part of process.stdin) text += part;
const { edits = [], policies = [], runs = [] } = JSON.parse(text);
const answers = { edits: edits.map(edit), policies: policies.map(look), runs: await Promise.all(runs.map(replay)) };
process.stdout.write(JSON.stringify(answers));
rmSync(join(dirname(script), "..", "..", ".cache"), { recursive: true, force: true });
