/** Elements of a document that stand for parts of its compiled model: see physics/edit/xml_elements.py. */
import { type CartPole, Unfit } from "../cartpole";
import type { Mujoco } from "../engine";
import { OBJECT } from "../engine";
import { type Document, type Element, numberText } from "./document";

/** A geom as its element and its defaults say it. */
export interface Geom {
  index: number;
  element: Element;
  fromto: number[] | null;
  pos: number[];
  size: number[];
  mass: number;
  density: number;
}

/** The elements of a document, and what it compiles to but for numbers that were edited since. */
export class Parts {
  private readonly bodies: Element[];

  constructor(
    private readonly mujoco: Mujoco,
    readonly document: Document,
    readonly cartpole: CartPole,
  ) {
    const worlds = document.root.children.filter(({ tag }) => tag === "worldbody");
    this.bodies = worlds.flatMap((world) => world.walk()).filter(({ tag }) => tag === "body");
  }

  /** Return the element of a body. */
  body(index: number): Element {
    const { model } = this.cartpole;
    const names = Array.from({ length: model.nbody - 1 }, (_, i) => this.mujoco.mj_id2name(model, OBJECT.body, i + 1) ?? "");
    const written = this.bodies.map(({ attributes }) => attributes.get("name") ?? "");
    if (written.join("\n") !== names.join("\n"))
      throw new Unfit("The document does not write every body itself, so it cannot be edited by meaning.");
    return this.bodies[index - 1];
  }

  /** Return the element of a joint. */
  joint(index: number): Element {
    const { model } = this.cartpole;
    const body = model.jnt_bodyid[index];
    return this.allOf("joint", body, model.body_jntnum[body])[index - model.body_jntadr[body]];
  }

  private allOf(tag: string, body: number, count: number): Element[] {
    const found = this.body(body).find(tag);
    if (found.length !== count) throw new Unfit(`Not all <${tag}>s of a body are in the document; it cannot be edited by meaning.`);
    return found;
  }

  /** Return each geom of a body, with its defaults. */
  geoms(body: number): Geom[] {
    const { model } = this.cartpole;
    const first = model.body_geomadr[body];
    const elements = this.allOf("geom", body, model.body_geomnum[body]);
    if (elements.length === 0) return [];
    const spec = this.mujoco.parseXMLString(this.document.text);
    const found: Geom[] = [];
    let each = this.mujoco.mjs_firstElement(spec, this.mujoco.mjtObj.mjOBJ_GEOM);
    for (let index = 0; each && index < first + elements.length; index++) {
      const said = this.mujoco.mjs_asGeom(each);
      if (said && index >= first) {
        const fromto: number[] = Array.from(said.fromto);
        const [pos, size]: number[][] = [Array.from(said.pos), Array.from(said.size)];
        const { mass, density } = said;
        found.push({ index, element: elements[index - first], fromto: Number.isNaN(fromto[0]) ? null : fromto, pos, size, mass, density });
      }
      each = this.mujoco.mjs_nextElement(spec, each);
    }
    spec.delete();
    return found;
  }

  /** Return the element of the motor. */
  motor(): Element {
    const sections = this.document.root.children.filter(({ tag }) => tag === "actuator");
    return sections.flatMap(({ children }) => children)[0];
  }

  /** Return the <inertial> that decides a body's mass; null where geoms do. */
  inertial(body: number): Element | null {
    const compilers = this.document.root.children.filter(({ tag }) => tag === "compiler");
    const said = compilers.map(({ attributes }) => attributes.get("inertiafromgeom")).filter(Boolean);
    return said.at(-1) === "true" ? null : (this.body(body).find("inertial")[0] ?? null);
  }

  /** Write numbers into an attribute; those that do not change keep their spelling. */
  put(element: Element, name: string, values: number[]): void {
    if (!values.every(Number.isFinite)) throw new Unfit(`${name} would not be finite; edit less.`);
    const written = (element.attributes.get(name) ?? "").trim().split(/\s+/).filter(Boolean);
    const isSpelled = written.length === values.length;
    const tokens = values.map((value, i) => numberText(value, isSpelled ? written[i] : ""));
    if (tokens.join(" ") !== written.join(" ")) this.document.set(element, name, tokens.join(" "));
  }
}
