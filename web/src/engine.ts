/** MuJoCo as WebAssembly, and a few numbers of its interface. */
import loadMujoco, { type MainModule, type MjData, type MjModel, type MjVFS } from "@mujoco/mujoco";

export type Mujoco = MainModule;
export type { MjData, MjModel, MjVFS };

export const JOINT = { free: 0, ball: 1, slide: 2, hinge: 3 } as const;
export const GEOM = { plane: 0, sphere: 2, capsule: 3, ellipsoid: 4, cylinder: 5, box: 6, mesh: 7 } as const;
export const DISABLE = { constraint: 1 << 0, contact: 1 << 4, eulerdamp: 1 << 15, autoreset: 1 << 16 } as const;
export const OBJECT = { body: 1, geom: 5 } as const;

/** Start MuJoCo from its WebAssembly. */
export function startEngine(wasm: ArrayBuffer): Promise<Mujoco> {
  const quiet = () => undefined;
  return loadMujoco({ wasmBinary: wasm, print: quiet, printErr: quiet });
}

/** Return MuJoCo's own words of an error. */
export function wordsOf(error: unknown): string {
  const text = error instanceof Error ? error.message : String(error);
  return text.replace(/^MuJoCo Error: (Loading error: )?/, "").trim();
}
