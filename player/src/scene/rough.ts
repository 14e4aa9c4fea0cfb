/**
 * Convex solids in 24 triangles, for bodies that are small on the screen while time moves: a cube whose faces are
 * pyramids, its corners moved to the farthest points of the solid along them. Boxes stay boxes.
 */

import { BoxGeometry, BufferGeometry, Float32BufferAttribute } from "three";

type Triple = readonly [number, number, number];
/** The point of a solid that is farthest along a direction; of many such points the middle. */
type Farthest = (direction: Triple) => Triple;

/** Along the axes, then to the corners of a cube. */
const DIRECTIONS: readonly Triple[] = [
  [1, 0, 0],
  [-1, 0, 0],
  [0, 1, 0],
  [0, -1, 0],
  [0, 0, 1],
  [0, 0, -1],
  ...[-1, 1].flatMap((x) => [-1, 1].flatMap((y) => [-1, 1].map((z): Triple => [x, y, z]))),
];
/** Triangles between a face's middle and two corners that follow each other around it. */
const TRIANGLES = trianglesOf();

/** Makes the rough geometry of a solid of which the farthest points are known. */
export const rough = (farthest: Farthest) => (): BufferGeometry => {
  const made = new BufferGeometry();
  made.setAttribute("position", new Float32BufferAttribute(DIRECTIONS.flatMap(farthest), 3));
  made.setAttribute(
    "normal",
    new Float32BufferAttribute(
      DIRECTIONS.flatMap((each) => stretched(each, 1)),
      3,
    ),
  );
  return made.setIndex(TRIANGLES);
};

/** Makes a box that stands for one that is swept by a ball. */
export const roughBox =
  ([x, y, z]: Triple, radius: number) =>
  (): BufferGeometry =>
    new BoxGeometry(x + 1.8 * radius, y + 1.8 * radius, z + 1.8 * radius);

export const ofBall: Farthest = (direction) => stretched(direction, 1);

export const ofBox =
  ([x, y, z]: Triple): Farthest =>
  ([a, b, c]) => [(Math.sign(a) * x) / 2, (Math.sign(b) * y) / 2, (Math.sign(c) * z) / 2];

export const ofCylinder =
  (radius: number, height: number): Farthest =>
  ([a, b, c]) => {
    const [x, y] = stretched([a, b, 0], radius);
    return [x, y, (Math.sign(c) * height) / 2];
  };

export const ofCone =
  (radius: number, height: number): Farthest =>
  ([a, b, c]) => {
    if (c > 0) return [0, 0, height / 2];
    const [x, y] = stretched([a, b, 0], radius);
    return [x, y, -height / 2];
  };

export const ofPoints =
  (points: number[][]): Farthest =>
  ([a, b, c]) => {
    let most = Number.NEGATIVE_INFINITY;
    let found: number[] = [0, 0, 0];
    for (const point of points) {
      const along = a * point[0] + b * point[1] + c * point[2];
      if (along > most) [most, found] = [along, point];
    }
    return found as unknown as Triple;
  };

/** A solid swept by a ball. */
export const swept =
  (inner: Farthest, radius: number): Farthest =>
  (direction) => {
    const [at, by] = [inner(direction), stretched(direction, radius)];
    return [at[0] + by[0], at[1] + by[1], at[2] + by[2]];
  };

/** A direction in another length; nothing of nothing. */
function stretched([x, y, z]: Triple, length: number): Triple {
  const factor = length / (Math.hypot(x, y, z) || 1);
  return [x * factor, y * factor, z * factor];
}

function trianglesOf(): number[] {
  const found: number[] = [];
  for (let face = 0; face < 6; face++) {
    const [axis, sign] = [face >> 1, face % 2 ? -1 : 1];
    const corner = (u: number, v: number): number => {
      const at = [0, 0, 0];
      [at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]] = [sign, sign * u, v];
      return DIRECTIONS.findIndex(([x, y, z], i) => i > 5 && x === at[0] && y === at[1] && z === at[2]);
    };
    const ring = [corner(1, -1), corner(1, 1), corner(-1, 1), corner(-1, -1)];
    ring.forEach((at, i) => {
      found.push(face, at, ring[(i + 1) % 4]);
    });
  }
  return found;
}
