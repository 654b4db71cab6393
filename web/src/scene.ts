/** The scene: a cart-pole drawn by three.js from its compiled model, seen by the model's cameras. */
import {
  AmbientLight, ArrowHelper, BufferGeometry, Color, ColorManagement, DirectionalLight, Line, LineBasicMaterial,
  LinearSRGBColorSpace, type Object3D, PerspectiveCamera, Plane, Raycaster, Scene as Graph, Vector2, Vector3, type WebGLRenderer,
} from "three";
import { type CartPole, dataAtZero, jointsIn, upOf } from "./cartpole";
import type { TaskData } from "./data";
import { isDark } from "./dom";
import type { MjData, Mujoco } from "./engine";
import { Fan } from "./fan";
import { type Drawn, drawnGeoms } from "./geoms";
import { postsOf } from "./posts";
import { add, cross, row, type Vector } from "./vectors";

ColorManagement.enabled = false;

const ACTION = new Color(0 / 255, 146 / 255, 118 / 255);
const GHOST = 0.28;
const FILM_ASPECT = 4 / 3;
/** How much of a film's height a wider picture shows at least. */
const CLOSEST = 0.87;
const NEAR_ENOUGH = [0, 10, 20, 30];

export interface Grip {
  body: number;
  point: Vector;
}

/** Draws states of one cart-pole. */
export class Scene {
  private readonly graph = new Graph();
  private readonly camera = new PerspectiveCamera(40, 1, 0.05, 200);
  private readonly headlight = new DirectionalLight();
  private readonly data: MjData;
  private readonly drawn: Drawn[];
  private readonly ghosts: Drawn[];
  private readonly fans: Fan[];
  private readonly arrow = new ArrowHelper(new Vector3(1, 0, 0), new Vector3(), 1, ACTION);
  private readonly rope: Line<BufferGeometry, LineBasicMaterial>;
  private cameraName = "side";
  /** Where a positive x goes, and where the cart is at 0. */
  private readonly track: [Vector, Vector];

  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly mujoco: Mujoco,
    readonly cartpole: CartPole,
    private readonly task: TaskData,
  ) {
    renderer.outputColorSpace = LinearSRGBColorSpace;
    const { model, slider } = cartpole;
    this.data = dataAtZero(mujoco, model);
    this.track = [row(this.data.xaxis, slider), row(this.data.xpos, model.jnt_bodyid[slider])];
    this.drawn = drawnGeoms(cartpole.model, isDark());
    this.ghosts = drawnGeoms(cartpole.model, isDark()).filter(({ moves }) => moves);
    for (const { mesh } of this.ghosts) Object.assign(mesh.material, { transparent: true, opacity: GHOST, depthWrite: false });
    this.fans = cartpole.hinges.map((_, pole) => new Fan(cartpole, pole, task.theta_limit));
    const foot = row(this.data.xanchor, cartpole.hinges[0]);
    const posts = postsOf(task.x_limit, foot, this.track[0], upOf(Array.from(model.opt.gravity)));
    this.rope = new Line(new BufferGeometry(), new LineBasicMaterial({ color: ACTION }));
    const parts: Object3D[] = [...this.drawn, ...this.ghosts].map(({ mesh }) => mesh);
    this.graph.add(...parts, ...posts, ...this.fans.map(({ group }) => group), this.arrow, this.rope, this.headlight, this.headlight.target);
    this.light();
  }

  /** The names of what one can see it by. */
  get cameras(): string[] {
    const { model } = this.cartpole;
    const names = Array.from({ length: model.ncam }, (_, i) => this.mujoco.mj_id2name(model, 7, i) || "");
    return [...names.filter((name) => name !== ""), "free"];
  }

  set seenBy(name: string) {
    this.cameraName = name;
  }

  /** Draw a state, another one behind it as a ghost, the action's push, and the rope of a pull. */
  draw(state: ArrayLike<number>, ghost: number[] | null, push: number, pull: [Vector, Vector] | null): void {
    for (const { mesh } of this.ghosts) mesh.visible = ghost !== null;
    if (ghost) this.pose(ghost, this.ghosts);
    this.pose(state, this.drawn);
    for (const fan of this.fans) fan.show(this.data);
    this.aim();
    this.showPush(push);
    this.rope.visible = pull !== null;
    if (pull) this.rope.geometry.setFromPoints(pull.map((point) => new Vector3(...point)));
    this.renderer.render(this.graph, this.camera);
  }

  private pose(state: ArrayLike<number>, drawn: Drawn[]): void {
    const { data, cartpole } = this;
    jointsIn(cartpole).forEach((joint, i) => { data.qpos[joint] = state[2 * i]; });
    this.mujoco.mj_fwdPosition(cartpole.model, data);
    const { geom_xpos: places, geom_xmat: turns } = data;
    for (const { geom, mesh } of drawn) {
      const [p, m] = [row(places, geom), row(turns, geom, 9)];
      mesh.matrix.set(m[0], m[1], m[2], p[0], m[3], m[4], m[5], p[1], m[6], m[7], m[8], p[2], 0, 0, 0, 1);
    }
  }

  private showPush(push: number): void {
    const { data, cartpole } = this;
    this.arrow.visible = push !== 0;
    if (push === 0) return;
    const axis = row(data.xaxis, cartpole.slider);
    const start = add(row(data.xpos, cartpole.model.jnt_bodyid[cartpole.slider]), axis, 0.24 * Math.sign(push));
    this.arrow.position.set(start[0], start[1] - 0.06, start[2]);
    this.arrow.setDirection(new Vector3(...axis).multiplyScalar(Math.sign(push)));
    this.arrow.setLength(0.42, 0.16, 0.13);
  }

  private light(): void {
    const { model } = this.cartpole;
    const { ambient, diffuse } = model.vis.headlight;
    this.graph.add(new AmbientLight(new Color(...row(ambient, 0)), Math.PI));
    this.headlight.color = new Color(...row(diffuse, 0));
    this.headlight.intensity = Math.PI;
    for (let i = 0; i < model.nlight; i++) {
      const lamp = new DirectionalLight(new Color(...row(model.light_diffuse, i)), Math.PI);
      lamp.position.set(0, 0, 0).sub(new Vector3(...row(model.light_dir, i))).multiplyScalar(10);
      this.graph.add(lamp);
    }
  }

  /** Look through the camera, as wide as the film is at least. */
  private aim(): void {
    const { model } = this.cartpole;
    const size = this.renderer.getSize(new Vector2());
    const index = this.cameras.indexOf(this.cameraName);
    this.camera.aspect = size.x / size.y;
    const isFree = index < 0 || index >= model.ncam;
    const fovy = isFree ? this.frameTrack() : this.throughCamera(index);
    const half = Math.tan((fovy * Math.PI) / 360) * Math.max(CLOSEST, FILM_ASPECT / this.camera.aspect);
    this.camera.fov = (Math.atan(half) * 360) / Math.PI;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld(true);
    this.headlight.position.setFromMatrixPosition(this.camera.matrixWorld);
    this.headlight.target.position.copy(this.headlight.position).add(this.camera.getWorldDirection(new Vector3()));
  }

  private throughCamera(index: number): number {
    const [p, m] = [row(this.data.cam_xpos, index), row(this.data.cam_xmat, index, 9)];
    this.camera.matrixAutoUpdate = false;
    this.camera.matrix.set(m[0], m[1], m[2], p[0], m[3], m[4], m[5], p[1], m[6], m[7], m[8], p[2], 0, 0, 0, 1);
    return this.cartpole.model.cam_fovy[index];
  }

  /** Look from where the whole track fits, +x to the right. */
  private frameTrack(): number {
    const { model } = this.cartpole;
    const [[rail, middle], up] = [this.track, [0, 0, 1]];
    const forward = cross(up, rail);
    const fovy: number = model.vis.global.fovy;
    const distance = (1.2 * (this.task.x_limit ?? 2.4)) / (FILM_ASPECT * Math.tan((fovy * Math.PI) / 360));
    const lookAt = add(middle, up, 0.5);
    this.camera.matrixAutoUpdate = true;
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(...(add(lookAt, forward, -distance) as [number, number, number]));
    this.camera.lookAt(new Vector3(...lookAt));
    return fovy;
  }

  /** Return what moves under a place of the canvas, in -1 to 1, or nearly under it. */
  grip(at: Vector2): Grip | null {
    const size = this.renderer.getSize(new Vector2());
    const moving = this.drawn.filter(({ moves }) => moves);
    for (const radius of NEAR_ENOUGH)
      for (let turn = 0; turn < (radius ? 12 : 1); turn++) {
        const angle = (turn * Math.PI) / 6;
        const near = new Vector2((Math.cos(angle) * radius * 2) / size.x, (Math.sin(angle) * radius * 2) / size.y);
        const [hit] = this.rayThrough(at.clone().add(near)).intersectObjects(moving.map(({ mesh }) => mesh));
        const found = moving.find(({ mesh }) => mesh === hit?.object);
        if (hit && found) return { body: found.body, point: hit.point.toArray() };
      }
    return null;
  }

  /** Return the point under a place of the canvas that is as far away as another one. */
  pointAt(at: Vector2, asFarAs: Vector): Vector {
    const facing = new Plane().setFromNormalAndCoplanarPoint(this.camera.getWorldDirection(new Vector3()), new Vector3(...asFarAs));
    return this.rayThrough(at).ray.intersectPlane(facing, new Vector3())?.toArray() ?? asFarAs;
  }

  /** Return where a point is seen, in -1 to 1. */
  seenAt(point: Vector): Vector2 {
    const seen = new Vector3(...point).project(this.camera);
    return new Vector2(seen.x, seen.y);
  }

  private rayThrough(at: Vector2): Raycaster {
    const ray = new Raycaster();
    ray.setFromCamera(at, this.camera);
    return ray;
  }

  /** Return where a body's middle is in the world, as last drawn. */
  middleOf(body: number): Vector {
    return row(this.data.xipos, body);
  }

  delete(): void {
    for (const { mesh } of [...this.drawn, ...this.ghosts]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.data.delete();
  }
}
