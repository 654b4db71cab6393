/** Vectors of three numbers, and rotation matrices, row by row. */

export type Vector = number[];

export const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const norm = (a: Vector): number => Math.sqrt(dot(a, a));
export const add = (a: Vector, b: Vector, times = 1): Vector => a.map((value, i) => value + times * b[i]);
export const subtract = (a: Vector, b: Vector): Vector => add(a, b, -1);
export const scaled = (a: Vector, by: number): Vector => a.map((value) => value * by);

export function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** Return row `index` of an array whose rows have `width` numbers. */
export function row(values: ArrayLike<number>, index: number, width = 3): Vector {
  return Array.from({ length: width }, (_, i) => values[width * index + i]);
}

/** Return the rotation matrix of a quaternion. */
export function rotation([w, x, y, z]: Vector): Vector {
  return [
    w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y),
    2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z,
  ];
}

export function turned(matrix: Vector, v: Vector): Vector {
  return [0, 1, 2].map((i) => dot(matrix.slice(3 * i, 3 * i + 3), v));
}

export function product(a: Vector, b: Vector): Vector {
  return Array.from({ length: 9 }, (_, i) => {
    const [r, c] = [Math.floor(i / 3), i % 3];
    return a[3 * r] * b[c] + a[3 * r + 1] * b[3 + c] + a[3 * r + 2] * b[6 + c];
  });
}

export function transposed(a: Vector): Vector {
  return Array.from({ length: 9 }, (_, i) => a[3 * (i % 3) + Math.floor(i / 3)]);
}
