/** The fan of the angle's limits at a pole's hinge: see media/angle_limits.py. */
import { BufferAttribute, BufferGeometry, Color, DoubleSide, Group, Mesh, MeshBasicMaterial } from "three";
import { type CartPole, poleBodies } from "./cartpole";
import type { MjData } from "./engine";
import { add, cross, dot, norm, row, scaled, subtract, type Vector } from "./vectors";

const COLOUR = new Color(0.42, 0.52, 0.62);
const [INSIDE, EDGE_ANGLE, SLICE, LENGTH] = [0.14, 0.008, 0.11, 1.06];
/** How opaque a limit itself is. */
export const EDGE = 0.55;

interface Wedge {
  angles: number[];
  mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
}

/** Where a task's limits of one pole's angle are. */
export class Fan {
  readonly group = new Group();
  private readonly wedges: Wedge[];
  private readonly geoms: number[];

  constructor(
    private readonly cartpole: CartPole,
    private readonly pole: number,
    limit: number | null,
  ) {
    const bodies = new Set(poleBodies(cartpole, pole));
    const { model } = cartpole;
    this.geoms = Array.from({ length: model.ngeom }, (_, i) => i).filter((i) => bodies.has(model.geom_bodyid[i]));
    this.wedges = spans(limit).map(([from, to, opacity]) => wedgeOf(from, to, opacity));
    for (const { mesh } of this.wedges) this.group.add(mesh);
  }

  /** Put it where the hinge is. */
  show(data: MjData): void {
    const hinge = this.cartpole.hinges[this.pole];
    const body = this.cartpole.model.jnt_bodyid[hinge];
    const [anchor, axis] = [row(data.xanchor, hinge), row(data.xaxis, hinge)];
    let arm = subtract(row(data.xipos, body), anchor);
    const centre = add(anchor, axis, dot(axis, arm));
    arm = subtract(arm, scaled(axis, dot(axis, arm)));
    const length = norm(arm);
    this.group.visible = length > 1e-6 && this.geoms.length > 0;
    if (!this.group.visible) return;
    const along = scaled(arm, 1 / length);
    const radius = LENGTH * this.reach(data, centre, along);
    const arms: [Vector, Vector] = [scaled(along, radius), scaled(cross(axis, along), radius)];
    for (const wedge of this.wedges) place(wedge, centre, arms, data.qpos[hinge]);
  }

  /** Return how far the pole's geoms go from the hinge, m. */
  private reach(data: MjData, centre: Vector, along: Vector): number {
    const { geom_aabb: boxes } = this.cartpole.model;
    const far = this.geoms.map((geom) => {
      const [box, place, turn] = [row(boxes, geom, 6), row(data.geom_xpos, geom), row(data.geom_xmat, geom, 9)];
      const shares = [0, 1, 2].map((i) => dot([turn[i], turn[3 + i], turn[6 + i]], along));
      const middle = dot(subtract(place, centre), along) + dot(shares, box.slice(0, 3));
      return middle + dot(shares.map(Math.abs), box.slice(3));
    });
    return Math.max(0, ...far);
  }
}

function spans(limit: number | null): [number, number, number][] {
  if (limit === null || limit >= Math.PI) return [];
  const edge = limit + EDGE_ANGLE;
  return [[-limit, limit, INSIDE], [-edge, -limit, EDGE], [limit, edge, EDGE]];
}

/** Return what limits are drawn in. */
export function faint(opacity: number): MeshBasicMaterial {
  return new MeshBasicMaterial({ color: COLOUR, opacity, transparent: true, depthWrite: false, side: DoubleSide });
}

function wedgeOf(from: number, to: number, opacity: number): Wedge {
  const count = 2 + Math.floor((to - from) / SLICE) * 2;
  const angles = Array.from({ length: count }, (_, i) => from + ((to - from) * i) / (count - 1));
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * (count + 1)), 3));
  geometry.setIndex(angles.slice(1).flatMap((_, i) => [0, i + 1, i + 2]));
  const mesh = new Mesh(geometry, faint(opacity));
  mesh.frustumCulled = false;
  return { angles, mesh };
}

function place({ angles, mesh }: Wedge, centre: Vector, [along, across]: [Vector, Vector], theta: number): void {
  const position = mesh.geometry.getAttribute("position");
  position.setXYZ(0, centre[0], centre[1], centre[2]);
  angles.forEach((angle, i) => {
    const [c, s] = [Math.cos(angle - theta), Math.sin(angle - theta)];
    position.setXYZ(i + 1, centre[0] + c * along[0] + s * across[0], centre[1] + c * along[1] + s * across[1], centre[2] + c * along[2] + s * across[2]);
  });
  position.needsUpdate = true;
}
