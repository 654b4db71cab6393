/** The geoms of a model as meshes of three.js. */
import {
  BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, Color, CylinderGeometry, DoubleSide, Mesh,
  MeshLambertMaterial, PlaneGeometry, SphereGeometry,
} from "three";
import { GEOM, type MjModel } from "./engine";
import { row, type Vector } from "./vectors";

export interface Drawn {
  geom: number;
  body: number;
  moves: boolean;
  mesh: Mesh<BufferGeometry, MeshLambertMaterial>;
}

const FAR = 100;
const SHOWN_GROUPS = 3;
const UNSET = [0.5, 0.5, 0.5, 1];

/** Return a mesh for each geom that is to be seen. */
export function drawnGeoms(model: MjModel, dark: boolean): Drawn[] {
  const found: Drawn[] = [];
  for (let geom = 0; geom < model.ngeom; geom++) {
    const shape = shapeOf(model, geom);
    const rgba = colourOf(model, geom);
    if (!shape || rgba[3] === 0 || model.geom_group[geom] >= SHOWN_GROUPS) continue;
    const body = model.geom_bodyid[geom];
    const moves = model.body_weldid[body] !== 0;
    const mesh = new Mesh(shape, materialOf(model, geom, dark ? darkened(rgba, moves) : rgba));
    mesh.matrixAutoUpdate = false;
    found.push({ geom, body, moves, mesh });
  }
  return found;
}

function shapeOf(model: MjModel, geom: number): BufferGeometry | null {
  const [x, y, z] = row(model.geom_size, geom);
  switch (model.geom_type[geom]) {
    case GEOM.plane: return new PlaneGeometry(2 * (x || FAR), 2 * (y || FAR));
    case GEOM.sphere: return new SphereGeometry(x, 32, 24);
    case GEOM.ellipsoid: return new SphereGeometry(1, 32, 24).scale(x, y, z);
    case GEOM.capsule: return new CapsuleGeometry(x, 2 * y, 12, 32).rotateX(Math.PI / 2);
    case GEOM.cylinder: return new CylinderGeometry(x, x, 2 * y, 40).rotateX(Math.PI / 2);
    case GEOM.box: return new BoxGeometry(2 * x, 2 * y, 2 * z);
    case GEOM.mesh: return meshShape(model, model.geom_dataid[geom]);
    default: return null;
  }
}

function meshShape(model: MjModel, mesh: number): BufferGeometry {
  const [start, faces] = [model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]];
  const shape = new BufferGeometry();
  const vertices = model.mesh_vert.slice(3 * start, 3 * (start + model.mesh_vertnum[mesh]));
  shape.setAttribute("position", new BufferAttribute(vertices, 3));
  shape.setIndex(Array.from(model.mesh_face.slice(3 * faces, 3 * (faces + model.mesh_facenum[mesh]))));
  shape.computeVertexNormals();
  return shape;
}

/** Return a geom's colour: its own, or where it has none its material's. */
function colourOf(model: MjModel, geom: number): Vector {
  const own = row(model.geom_rgba, geom, 4);
  const material = model.geom_matid[geom];
  const isSet = own.some((value, i) => Math.abs(value - UNSET[i]) > 1e-6);
  return isSet || material < 0 ? own : row(model.mat_rgba, material, 4);
}

/** Return a colour for a dark page: what is light and stands still becomes the night around it. */
function darkened([r, g, b, a]: Vector, moves: boolean): Vector {
  const light = 0.3 * r + 0.6 * g + 0.1 * b;
  if (!moves && light > 0.8) return [0.085 * r, 0.1 * g, 0.125 * b, a];
  return light < 0.35 && Math.max(r, g, b) - Math.min(r, g, b) < 0.2 ? [r + 0.16, g + 0.17, b + 0.19, a] : [r, g, b, a];
}

function materialOf(model: MjModel, geom: number, [r, g, b, a]: Vector): MeshLambertMaterial {
  const material = model.geom_matid[geom];
  const emission = material < 0 ? 0 : model.mat_emission[material];
  return new MeshLambertMaterial({
    color: new Color(r, g, b),
    emissive: new Color(r, g, b).multiplyScalar(emission),
    opacity: a,
    transparent: a < 1,
    side: DoubleSide,
  });
}
