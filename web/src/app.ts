/** The page: a run at a time, on the stage, with its table and what it came to. */
import { type CartPole, loadCartPole, type Loader } from "./cartpole";
import { bytesOf, numbersOf, type PageData, type RunData } from "./data";
import { choice, make } from "./dom";
import type { Mujoco } from "./engine";
import { parityText, replay, type Parity } from "./parity";
import { Play } from "./play";
import { Policy } from "./policy";
import { Simulation } from "./simulation";
import { Stage } from "./stage";

declare global {
  interface Window {
    /** What tests, and the curious, read the page by. */
    mjcartpole?: App;
  }
}

export class App {
  readonly element: HTMLElement;
  readonly stage: Stage | null = null;
  readonly mujoco: Mujoco | null = null;
  run!: RunData;
  policy!: Policy;
  cartpole!: CartPole;
  parity: Parity | null = null;
  isReady = false;
  private loader!: Loader;
  private readonly badge = make("p", { class: "parity", role: "status" });

  constructor(
    readonly data: PageData,
    engine: Mujoco | string,
  ) {
    const runs = data.runs.map((run, i): [string, string] => [String(i), run.name]);
    const head = make("header", {}, make("h1", {}, "mjcartpole"),
      runs.length > 1 ? choice("Run", runs, (value) => void this.show(Number(value))) : make("p", {}, data.runs[0].name), this.badge);
    this.element = make("main", {}, head);
    if (typeof engine === "string") this.element.append(make("p", { class: "alert", role: "alert" }, engine));
    else {
      this.mujoco = engine;
      this.stage = new Stage(engine);
      this.element.append(this.stage.element);
    }
    window.mjcartpole = this;
  }

  /** Show a run. */
  async show(index: number): Promise<void> {
    this.isReady = false;
    this.run = this.data.runs[index];
    this.policy = new Policy(this.run.grid, await numbersOf(this.run.table));
    if (this.mujoco && this.stage) {
      this.loader = { mujoco: this.mujoco, files: filesOf(this.mujoco, this.run), ownTimestep: this.run.own_timestep };
      this.cartpole = loadCartPole(this.loader, this.run.document, this.run.parts);
      await this.check(this.mujoco);
      this.stage.show(new Play(this.mujoco, this.cartpole, this.run.integrator, this.run.task, this.policy));
    }
    this.isReady = true;
  }

  private async check(mujoco: Mujoco): Promise<void> {
    const simulation = new Simulation(mujoco, this.cartpole, this.run.integrator);
    this.parity = replay(simulation, this.policy, await numbersOf(this.run.episode.states));
    simulation.delete();
    this.badge.textContent = parityText(this.parity, this.data.mujoco, mujoco.mj_versionString());
  }
}

function filesOf(mujoco: Mujoco, run: RunData) {
  const files = new mujoco.MjVFS();
  for (const [name, content] of Object.entries(run.assets)) files.addBuffer(name, bytesOf(content));
  return files;
}
