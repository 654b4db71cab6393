import { expect, test } from "vitest";
import { postsOf } from "./posts";

test("posts stand at limits that are not the usual ones", () => {
  const [left, right] = postsOf(1.2, [0, 0.1, 0.2], [1, 0, 0], [0, 0, 1]);
  const corners = Array.from(right.geometry.getAttribute("position").array);
  expect(corners.map((value) => value.toFixed(2)).join(" ")).toBe("1.19 0.10 0.20 1.21 0.10 0.20 1.19 0.10 0.70 1.21 0.10 0.70");
  expect(left.geometry.getAttribute("position").getX(0)).toBeCloseTo(-1.21);
  expect([postsOf(2.4, [0, 0, 0], [1, 0, 0], [0, 0, 1]), postsOf(null, [0, 0, 0], [1, 0, 0], [0, 0, 1])]).toEqual([[], []]);
});
