/** The page begins: what is in it is read, MuJoCo is started, a run is shown. */
import { App } from "./app";
import { blockOf, type PageData, unzipped } from "./data";
import { make } from "./dom";
import { type Mujoco, startEngine } from "./engine";

/** Return MuJoCo, if it runs here, and what stands in the way of the scene. */
async function engineOf(): Promise<[Mujoco | null, string]> {
  if (typeof WebAssembly === "undefined") return [null, "This browser has no WebAssembly, so MuJoCo cannot run in it."];
  const canvas = document.createElement("canvas");
  const trouble = canvas.getContext("webgl2") ? "" : "This browser has no WebGL here, so the scene cannot be drawn.";
  try {
    return [await startEngine(await unzipped(blockOf("wasm"))), trouble];
  } catch (error) {
    return [null, `MuJoCo did not start in this browser: ${error instanceof Error ? error.message : error}`];
  }
}

async function begin(): Promise<void> {
  const data = JSON.parse(blockOf("data")) as PageData;
  const app = new App(data, ...(await engineOf()));
  document.getElementById("app")?.replaceChildren(app.element);
  await app.show(0);
}

begin().catch((error: unknown) => {
  document.getElementById("app")?.append(make("p", { role: "alert", class: "alert" }, `This page failed: ${error}`));
  throw error;
});
