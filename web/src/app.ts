/** The page: a run at a time, on the stage, with its table, its model and what it came to. */
import { type CartPole, loadCartPole, type Loader } from "./cartpole";
import { bytesOf, numbersOf, type PageData, type RunData } from "./data";
import { choice, make } from "./dom";
import type { Mujoco } from "./engine";
import { ModelPanel } from "./model_panel";
import { type Parity, parityText, replay } from "./parity";
import { Play } from "./play";
import { Policy } from "./policy";
import { creditsOf, resultsOf, runsTable } from "./results";
import { Simulation } from "./simulation";
import { Stage } from "./stage";
import { TablePanel } from "./table_panel";

declare global {
  interface Window {
    /** What tests, and the curious, read the page by. */
    mjcartpole?: App;
  }
}

const OTHER = "another pole than the one that was recorded: parity does not apply";
const HERE = "MuJoCo itself moves it, here in your browser: drag it, push it, change it, or balance it yourself.";
const GYM = `It was trained on gymnasium's own CartPole-v1, and is played here on the reference model under explicit Euler: the same motion but for rounding. ${HERE}`;

/** Return what is said of disturbances, which the page leaves out. */
const trainedWith = ({ disturbances }: RunData): string =>
  disturbances ? `It was trained with ${disturbances}, and is played here without, but for the delay and the noise that you choose. ` : "";

export class App {
  readonly element: HTMLElement;
  readonly stage: Stage | null = null;
  run!: RunData;
  policy!: Policy;
  parity: Parity | null = null;
  model: ModelPanel | null = null;
  isReady = false;
  private readonly badge = make("p", { class: "parity", role: "status" });
  private readonly top = make("div", { class: "top" });
  private readonly below = make("div", { class: "below" });
  private readonly lead = make("p", { class: "lead" });
  private readonly switches: HTMLSelectElement | null;

  constructor(
    readonly data: PageData,
    readonly mujoco: Mujoco | null,
    trouble: string,
  ) {
    const runs = data.runs.map((run, i): [string, string] => [String(i), run.name]);
    const name = runs.length > 1 ? choice("Run", runs, (value) => void this.show(Number(value))) : make("p", {}, data.runs[0].name);
    this.switches = name.querySelector("select");
    this.element = make("main", {}, make("header", {}, make("h1", {}, "mjcartpole"), name, this.badge), this.lead);
    if (trouble) this.element.append(make("p", { class: "alert", role: "alert" }, trouble));
    if (mujoco && !trouble) {
      this.stage = new Stage(mujoco);
      this.top.append(this.stage.element);
    }
    this.element.append(this.top, this.below);
    if (runs.length > 1) this.element.append(runsTable(data, (index) => void this.show(index)));
    this.element.append(creditsOf(data));
    window.mjcartpole = this;
  }

  /** Show a run. */
  async show(index: number): Promise<void> {
    this.isReady = false;
    this.run = this.data.runs[index];
    if (this.switches) this.switches.value = String(index);
    const table = await numbersOf(this.run.table);
    this.policy = new Policy(this.run.grid, table);
    this.lead.textContent = `A table of ${table.length.toLocaleString("en")} numbers keeps this pole up. ${trainedWith(this.run)}${this.run.backend === "gym" ? GYM : HERE}`;
    const panel = new TablePanel(this.policy, this.run.parts.hinges.length);
    this.top.querySelector(".table")?.remove();
    this.top.append(panel.element);
    this.below.replaceChildren(...resultsOf(this.run));
    if (this.mujoco) await this.begin(this.mujoco, panel);
    if (!this.stage) panel.showAlone(this.run.parts.hinges.length);
    this.isReady = true;
  }

  private async begin(mujoco: Mujoco, panel: TablePanel): Promise<void> {
    const loader: Loader = { mujoco, files: filesOf(mujoco, this.run), ownTimestep: this.run.own_timestep };
    const own = loadCartPole(loader, this.run.document, this.run.parts);
    await this.check(mujoco, own);
    const { stage } = this;
    if (!stage) return;
    this.model = new ModelPanel(loader, own);
    this.model.onModel = (cartpole) => this.change(mujoco, stage, cartpole, own);
    this.below.prepend(this.model.element);
    panel.onStart = (state) => stage.restart(state);
    stage.onFrame = (play, now) => panel.show(play, now);
    stage.show(new Play(mujoco, own, this.run.integrator, this.run.task, this.policy));
  }

  /** Play on with another model, from the state that there is. */
  private change(mujoco: Mujoco, stage: Stage, cartpole: CartPole, own: CartPole): void {
    const { state, player, timed, cartpole: before } = stage.play;
    const play = new Play(mujoco, cartpole, this.run.integrator, this.run.task, this.policy);
    Object.assign(play, { player, timed });
    play.restart(state);
    stage.show(play);
    if (before !== own && before !== cartpole) before.model.delete();
    this.tell(cartpole === own);
  }

  /** Replay the recorded episode, and say what came of it. */
  private async check(mujoco: Mujoco, own: CartPole): Promise<void> {
    const simulation = new Simulation(mujoco, own, this.run.integrator);
    this.parity = replay(simulation, this.policy, await numbersOf(this.run.episode.states));
    simulation.delete();
    this.tell(true);
  }

  private tell(isOwn: boolean): void {
    if (!this.parity || !this.mujoco) return;
    const text = parityText(this.parity, this.data.mujoco, this.mujoco.mj_versionString());
    this.badge.textContent = isOwn ? text : OTHER;
    this.badge.classList.toggle("equal", isOwn && this.parity.firstApart === null);
    this.badge.classList.toggle("other", !isOwn);
  }
}

function filesOf(mujoco: Mujoco, run: RunData) {
  const files = new mujoco.MjVFS();
  for (const [name, content] of Object.entries(run.assets)) files.addBuffer(name, bytesOf(content));
  return files;
}
