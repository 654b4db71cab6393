/** What Python has put into the page: runs, and how their arrays are packed. */

export interface TaskData {
  name: string;
  /** null: a track without an end. */
  x_limit: number | null;
  theta_limit: number | null;
  /** What is drawn is added to it; of every value of a state. */
  start: number[];
  start_low: number;
  start_high: number;
  time_limit: number;
}

/** What was understood of a model: see physics/cartpole.py. */
export interface PartsData {
  slider: number;
  hinges: number[];
  controls: [number, number];
  substeps: number;
  upright: number[];
}

/** The grid of a policy, as its file has it. */
export interface GridData {
  bins: number[];
  low: number[];
  high: number[];
  tilings: number;
  mirror: boolean;
  interpolated: boolean;
  /** Whether poles may turn right round, so that their angles count from -pi to pi. */
  turns: boolean;
}

export interface PictureData {
  title: string;
  alt: string;
  /** Gzipped, in base64. */
  svg: string;
}

export interface RunData {
  name: string;
  document: string;
  assets: Record<string, string>;
  backend: "mujoco" | "gym";
  /** With what it was trained, as flags; none of it is played here. */
  disturbances: string;
  integrator: "gym" | "mujoco";
  own_timestep: boolean;
  parts: PartsData;
  task: TaskData;
  grid: GridData;
  table: string;
  episode: { states: string; ending: string; total: number };
  facts: [string, string][];
  config: [string, string][];
  versions: [string, string][];
  pictures: PictureData[];
  film: string | null;
}

export interface PageData {
  version: string;
  mujoco: string;
  runs: RunData[];
}

/** Return the bytes that base64 text stands for. */
export function bytesOf(base64: string): Uint8Array<ArrayBuffer> {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

/** Return what gzipped bytes, in base64, stand for. */
export async function unzipped(base64: string): Promise<ArrayBuffer> {
  const stream = new Blob([bytesOf(base64)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/** Return packed numbers: float64, little endian, gzipped, in base64. */
export async function numbersOf(packed: string): Promise<Float64Array> {
  const view = new DataView(await unzipped(packed));
  return Float64Array.from({ length: view.byteLength / 8 }, (_, i) => view.getFloat64(8 * i, true));
}

/** Return the content of one of the page's blocks of data. */
export function blockOf(id: string): string {
  return document.getElementById(id)?.textContent ?? "";
}
