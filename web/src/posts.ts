/** Posts where a task's limits of the track are not CartPole-v1's: see media/track_limits.py. */
import { BufferAttribute, BufferGeometry, Mesh } from "three";
import { EDGE, faint } from "./fan";
import { add, scaled, subtract, type Vector } from "./vectors";

const [USUAL, HALF_WIDTH, TALL] = [2.4, 0.01, 0.5];

/** Return a post for either limit; `foot` is where the hinge is with the cart in the middle. */
export function postsOf(limit: number | null, foot: Vector, along: Vector, up: Vector): Mesh[] {
  if (limit === null || limit === USUAL) return [];
  const [aside, tall] = [scaled(along, HALF_WIDTH), scaled(up, TALL)];
  return [-limit, limit].map((place) => {
    const middle = add(foot, along, place);
    const low = [subtract(middle, aside), add(middle, aside)];
    const corners = [...low, ...low.map((corner) => add(corner, tall))];
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(corners.flat()), 3));
    geometry.setIndex([0, 1, 2, 2, 1, 3]);
    return new Mesh(geometry, faint(EDGE));
  });
}
