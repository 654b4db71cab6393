/** The game on MuJoCo itself: whose push it is, when it ends, what it waits for. */
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { beforeAll, expect, it } from "vitest";
import { type CartPole, loadCartPole, type Loader, Unfit } from "./cartpole";
import type { GridData, TaskData } from "./data";
import { edited, meaningsOf } from "./edit/meanings";
import { type Mujoco, startEngine, wordsOf } from "./engine";
import { parityText, replay } from "./parity";
import { Play } from "./play";
import { Policy } from "./policy";

const XML = readFileSync(join(import.meta.dirname, "..", "..", "models", "cartpole.xml"), "utf8");
const TASK: TaskData = { name: "t", x_limit: 2.4, theta_limit: 0.2095, start: [0, 0, 0, 0], start_low: -0.05, start_high: 0.05, time_limit: 40 };
const GRID: GridData = { bins: [1, 1, 2, 1], low: [-1, -1, -1, -1], high: [1, 1, 1, 1], tilings: 1, mirror: false, interpolated: false, turns: false };

let mujoco: Mujoco;
let loader: Loader;
let cartpole: CartPole;
const policy = new Policy(GRID, Float64Array.from([1, 0, 0, 1]));
const play = () => new Play(mujoco, cartpole, "gym", TASK, policy);

beforeAll(async () => {
  const folder = dirname(createRequire(import.meta.url).resolve("@mujoco/mujoco"));
  mujoco = await startEngine(new Uint8Array(readFileSync(join(folder, "mujoco.wasm"))).buffer);
  loader = { mujoco, files: new mujoco.MjVFS(), ownTimestep: false };
  cartpole = loadCartPole(loader, XML);
});

it("finds the parts of a cart-pole", () => {
  expect([cartpole.slider, cartpole.hinges, cartpole.controls, cartpole.substeps]).toEqual([0, [1], [-1, 1], 1]);
  const own = meaningsOf(loader, cartpole);
  expect(own).toEqual({ "pole.length": 1, "pole.mass": 0.1, "cart.mass": 1, gravity: 9.8, force: 10, "hinge.damping": 0, "rail.damping": 0 });
});

it("moves as CartPole-v1 does: the first step from rest, pushed to the right", () => {
  const game = play();
  game.restart([0, 0, 0, 0]);
  game.step();
  expect(game.state).toEqual([0, 0.1951219512195122, 0, -0.2926829268292683].map((value) => expect.closeTo(value, 14)));
});

it("ends by the rules, and by the time limit only where that counts", () => {
  const game = play();
  game.restart([0, 0, 0.2, 3]);
  game.advance(0.1);
  expect([game.ending, game.steps, game.isOver]).toEqual(["pole", 1, true]);
  game.timed = true;
  game.restart([0, 0, 0, 0]);
  for (let i = 0; i < 60; i++) game.step();
  expect([game.ending, game.steps]).toEqual(["time", 40]);
});

it("waits in a contest for the first push, and lets the table go on when the visitor has lost", () => {
  const game = play();
  game.player = "you";
  game.restart([0, 0, 0.01, 0]);
  game.advance(0.2);
  expect([game.isWaiting, game.steps]).toEqual([true, 0]);
  game.keys = -1;
  for (let i = 0; i < 30; i++) game.step();
  expect([game.ending, game.best]).toEqual(["pole", game.steps]);
  expect(game.rivalSteps).toBe(30);
});

it("adds the keys' push to the table's, and takes it away again", () => {
  const game = play();
  game.restart([0, 0, 0.01, 0]);
  game.keys = 1;
  game.step();
  expect(game.simulation.data.xfrc_applied[6]).toBe(10);
  game.keys = 0;
  game.step();
  expect(Array.from(game.simulation.data.xfrc_applied as Float64Array).every((force) => force === 0)).toBe(true);
});

it("lets the table's pushes come late, and none before", () => {
  const game = play();
  game.gap.delay = 2;
  game.restart([0, 0, 0.01, 0]);
  const moved = [1, 2, 3].map(() => { game.step(); return game.simulation.data.ctrl[0]; });
  expect(moved).toEqual([0, 0, 1]);
  game.gap.delay = 0;
  game.restart([0, 0, -0.01, 0]);
  game.step();
  expect(game.simulation.data.ctrl[0]).toBe(-1);
});

it("shows the table a state with noise, the same until the next step", () => {
  const game = play();
  game.gap.noise = 5;
  const chosen = new Set<number>();
  for (let i = 0; i < 40; i++) {
    game.restart([0, 0, 0.1, 0]);
    expect(game.look.action).toBe(game.look.action);
    chosen.add(game.look.action);
  }
  expect(chosen).toEqual(new Set([0, 1]));
});

it("tells where a replay parts", () => {
  const game = play();
  const states = new Float64Array([0, 0, 0, 0, 0, 0.2, 0, 0]);
  const found = replay(game.simulation, policy, states);
  expect([found.steps, found.equal, found.firstApart]).toEqual([1, 0, 1]);
  expect(parityText(found, "3.17", "3.14")).toMatch(/^0 of 1 steps bit-equal to MuJoCo 3.17; they part at step 1, by 2.9e-1/);
});

it("refuses what is no cart-pole, in words", () => {
  expect(() => loadCartPole(loader, "<mujoco/>")).toThrow(Unfit);
  expect(() => loadCartPole(loader, XML.replace('timestep="0.02"', 'timestep="0.007"'))).toThrow("does not divide");
  expect(() => edited(loader, XML.replace("<compiler", '<compiler settotalmass="3"'), { "pole.mass": 0.2 })).toThrow("something else");
});

it("passes on MuJoCo's own words", () => {
  try {
    loadCartPole(loader, XML.replace('"slide"', '"slyde"'));
    expect.unreachable();
  } catch (error) {
    expect(wordsOf(error)).toBe("XML Error: invalid keyword: 'slyde'\nElement 'joint', line 83");
  }
});
