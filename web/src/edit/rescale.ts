/** Other masses and another length of the pole: see physics/edit/rescale.py. */
import { type CartPole, massOf, poleBodies, poleOf, Unfit } from "../cartpole";
import { GEOM } from "../engine";
import { add, cross, dot, norm, rotation, row, scaled, subtract, transposed, turned, type Vector } from "../vectors";
import type { Element } from "./document";
import type { Geom, Parts } from "./parts";

const AS_WRITTEN = 1e-5;
const TURNED = ["quat", "euler", "axisangle", "xyaxes", "zaxis", "fullinertia"];
const TINY = 1e-15;

const isClose = (a: number, b: number, tolerance: number): boolean =>
  Math.abs(a - b) <= tolerance * Math.max(Math.abs(a), Math.abs(b));
const ratioOf = (now: number, before: number): number => (isClose(now, before, 1e-14) ? 1 : now / Math.max(before, TINY));
const isTurned = (element: Element): boolean => TURNED.some((name) => element.attributes.has(name));

/** Give a pole another mass, with the inertia that follows. */
export function setPoleMass(parts: Parts, mass: number, pole: number): void {
  const { model } = parts.cartpole;
  const bodies = poleBodies(parts.cartpole, pole);
  const rod = Rod.of(parts, pole);
  const ratio = ratioOf(mass, massOf(model, bodies));
  const alone = bodies.filter((body) => model.body_mass[body] > 0).length === 1;
  for (const body of bodies) {
    const inertial = parts.inertial(body);
    if (!inertial || (rod && body === bodies[0])) continue;
    for (const name of ["diaginertia", "fullinertia"])
      if (inertial.attributes.has(name)) parts.put(inertial, name, inertial.numbers(name).map((value) => ratio * value));
  }
  rod?.write(alone ? mass : ratio * rod.mass, rod.length);
  setMass(parts, bodies, "pole", mass);
}

/** Scale the masses of bodies to a sum. */
export function setMass(parts: Parts, bodies: number[], what: string, mass: number): void {
  const { model } = parts.cartpole;
  const heavy = bodies.filter((body) => model.body_mass[body] > 0);
  if (heavy.length === 0) throw new Unfit(`No body of the ${what} has a mass to scale.`);
  const ratio = ratioOf(mass, massOf(model, heavy));
  for (const body of heavy) {
    const inertial = parts.inertial(body);
    if (inertial) parts.put(inertial, "mass", [heavy.length === 1 ? mass : ratio * model.body_mass[body]]);
    else scaleGeoms(parts, body, ratio);
  }
}

function scaleGeoms(parts: Parts, body: number, ratio: number): void {
  if (ratio === 1) return;
  for (const { element, mass, density } of parts.geoms(body)) {
    if (Number.isNaN(mass)) parts.put(element, "density", [ratio * density]);
    else if (mass > 0) parts.put(element, "mass", [ratio * mass]);
  }
}

/** An <inertial> that is a uniform thin rod from the hinge, along an axis of its body. */
class Rod {
  constructor(
    private readonly parts: Parts,
    private readonly element: Element,
    private readonly foot: Vector,
    private readonly com: Vector,
    readonly mass: number,
    private readonly axis: number,
  ) {}

  get length(): number {
    return 2 * Math.abs(this.com[this.axis]);
  }

  /** Return a pole's own; null if it has none, or is no such rod. */
  static of(parts: Parts, pole: number): Rod | null {
    const { model, hinges } = parts.cartpole;
    const root = model.jnt_bodyid[hinges[pole]];
    const element = parts.inertial(root);
    if (!element || isTurned(element)) return null;
    const foot = row(model.jnt_pos, hinges[pole]);
    const com = subtract(element.numbers("pos"), foot);
    const mass: number = model.body_mass[root];
    const sizes = com.map(Math.abs);
    const axis = sizes.indexOf(Math.max(...sizes));
    const across = [0, 1, 2].filter((i) => i !== axis);
    const inertia = element.numbers("diaginertia");
    const rod = (mass * com[axis] ** 2) / 3;
    const isStraight = across.every((i) => sizes[i] <= 1e-12 * sizes[axis]);
    const isUniform = rod > 0 && across.every((i) => Math.abs(inertia[i] - rod) < AS_WRITTEN * rod);
    return isStraight && isUniform ? new Rod(parts, element, foot, com, mass, axis) : null;
  }

  /** Give the rod another mass and length; its thickness stays. */
  write(mass: number, length: number): void {
    const [pos, before] = [this.element.numbers("pos"), this.element.numbers("diaginertia")];
    const across = uniformRodInertia(mass, length);
    let along = before[this.axis];
    if (mass !== this.mass) along = Number((along * (mass / this.mass)).toPrecision(12));
    pos[this.axis] = this.foot[this.axis] + (Math.sign(this.com[this.axis]) * length) / 2;
    this.parts.put(this.element, "pos", pos);
    this.parts.put(this.element, "mass", [mass]);
    this.parts.put(this.element, "diaginertia", [0, 1, 2].map((i) => (i === this.axis ? Math.min(along, across) : across)));
  }
}

/** Return M L^2 / 12 of the numbers as they are written, rounded once. */
export function uniformRodInertia(mass: number, length: number): number {
  const [m, l] = [decimal(mass), decimal(length)];
  const scaledUp = (m.digits * l.digits * l.digits * 10n ** 40n) / 12n;
  return Number(`${scaledUp}e${m.exponent + 2 * l.exponent - 40}`);
}

function decimal(value: number): { digits: bigint; exponent: number } {
  const [mantissa, exponent] = value.toExponential().split("e");
  const [whole, part = ""] = mantissa.split(".");
  return { digits: BigInt(whole + part), exponent: Number(exponent) - part.length };
}

/** Give a pole another length, hinge to tip; return how many times longer it is. */
export function setLength(parts: Parts, length: number, pole: number): number {
  const [rod, stretch] = measured(parts, pole);
  stretch.now = length;
  const inertial = parts.inertial(stretch.root);
  if (rod) rod.write(rod.mass, length);
  else if (inertial) stretch.inertial(inertial);
  stretch.geoms();
  for (const tag of ["site", "body", "camera", "light"])
    for (const element of parts.body(stretch.root).find(tag)) {
      if (element.parent?.tag === "frame") throw new Unfit("The pole has a <frame>, so its length cannot be set.");
      if (element.attributes.has("pos")) parts.put(element, "pos", stretch.point(element.numbers("pos")));
    }
  return stretch.now / stretch.before;
}

/** Return a pole's length, hinge to tip, m. */
export const lengthOf = (parts: Parts, pole: number): number => measured(parts, pole)[1].before;

function measured(parts: Parts, pole: number): [Rod | null, Stretch] {
  const [rod, stretch] = [Rod.of(parts, pole), new Stretch(parts, pole)];
  stretch.before = rod ? rod.length : stretch.reach();
  return [rod, stretch];
}

/** From one length to another, along the pole and from the hinge. */
class Stretch {
  readonly root: number;
  before = 1;
  now = 1;
  private readonly cartpole: CartPole;
  private readonly foot: Vector;
  private readonly axis: number | null;
  private readonly along: Vector;

  constructor(
    private readonly parts: Parts,
    pole: number,
  ) {
    this.cartpole = parts.cartpole;
    const { model, hinges } = this.cartpole;
    const { com } = poleOf(this.cartpole, pole);
    if (norm(com) < 1e-9) throw new Unfit("The pole's centre of mass is at the hinge, so it has no direction.");
    this.root = model.jnt_bodyid[hinges[pole]];
    this.foot = row(model.jnt_pos, hinges[pole]);
    const along = scaled(com, 1 / norm(com));
    const sizes = along.map(Math.abs);
    const axis = sizes.indexOf(Math.max(...sizes));
    this.axis = sizes[axis] > 1 - 1e-15 ? axis : null;
    this.along = this.axis === null ? along : along.map((value, i) => (i === axis ? Math.sign(value) : 0));
  }

  /** Return a distance along the pole; its tip and its middle come out without rounding. */
  private value(old: number): number {
    for (const share of [1, 0.5])
      if (isClose(Math.abs(old), share * this.before, 1e-12)) return Math.sign(old) * share * this.now;
    return old * ratioOf(this.now, this.before);
  }

  /** Return a point in the frame of the pole's body. */
  point(point: Vector): Vector {
    const arm = subtract(point, this.foot);
    const { axis } = this;
    if (axis !== null) return point.map((old, i) => (i === axis ? this.foot[axis] + this.value(arm[axis]) : old));
    if (norm(cross(arm, this.along)) <= 1e-12 * norm(arm)) return add(this.foot, arm.map((value) => this.value(value)));
    return add(point, this.along, (ratioOf(this.now, this.before) - 1) * dot(arm, this.along));
  }

  /** Return how far the pole reaches from the hinge: its geoms' axes, without round ends. */
  reach(): number {
    const ends = this.parts.geoms(this.root).flatMap((geom) => this.ends(geom));
    const reached = Math.max(0, ...ends.map((end) => dot(subtract(end, this.foot), this.along)));
    if (reached <= 0) throw new Unfit("No geom of the pole shows its length.");
    return reached;
  }

  /** Stretch any mass distribution along the pole: inertia goes with the length squared. */
  inertial(element: Element): void {
    if (this.axis === null || isTurned(element)) throw new Unfit("The pole's <inertial> is turned or beside its axis.");
    const ratio = ratioOf(this.now, this.before) ** 2;
    const inertia = element.numbers("diaginertia").map((value, i) => (i === this.axis ? value : value * ratio));
    this.parts.put(element, "pos", this.point(element.numbers("pos")));
    this.parts.put(element, "diaginertia", inertia);
  }

  /** Stretch what lies along the pole, move the rest. */
  geoms(): void {
    for (const geom of this.parts.geoms(this.root)) {
      const { element, fromto, pos } = geom;
      if (fromto) this.parts.put(element, "fromto", [...this.point(fromto.slice(0, 3)), ...this.point(fromto.slice(3))]);
      else {
        this.resize(geom);
        const moved = this.point(pos);
        if (moved.some((value, i) => value !== pos[i])) this.parts.put(element, "pos", moved);
      }
    }
  }

  private resize({ index, element, size }: Geom): void {
    const kind: number = this.cartpole.model.geom_type[index];
    const shares = this.shares(index);
    const side = shares.indexOf(Math.max(...shares));
    if (kind === GEOM.sphere) return;
    const isLong = kind === GEOM.capsule || kind === GEOM.cylinder;
    if (!isLong && kind !== GEOM.box && kind !== GEOM.ellipsoid) throw new Unfit("A mesh of the pole cannot be stretched.");
    if (shares[side] <= 1 - 1e-9 || (isLong && side !== 2)) return;
    if (isLong) this.parts.put(element, "size", [size[0], this.value(size[1])]);
    else this.parts.put(element, "size", size.map((value, i) => (i === side ? this.value(value) : value)));
  }

  private ends({ index, fromto }: Geom): [Vector, Vector] {
    if (fromto) return [fromto.slice(0, 3), fromto.slice(3)];
    const { model } = this.cartpole;
    const kind: number = model.geom_type[index];
    const size = row(model.geom_size, index);
    const half = kind === GEOM.capsule || kind === GEOM.cylinder ? [0, 0, size[1]] : size;
    const arm = scaled(this.along, dot(this.shares(index), half));
    const place = row(model.geom_pos, index);
    return [subtract(place, arm), add(place, arm)];
  }

  /** Return how much each axis of a geom goes along the pole. */
  private shares(index: number): Vector {
    return turned(transposed(rotation(row(this.cartpole.model.geom_quat, index, 4))), this.along).map(Math.abs);
  }
}
