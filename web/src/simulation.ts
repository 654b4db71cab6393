/** State in, control in, state out: see physics/simulation.py, whose bits these are. */
import { type CartPole, jointsIn } from "./cartpole";
import type { TaskData } from "./data";
import { DISABLE, type MjData, type MjModel, type Mujoco } from "./engine";

export type Integrator = "gym" | "mujoco";

const EULER = 0;
const LARGEST_SANE = 1e10;

/** Return a copy of a model as it is stepped. */
function steppingModel(mujoco: Mujoco, model: MjModel, integrator: Integrator): MjModel {
  const stepped = new mujoco.MjModel(model);
  let flags = DISABLE.autoreset;
  if (nothingCanTouch(model)) flags |= DISABLE.contact | (nothingElseConstrains(model) ? DISABLE.constraint : 0);
  if (integrator === "gym") {
    stepped.opt.integrator = EULER;
    flags |= DISABLE.eulerdamp;
  }
  stepped.opt.disableflags |= flags;
  return stepped;
}

function nothingCanTouch(model: MjModel): boolean {
  const [types, others]: number[][] = [Array.from(model.geom_contype), Array.from(model.geom_conaffinity)];
  return !(types.some((a) => others.some((b) => (a & b) !== 0)) || model.npair || model.nflex);
}

function nothingElseConstrains(model: MjModel): boolean {
  const all = [model.jnt_limited, model.dof_frictionloss, model.tendon_limited, model.tendon_frictionloss];
  return !(model.neq || all.some((values) => Array.from(values as ArrayLike<number>).some((value) => value !== 0)));
}

/** One cart-pole in motion. */
export class Simulation {
  readonly model: MjModel;
  readonly data: MjData;
  /** Seconds of one control step. */
  readonly controlStep: number;
  private readonly joints: number[];
  private readonly timestep: number;
  private readonly explicit: boolean;

  constructor(
    private readonly mujoco: Mujoco,
    readonly cartpole: CartPole,
    readonly integrator: Integrator,
  ) {
    this.model = steppingModel(mujoco, cartpole.model, integrator);
    this.data = new mujoco.MjData(this.model);
    this.joints = jointsIn(cartpole);
    this.timestep = this.model.opt.timestep;
    this.controlStep = this.timestep * cartpole.substeps;
    this.explicit = integrator === "gym";
  }

  get state(): number[] {
    const { qpos, qvel } = this.data;
    return this.joints.flatMap((joint) => [qpos[joint], qvel[joint]]);
  }

  /** Put the cart-pole into a state; nothing of its past remains. */
  set state(values: ArrayLike<number>) {
    this.mujoco.mj_resetData(this.model, this.data);
    const { qpos, qvel } = this.data;
    this.joints.forEach((joint, i) => {
      qpos[joint] = values[2 * i];
      qvel[joint] = values[2 * i + 1];
    });
  }

  /** Advance one control step; `push` may set forces before each physics step. */
  step(control: number, push?: () => void): void {
    this.data.ctrl[0] = control;
    for (let i = 0; i < this.cartpole.substeps; i++) {
      push?.();
      if (this.explicit) this.explicitStep();
      else this.mujoco.mj_step(this.model, this.data);
    }
  }

  /** Explicit Euler: positions move by the old velocities. */
  private explicitStep(): void {
    const { qpos, qvel } = this.data;
    const next = this.joints.map((joint) => qpos[joint] + this.timestep * qvel[joint]);
    this.mujoco.mj_step(this.model, this.data);
    const { qpos: after } = this.data;
    this.joints.forEach((joint, i) => { after[joint] = next[i]; });
  }

  delete(): void {
    this.data.delete();
    this.model.delete();
  }
}

/** Return whether a simulation has gone beyond all numbers. */
export const hasDiverged = (state: number[]): boolean => !state.every((value) => Math.abs(value) < LARGEST_SANE);

/** Return by which rule an episode has ended; null while it goes on. */
export function endingOf(task: TaskData, state: number[]): "cart" | "pole" | null {
  const lean = Math.max(...state.filter((_, i) => i >= 2 && i % 2 === 0).map(Math.abs));
  if (lean > (task.theta_limit ?? Infinity)) return "pole";
  return Math.abs(state[0]) > (task.x_limit ?? Infinity) ? "cart" : null;
}

/** Return a state to start from, with a uniform draw in each value. */
export function drawnStart({ start, start_low: low, start_high: high }: TaskData): number[] {
  return start.map((value) => value + low + (high - low) * Math.random());
}
