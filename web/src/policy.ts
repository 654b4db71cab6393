/**
 * From an observation to an action: the grids and tables of learning/discretizer.py and
 * learning/tiles.py, in the same order of operations, so that every bit is the same.
 *
 * Of a state Python has one number; here it is the list of its cells, one for each dimension that
 * has more than one bin, since such a number may have more than 53 bits.
 */
import type { GridData } from "./data";

interface Axis {
  dimension: number;
  bins: number;
  cells: number;
  low: number;
  high: number;
  width: number;
}

export interface Look {
  values: [number, number];
  action: number;
}

const CELL_BITS = 42;

/** Return into how many cells a bin, or the gap between two nodes, is cut. */
function partsOf(grid: GridData): number {
  const used = grid.bins.filter((n) => n > 1).length;
  if (!(grid.interpolated && used > 0)) return grid.tilings;
  return 2 ** Math.min(10, Math.floor(CELL_BITS / used));
}

function axisOf(grid: GridData, dimension: number, parts: number): Axis {
  const bins = grid.bins[dimension];
  let [low, high] = [grid.low[dimension], grid.high[dimension]];
  let width = (high - low) / (bins - Number(grid.interpolated));
  if (parts === 1) return { dimension, bins, cells: bins, low, high, width };
  const edge = grid.interpolated ? 0 : 1;
  low = low + (edge * width - width / parts) / 2;
  const cells = (bins - 1) * parts + 1;
  width = width / parts;
  high = low + cells * width;
  return { dimension, bins, cells, low, high, width };
}

/** Return which cell of an axis a value is in; what lies outside belongs to the ends. */
function cellOf(value: number, axis: Axis): number {
  if (value < axis.low) return 0;
  if (value >= axis.high) return axis.cells - 1;
  return Math.min(Math.trunc((value - axis.low) / axis.width), axis.cells - 1);
}

/** Return an angle as it counts from -pi to pi: see task.py, whose `//` this is. */
function wrapped(theta: number): number {
  const turn = 2 * Math.PI;
  const rest = (theta + Math.PI) % turn;
  const whole = (theta + Math.PI - rest) / turn - (rest < 0 ? 1 : 0);
  return theta - turn * Math.round(whole);
}

/** A greedy policy. */
export class Policy {
  readonly axes: Axis[];
  readonly parts: number;

  constructor(
    readonly grid: GridData,
    private readonly table: Float64Array,
  ) {
    this.parts = partsOf(grid);
    const used = grid.bins.flatMap((n, dimension) => (n > 1 ? [dimension] : []));
    this.axes = used.map((dimension) => axisOf(grid, dimension, this.parts));
  }

  /** Return a state as it is observed, but for its rounding. */
  seen(state: ArrayLike<number>): number[] {
    const isAngle = (i: number) => this.grid.turns && i >= 2 && i % 2 === 0;
    return Array.from(state, (value, i) => (isAngle(i) ? wrapped(value) : value));
  }

  /** Return the cells of an observation, whose numbers are rounded to float32 first. */
  cells(state: ArrayLike<number>): number[] {
    const seen = this.seen(state);
    return this.axes.map((axis) => cellOf(Math.fround(seen[axis.dimension]), axis));
  }

  /** Return both values and the better action in a state; action 0 between equals. */
  look(state: ArrayLike<number>): Look {
    const cells = this.cells(state);
    const mirrored = this.grid.mirror && this.isImage(cells);
    if (mirrored) this.axes.forEach((axis, i) => { cells[i] = axis.cells - 1 - cells[i]; });
    const [left, right] = this.pair(cells);
    const better = right > left ? 1 : 0;
    return mirrored
      ? { values: [right, left], action: 1 - better }
      : { values: [left, right], action: better };
  }

  /** Return whether a state lies in the second half of a mirrored grid. */
  private isImage(cells: number[]): boolean {
    for (let i = 0; i < cells.length; i++) {
      const image = this.axes[i].cells - 1 - cells[i];
      if (cells[i] !== image) return cells[i] > image;
    }
    return false;
  }

  private pair(cells: number[]): [number, number] {
    let [left, right] = [0, 0];
    if (this.grid.interpolated && this.parts > 1) {
      for (let corner = 0; corner < 1 << cells.length; corner++) {
        const [row, weight] = this.node(cells, corner);
        left += weight * this.table[2 * row];
        right += weight * this.table[2 * row + 1];
      }
      return [left, right];
    }
    for (let tiling = 0; tiling < this.parts; tiling++) {
      const row = this.rowIn(cells, tiling);
      left += this.table[2 * row];
      right += this.table[2 * row + 1];
    }
    return [left, right];
  }

  /** Return the row of a state in one of the tilings. */
  private rowIn(cells: number[], tiling: number): number {
    let [row, stride] = [0, 1];
    for (let axis = cells.length - 1; axis >= 0; axis--) {
      const moved = (tiling * (2 * axis + 1)) % this.parts;
      row += stride * Math.floor((cells[axis] + moved) / this.parts);
      stride *= this.axes[axis].bins;
    }
    return tiling * stride + row;
  }

  /** Return the row of one of the nodes around a state, and its weight. */
  private node(cells: number[], corner: number): [number, number] {
    let [row, weight, stride] = [0, 1, 1];
    for (let axis = cells.length - 1; axis >= 0; axis--) {
      const behind = cells[axis] % this.parts;
      const far = (corner >> axis) & 1;
      weight *= far ? behind / this.parts : 1 - behind / this.parts;
      row += stride * (Math.floor(cells[axis] / this.parts) + (far && behind ? 1 : 0));
      stride *= this.axes[axis].bins;
    }
    return [row, weight];
  }
}
