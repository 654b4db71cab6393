/** A compiled cart-pole and where its parts are: see physics/structure.py and physics/bodies.py. */
import type { PartsData } from "./data";
import { JOINT, type MjData, type MjModel, type MjVFS, type Mujoco } from "./engine";
import { add, cross, dot, norm, product, rotation, row, scaled, subtract, turned, type Vector } from "./vectors";

const CONTROL_STEP = 0.02;
const LARGEST_LEAN = (12 * 2 * Math.PI) / 360;
const SAME_FRAME_BODY = 1;
const TINY = 1e-15;

/** A model that is no cart-pole, or an edit that makes no sense; the reason is for people. */
export class Unfit extends Error {}

export interface CartPole extends PartsData {
  xml: string;
  model: MjModel;
}

export interface Loader {
  mujoco: Mujoco;
  files: MjVFS;
  ownTimestep: boolean;
}

/** Compile a document and find its parts; `known` is what Python found in the same one. */
export function loadCartPole(loader: Loader, xml: string, known?: PartsData): CartPole {
  const model = loader.mujoco.MjModel.from_xml_string(xml, loader.files);
  const [slider, hinges] = jointsOf(model);
  const parts = { xml, model, slider, hinges, controls: controlsOf(model, slider) };
  const found: CartPole = { ...parts, substeps: substepsOf(model, loader.ownTimestep), upright: [] };
  const upright = hinges.map((hinge, pole) => {
    const angle = known?.upright[pole] ?? uprightOf(loader.mujoco, found, pole);
    if (angle !== 0) countFrom(model, hinge, angle);
    return angle;
  });
  return { ...found, upright, ...(known ?? {}) };
}

/** Return the joints in the order of a state: the slider, then each hinge. */
export const jointsIn = (of: PartsData): number[] => [of.slider, ...of.hinges];

function jointsOf(model: MjModel): [number, number[]] {
  const kinds: number[] = Array.from(model.jnt_type);
  const all = (kind: number) => kinds.flatMap((found, joint) => (found === kind ? [joint] : []));
  const [sliders, hinges] = [all(JOINT.slide), all(JOINT.hinge)];
  if (sliders.length + hinges.length !== kinds.length || sliders.length !== 1 || hinges.length === 0)
    throw new Unfit("This is no cart-pole: it needs one slide joint and a hinge for each pole, and no other joints.");
  const inside = subtree(model, model.jnt_bodyid[sliders[0]]);
  if (!hinges.every((hinge) => inside.includes(model.jnt_bodyid[hinge])))
    throw new Unfit("This is no cart-pole: a hinge is not inside the cart's body.");
  return [sliders[0], hinges];
}

function controlsOf(model: MjModel, slider: number): [number, number] {
  if (model.nu !== 1 || model.na !== 0 || model.actuator_trnid[0] !== slider)
    throw new Unfit("This is no cart-pole: it needs one motor, on the slide joint.");
  let [low, high] = [-1, 1];
  if (model.actuator_ctrllimited[0]) [low, high] = row(model.actuator_ctrlrange, 0, 2);
  const [left, right] = [pushOf(model, slider, low), pushOf(model, slider, high)];
  if (left === right) throw new Unfit("This is no cart-pole: the motor pushes alike whatever the control.");
  return left < right ? [low, high] : [high, low];
}

/** Return the force along the slider by a control, N, after the limits that clip it. */
export function pushOf(model: MjModel, slider: number, control: number): number {
  let force = model.actuator_gainprm[0] * control;
  if (model.actuator_biastype[0] !== 0) force += model.actuator_biasprm[0];
  if (model.actuator_forcelimited[0]) force = clip(force, row(model.actuator_forcerange, 0, 2));
  force *= model.actuator_gear[0];
  if (model.jnt_actfrclimited[slider]) force = clip(force, row(model.jnt_actfrcrange, slider, 2));
  return force;
}

const clip = (value: number, [low, high]: number[]): number => Math.min(Math.max(value, low), high);

function substepsOf(model: MjModel, ownTimestep: boolean): number {
  const timestep = model.opt.timestep;
  const substeps = ownTimestep ? 1 : Math.round(CONTROL_STEP / timestep);
  const fits = ownTimestep || Math.abs(substeps * timestep - CONTROL_STEP) <= 1e-12;
  if (!fits || substeps < 1 || substeps > 1000)
    throw new Unfit(`A timestep of ${timestep} s does not divide the control step of ${CONTROL_STEP} s.`);
  return substeps;
}

/** Return where all bodies are when all coordinates are 0. */
export function dataAtZero(mujoco: Mujoco, model: MjModel): MjData {
  const data = new mujoco.MjData(model);
  data.qpos.fill(0);
  mujoco.mj_kinematics(model, data);
  return data;
}

/** Return the angle at which a pole's centre of mass stands above the hinge; 0 where it already does. */
function uprightOf(mujoco: Mujoco, of: CartPole, pole: number): number {
  const { model } = of;
  const hinge = of.hinges[pole];
  const data = dataAtZero(mujoco, model);
  const axis = row(data.xaxis, hinge);
  let arm = subtract(centreOf(model, data, poleBodies(of, pole)), row(data.xanchor, hinge));
  arm = subtract(arm, scaled(axis, dot(arm, axis)));
  const up = upOf(Array.from(model.opt.gravity));
  data.delete();
  if (norm(arm) < 1e-6) return 0;
  const angle = Math.atan2(dot(axis, cross(arm, up)), dot(arm, up));
  if (Math.abs(angle) <= LARGEST_LEAN) return 0;
  if (!model.jnt_limited[hinge]) return angle;
  const [low, high] = row(model.jnt_range, hinge, 2);
  const turns = [angle, angle + 2 * Math.PI, angle - 2 * Math.PI];
  return turns.find((each) => low <= each && each <= high) ?? angle;
}

function centreOf(model: MjModel, data: MjData, bodies: number[]): Vector {
  const mass = massOf(model, bodies);
  const weighted = bodies.map((body) => scaled(row(data.xipos, body), model.body_mass[body] / mass));
  return weighted.reduce((sum, each) => add(sum, each), [0, 0, 0]);
}

export function upOf(gravity: Vector): Vector {
  const pulls = gravity.map(Math.abs);
  const most = Math.max(...pulls);
  const axis = pulls[2] >= most ? 2 : pulls.indexOf(most);
  return [0, 1, 2].map((i) => (i !== axis ? 0 : gravity[axis] <= 0 ? 1 : -1));
}

function countFrom(model: MjModel, hinge: number, upright: number): void {
  model.qpos0[hinge] -= upright;
  model.qpos_spring[hinge] -= upright;
  model.jnt_range[2 * hinge] -= upright;
  model.jnt_range[2 * hinge + 1] -= upright;
}

/** Return a body and all below it. */
export function subtree(model: MjModel, root: number): number[] {
  const inside = [root];
  for (let body = root + 1; body < model.nbody; body++)
    if (inside.includes(model.body_parentid[body])) inside.push(body);
  return inside;
}

/** Return every body that slides and does not turn. */
export function cartBodies(of: PartsData & { model: MjModel }): number[] {
  const under = (joint: number) => subtree(of.model, of.model.jnt_bodyid[joint]);
  const turning = new Set(of.hinges.flatMap(under));
  return under(of.slider).filter((body) => !turning.has(body));
}

/** Return all bodies that turn on a pole's hinge, without those of a pole that stands on it. */
export function poleBodies(of: PartsData & { model: MjModel }, pole: number): number[] {
  const { model, hinges } = of;
  const whole = subtree(model, model.jnt_bodyid[hinges[pole]]);
  const above = hinges.filter((other) => other > hinges[pole] && whole.includes(model.jnt_bodyid[other]));
  const upper = new Set(above.flatMap((other) => subtree(model, model.jnt_bodyid[other])));
  return whole.filter((body) => !upper.has(body));
}

export function massOf(model: MjModel, bodies: number[]): number {
  return bodies.reduce((sum, body) => sum + model.body_mass[body], 0);
}

/** Return a pole's mass, and its centre of mass from the hinge in the frame of the hinge's body. */
export function poleOf(of: CartPole, pole: number): { mass: number; com: Vector } {
  const { model } = of;
  const hinge = of.hinges[pole];
  const bodies = poleBodies(of, pole);
  const frames = new Map<number, [Vector, Vector]>([[bodies[0], [[0, 0, 0], rotation([1, 0, 0, 0])]]]);
  const places = bodies.map((body, i) => {
    if (i > 0) frames.set(body, frameOf(model, body, frames));
    const [position, turn] = frames.get(body) as [Vector, Vector];
    const inPlace = model.body_sameframe[body] === SAME_FRAME_BODY;
    return inPlace ? position : add(position, turned(turn, row(model.body_ipos, body)));
  });
  const mass = massOf(model, bodies);
  const com = bodies.reduce(
    (sum, body, i) => add(sum, subtract(places[i], places[0]), model.body_mass[body] / Math.max(mass, TINY)),
    places[0],
  );
  return { mass, com: subtract(com, row(model.jnt_pos, hinge)) };
}

function frameOf(model: MjModel, body: number, frames: Map<number, [Vector, Vector]>): [Vector, Vector] {
  const [position, turn] = frames.get(model.body_parentid[body]) as [Vector, Vector];
  return [
    add(position, turned(turn, row(model.body_pos, body))),
    product(turn, rotation(row(model.body_quat, body, 4))),
  ];
}
