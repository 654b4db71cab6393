/** Pulling and pushing: forces by MuJoCo's own perturbation, a spring from a point to the pointer. */
import type { MjData, Mujoco } from "./engine";
import type { Grip } from "./scene";
import type { Simulation } from "./simulation";
import { add, row, subtract, transposed, turned, type Vector } from "./vectors";

const TRANSLATE = 1;
const ALL = 7;

/** Holds a point of a body, and draws it towards another point. */
export class Pull {
  private readonly perturb;
  private readonly data: MjData;

  constructor(
    private readonly mujoco: Mujoco,
    private readonly simulation: Simulation,
    readonly grip: Grip,
  ) {
    this.perturb = new mujoco.MjvPerturb();
    this.data = new mujoco.MjData(simulation.model);
    this.follow();
    const place = row(this.data.xpos, grip.body);
    const local = turned(transposed(row(this.data.xmat, grip.body, 9)), subtract(grip.point, place));
    this.perturb.select = grip.body;
    this.perturb.localpos.set(local);
    this.init();
    this.perturb.active = TRANSLATE;
    this.towards = grip.point;
  }

  /** Where it is drawn to. */
  set towards(point: Vector) {
    this.perturb.refselpos.set(point);
  }

  /** The held point, and where it is drawn to. */
  get ends(): [Vector, Vector] {
    const { body } = this.grip;
    const held = turned(row(this.data.xmat, body, 9), row(this.perturb.localpos, 0));
    return [add(row(this.data.xpos, body), held), row(this.perturb.refselpos, 0)];
  }

  /** Return the force and torque on the body, as the simulation is now. */
  force(): Vector {
    this.follow();
    this.mujoco.mjv_applyPerturbForce(this.simulation.model, this.data, this.perturb);
    return row(this.data.xfrc_applied, this.grip.body, 6);
  }

  private follow(): void {
    const { data, simulation, mujoco } = this;
    data.qpos.set(simulation.data.qpos);
    data.qvel.set(simulation.data.qvel);
    mujoco.mj_fwdPosition(simulation.model, data);
    mujoco.mj_fwdVelocity(simulation.model, data);
  }

  /** MuJoCo weighs what hangs on the point; it asks for a scene that a camera has seen. */
  private init(): void {
    const { mujoco, simulation, data } = this;
    const [option, camera] = [new mujoco.MjvOption(), new mujoco.MjvCamera()];
    const scene = new mujoco.MjvScene(simulation.model, 1000);
    mujoco.mjv_updateScene(simulation.model, data, option, this.perturb, camera, ALL, scene);
    mujoco.mjv_initPerturb(simulation.model, data, scene, this.perturb);
    for (const each of [scene, camera, option]) each.delete();
  }

  delete(): void {
    this.perturb.delete();
    this.data.delete();
  }
}
