/** Edits by meaning: pole.length, pole.mass, gravity and others. See physics/edit/semantic_edits.py. */
import { type CartPole, cartBodies, loadCartPole, type Loader, massOf, poleOf, pushOf, Unfit } from "../cartpole";
import { add, norm, scaled, type Vector } from "../vectors";
import { Document, type Element, numberText } from "./document";
import { Parts } from "./parts";
import { lengthOf, setLength, setMass, setPoleMass } from "./rescale";

export type Edits = Record<string, number>;

const JOINT_ATTRIBUTES: Record<string, string> = { damping: "damping", friction: "frictionloss", armature: "armature" };

/** Return a document with some numbers changed by their meaning, and all else as it was written. */
export function edited(loader: Loader, xml: string, edits: Edits): string {
  if (Object.keys(edits).length === 0) return xml;
  const document = new Document(xml);
  const before = loadCartPole(loader, xml);
  const [whole, byPole] = sortedByPole(edits, before.hinges.length);
  editOptions(document, before, whole);
  const parts = new Parts(loader.mujoco, document, before);
  editJoint(parts, before.slider, "rail", whole);
  if (whole.force !== undefined) editForce(parts, whole.force);
  if (whole["cart.mass"] !== undefined) setMass(parts, cartBodies(before), "cart", whole["cart.mass"]);
  const centres = byPole.map((wanted, pole) => editPole(loader, document, before, pole, wanted));
  const after = loadCartPole(loader, document.text);
  centres.forEach((centre, pole) => { checkCentre(after, pole, centre); });
  checkOutcome(loader, after, edits);
  for (const each of [before, after]) each.model.delete();
  return document.text;
}

/** Return what edits a model takes, and what it has of each; an edit that it does not take is left out. */
export function meaningsOf(loader: Loader, cartpole: CartPole): Edits {
  const poles = cartpole.hinges.length;
  const names = ["length", "mass"].flatMap((word) => cartpole.hinges.map((_, pole) => keyOf("pole", word, pole, poles)));
  const others = ["cart.mass", "gravity", "force"];
  const brakes = cartpole.hinges.map((_, pole) => keyOf("hinge", "damping", pole, poles));
  const found: Edits = {};
  for (const key of [...names, ...others, ...brakes, "rail.damping"]) {
    const value = valueOf(loader, cartpole, key);
    if (value !== null) found[key] = value;
  }
  return found;
}

const keyOf = (part: string, word: string, pole: number, poles: number): string =>
  `${part}${poles > 1 ? pole + 1 : ""}.${word}`;

/** Return what a model has of an edit's meaning; null where the edit makes no sense. */
export function valueOf(loader: Loader, cartpole: CartPole, key: string): number | null {
  const { model, slider, hinges, controls } = cartpole;
  const [, part, number, word] = /^([a-z]+)(\d*)(?:\.(\w+))?$/.exec(key) ?? [];
  const pole = number ? Number(number) - 1 : 0;
  try {
    if (key === "gravity") return -model.opt.gravity[2] > 0 ? -model.opt.gravity[2] : null;
    if (key === "force") return isPlainMotor(cartpole) ? Math.abs(pushOf(model, slider, controls[1])) : null;
    if (key === "cart.mass") return massOf(model, cartBodies(cartpole)) || null;
    if (part === "pole" && word === "mass") return poleOf(cartpole, pole).mass || null;
    if (part === "pole") return lengthOf(new Parts(loader.mujoco, new Document(cartpole.xml), cartpole), pole);
    const joint = part === "rail" ? slider : hinges[pole];
    new Parts(loader.mujoco, new Document(cartpole.xml), cartpole).joint(joint);
    return dofValue(cartpole, joint, JOINT_ATTRIBUTES[word]);
  } catch (error) {
    if (error instanceof Unfit) return null;
    throw error;
  }
}

function sortedByPole(edits: Edits, poles: number): [Edits, Edits[]] {
  const whole: Edits = {};
  const byPole: Edits[] = Array.from({ length: poles }, () => ({}));
  for (const [key, value] of Object.entries(edits)) {
    const numbered = /^(pole|hinge)(\d*)\.(\w+)$/.exec(key);
    if (!numbered) whole[key] = value;
    else byPole[numbered[2] ? Number(numbered[2]) - 1 : 0][`${numbered[1]}.${numbered[3]}`] = value;
  }
  return [whole, byPole];
}

/** Make the edits of one pole; return where its centre of mass must then be, from the hinge. */
function editPole(loader: Loader, document: Document, before: CartPole, pole: number, edits: Edits): Vector {
  const was = poleOf(before, pole);
  if (Object.keys(edits).length > 0) editJoint(new Parts(loader.mujoco, document, before), before.hinges[pole], "hinge", edits);
  const { "pole.length": length, "pole.mass": mass } = edits;
  let longer = 1;
  if (length !== undefined) longer = setLength(new Parts(loader.mujoco, document, before), length, pole);
  if (length !== undefined || mass !== undefined) {
    const stretched = loadCartPole(loader, document.text);
    setPoleMass(new Parts(loader.mujoco, document, stretched), mass ?? was.mass, pole);
    stretched.model.delete();
  }
  return scaled(was.com, longer);
}

function editOptions(document: Document, { model }: CartPole, edits: Edits): void {
  if (edits.gravity === undefined) return;
  const option = document.section("option");
  let tokens = (option.attributes.get("gravity") ?? "").trim().split(/\s+/);
  if (tokens.length !== 3) tokens = [...(model.opt.gravity as Float64Array)].map((value) => numberText(value));
  tokens[2] = numberText(0 - edits.gravity, tokens[2]);
  document.set(option, "gravity", tokens.join(" "));
}

/** Write the first number of an attribute; what else it has stays. */
function setFirst(document: Document, element: Element, name: string, value: number): void {
  const tokens = (element.attributes.get(name) ?? "").trim().split(/\s+/);
  tokens[0] = numberText(value, tokens[0]);
  document.set(element, name, tokens.join(" "));
}

function editJoint(parts: Parts, joint: number, part: string, edits: Edits): void {
  for (const [word, name] of Object.entries(JOINT_ATTRIBUTES)) {
    const value = edits[`${part}.${word}`];
    if (value === undefined) continue;
    const element = parts.joint(joint);
    if (element.attributes.has(name) || value !== dofValue(parts.cartpole, joint, name)) setFirst(parts.document, element, name, value);
  }
}

function dofValue({ model }: CartPole, joint: number, name: string): number {
  const values = { damping: model.dof_damping, frictionloss: model.dof_frictionloss, armature: model.dof_armature };
  return values[name as keyof typeof values][joint];
}

function forcesOf({ model, controls }: CartPole): [number, number] {
  const [gear, gain] = [model.actuator_gear[0], model.actuator_gainprm[0]];
  return [gear * (gain * controls[0]), gear * (gain * controls[1])];
}

function isPlainMotor(cartpole: CartPole): boolean {
  const { model } = cartpole;
  const [left, right] = forcesOf(cartpole);
  return model.actuator_gaintype[0] === 0 && model.actuator_biastype[0] === 0 && left === -right && right !== 0;
}

/** Set the force through the gear, which is what force there is per unit of control. */
function editForce(parts: Parts, force: number): void {
  const { cartpole } = parts;
  if (!isPlainMotor(cartpole)) throw new Unfit("The force cannot be set: the motor does not push equally to both sides.");
  const before: number = cartpole.model.actuator_gear[0];
  const gear = Math.sign(before) * (force / Math.abs(forcesOf(cartpole)[1] / before));
  const element = parts.motor();
  if (element.attributes.has("gear") || gear !== before) setFirst(parts.document, element, "gear", gear);
}

/** Refuse a pole of which not all has become longer in the same proportion. */
function checkCentre(cartpole: CartPole, pole: number, wanted: Vector): void {
  const apart = norm(add(poleOf(cartpole, pole).com, wanted, -1));
  if (apart > 1e-9 * norm(wanted)) throw new Unfit("The length cannot be set: not all of the pole's mass lies along it.");
}

/** Refuse a model that has not what was asked, whatever else the document says. */
function checkOutcome(loader: Loader, after: CartPole, edits: Edits): void {
  for (const [key, wanted] of Object.entries(edits)) {
    const found = valueOf(loader, after, key) ?? 0;
    if (Math.abs(found - wanted) > 1e-9 * Math.max(Math.abs(found), Math.abs(wanted)))
      throw new Unfit(`${key} cannot be ${wanted}: something else in the document decides it.`);
  }
}
