/** The game: who pushes, when a step is due, what an episode came to. Nothing of how it looks. */
import { type CartPole, cartBodies, dataAtZero, pushOf } from "./cartpole";
import type { TaskData } from "./data";
import type { Mujoco } from "./engine";
import { Gap } from "./gap";
import type { Look, Policy } from "./policy";
import type { Pull } from "./pull";
import { drawnStart, endingOf, hasDiverged, type Integrator, Simulation } from "./simulation";
import { row, type Vector } from "./vectors";

export type Player = "table" | "you";
export type Ending = "cart" | "pole" | "time" | "diverged";

/** One cart-pole in play, and in a contest the table's own beside it. */
export class Play {
  simulation: Simulation;
  /** The table's, in a contest. */
  rival: Simulation | null = null;
  rivalSteps = 0;
  rivalEnding: Ending | null = null;
  steps = 0;
  ending: Ending | null = null;
  /** What the keys hold: -1, 0 or 1. */
  keys = 0;
  pull: Pull | null = null;
  player: Player = "table";
  /** Whether the time limit ends an episode of the table. */
  timed = false;
  best = 0;
  /** What lies between the table and the model. */
  gap = new Gap();
  /** What the table sees of the state. */
  private seen: number[] = [];
  private due = 0;
  private readonly rail: Vector;

  constructor(
    private readonly mujoco: Mujoco,
    readonly cartpole: CartPole,
    readonly integrator: Integrator,
    readonly task: TaskData,
    readonly policy: Policy,
  ) {
    this.simulation = new Simulation(mujoco, cartpole, integrator);
    const zero = dataAtZero(mujoco, cartpole.model);
    this.rail = row(zero.xaxis, cartpole.slider);
    zero.delete();
    this.restart();
  }

  get state(): number[] {
    return this.simulation.state;
  }

  get look(): Look {
    return this.policy.look(this.seen);
  }

  /** Start again, from a state or from a drawn one. */
  restart(state: number[] = drawnStart(this.task)): void {
    this.simulation.state = state;
    this.gap.forget();
    this.seen = this.gap.seen(state);
    this.steps = this.due = this.rivalSteps = 0;
    this.ending = this.rivalEnding = null;
    this.rival?.delete();
    this.rival = this.player === "you" ? new Simulation(this.mujoco, this.cartpole, this.integrator) : null;
    if (this.rival) this.rival.state = state;
  }

  /** Whether a contest waits for the visitor's first push. */
  get isWaiting(): boolean {
    return this.player === "you" && this.steps === 0 && this.keys === 0 && this.pull === null;
  }

  /** Take as many steps as are due after so many seconds. */
  advance(seconds: number): void {
    if (this.isWaiting) return;
    this.due = Math.min(this.due + seconds, 0.25);
    while (this.due >= this.simulation.controlStep && !this.isOver) {
      this.due -= this.simulation.controlStep;
      this.step();
    }
  }

  /** Whether nothing moves any more. */
  get isOver(): boolean {
    return this.ending !== null && (this.rival === null || this.rivalEnding !== null);
  }

  /** Take one control step. */
  step(): void {
    if (this.ending === null) {
      this.stepWith(this.simulation, this.arriving(), true);
      this.seen = this.gap.seen(this.state);
      this.steps += 1;
      this.ending = this.endingAfter(this.simulation, this.steps);
      if (this.player === "you") this.best = Math.max(this.best, this.steps);
    }
    if (this.rival && this.rivalEnding === null) {
      this.stepWith(this.rival, this.cartpole.controls[this.policy.look(this.rival.state).action], false);
      this.rivalSteps += 1;
      this.rivalEnding = this.endingAfter(this.rival, this.rivalSteps);
    }
  }

  /** Return the control: the table's, or that of the keys, none where none is held. */
  private control(): number {
    const { controls } = this.cartpole;
    if (this.player === "table") return controls[this.look.action];
    return this.keys === 0 ? 0 : controls[this.keys > 0 ? 1 : 0];
  }

  /** Return the control that the motor gets in this step: the table's may be late. */
  private arriving(): number {
    const [left, right] = this.cartpole.controls;
    return this.player === "you" ? this.control() : this.gap.arriving(this.control(), (left + right) / 2);
  }

  private stepWith(simulation: Simulation, control: number, isMine: boolean): void {
    simulation.step(control, isMine && this.isDisturbed ? () => this.disturb() : undefined);
  }

  /** The push along the rail that comes next, N. */
  get nextPush(): number {
    return pushOf(this.cartpole.model, this.cartpole.slider, this.control());
  }

  private get isDisturbed(): boolean {
    return this.pull !== null || (this.player === "table" && this.keys !== 0) || this.hasForces;
  }

  private hasForces = false;

  /** Apply the forces of the pointer and of the keys, instead of those before. */
  private disturb(): void {
    const { data } = this.simulation;
    data.xfrc_applied.fill(0);
    const pulled = this.pull?.force();
    if (this.pull && pulled) data.xfrc_applied.set(pulled, 6 * this.pull.grip.body);
    if (this.player === "table" && this.keys !== 0) this.pushCart(data.xfrc_applied);
    this.hasForces = this.pull !== null || this.keys !== 0;
  }

  private pushCart(forces: Float64Array): void {
    const { model, slider, controls } = this.cartpole;
    const [cart] = cartBodies(this.cartpole);
    const strength = Math.abs(pushOf(model, slider, controls[1])) * this.keys;
    this.rail.forEach((share, i) => { forces[6 * cart + i] += strength * share; });
  }

  private endingAfter(simulation: Simulation, steps: number): Ending | null {
    if (hasDiverged(simulation.state)) return "diverged";
    const limited = this.timed || this.player === "you";
    return endingOf(this.task, simulation.state) ?? (limited && steps >= this.task.time_limit ? "time" : null);
  }

  delete(): void {
    this.pull?.delete();
    this.rival?.delete();
    this.simulation.delete();
  }
}
