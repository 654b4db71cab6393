/** Known answers, by hand; web/same.mjs holds all kinds of grids against Python's. */
import { describe, expect, it } from "vitest";
import type { GridData } from "./data";
import { Policy } from "./policy";

const grid = (changes: Partial<GridData>): GridData => ({
  bins: [1, 2], low: [-1, -1], high: [1, 1], tilings: 1, mirror: false, interpolated: false, turns: false, ...changes,
});
const policy = (changes: Partial<GridData>, table: number[]) => new Policy(grid(changes), Float64Array.from(table));

describe("one grid", () => {
  const two = policy({}, [1, 2, 4, 3]);

  it("takes the better action of a row", () => {
    expect(two.look([9, -0.5])).toEqual({ values: [1, 2], action: 1 });
    expect(two.look([9, 0.5])).toEqual({ values: [4, 3], action: 0 });
  });

  it("puts what lies outside, and on an edge, into a bin", () => {
    expect([-5, -1, 0, 1, 5].map((value) => two.cells([0, value])[0])).toEqual([0, 0, 1, 1, 1]);
  });

  it("sees float32, as an observation is", () => {
    const three = policy({ bins: [1, 3], low: [-1, 0], high: [1, 3] }, [0, 0, 0, 0, 0, 0]);
    expect([1 - 1e-6, 1 - 1e-9].map((value) => three.cells([0, value])[0])).toEqual([0, 1]);
  });

  it("takes action 0 between equals", () => {
    expect(policy({}, [7, 7, 7, 7]).look([0, 0]).action).toBe(0);
  });
});

it("sums several tilings, each moved by its part of a bin", () => {
  const moved = policy({ tilings: 2 }, [1, 0, 2, 0, 10, 0, 20, 0]);
  expect([-1, -0.1, 0.7].map((value) => moved.look([0, value]).values[0])).toEqual([11, 21, 22]);
});

it("takes the mirror image's other action, also between equals", () => {
  const mirrored = policy({ tilings: 2, mirror: true }, [5, 1, 5, 1, 5, 1, 5, 1]);
  expect(mirrored.look([0, -0.9])).toEqual({ values: [10, 2], action: 0 });
  expect(mirrored.look([0, 0.9])).toEqual({ values: [2, 10], action: 1 });
  expect(policy({ tilings: 2, mirror: true }, [5, 5, 5, 5, 5, 5, 5, 5]).look([0, 0.9]).action).toBe(1);
});

it("interpolates between nodes", () => {
  const nodes = policy({ interpolated: true }, [0, 0, 8, 4]);
  expect(nodes.look([0, 0]).values).toEqual([4, 2]);
  expect(nodes.look([0, 5]).values).toEqual([8, 4]);
});
