/** Shapes of the plane as filled outlines at z = 0; what they mean is told in `python/carom/_shapes.py`. */

import {
  BufferGeometry,
  Float32BufferAttribute,
  Path,
  Vector2 as Point,
  Shape,
  ShapeGeometry,
  type Vector2,
  Vector3,
} from "three";
import type { ShapeTable } from "../data/payload";
import type { Form } from "./pieces";

/** Corners of a full turn. */
const ROUND = 48;

/** The form of a shape of the plane. */
export function planarForm(shape: ShapeTable, reach: number): Form {
  switch (shape.type) {
    case "circle": {
      const radius = shape.radius as number;
      return form("circle", [radius, radius, 1], () => filled(arc(0, 0, 1, 0, 2 * Math.PI, ROUND), true));
    }
    case "box": {
      const [width, height] = shape.size as number[];
      return form("box", [width, height, 1], () => filled(corners(1, 1)));
    }
    case "capsule": {
      const half = (shape.length as number) / 2;
      return own(shape, () =>
        filled(
          rounded(
            [
              [-half, 0],
              [half, 0],
            ],
            shape.radius as number,
          ),
        ),
      );
    }
    case "round_box": {
      const [width, height] = shape.size as number[];
      return own(shape, () => filled(rounded(pairs(corners(width, height)), shape.radius as number)));
    }
    case "convex_polygon":
      return own(shape, () => filled(convexHull(shape.points as number[][])));
    case "round_polygon": {
      const hull = pairs(convexHull(shape.points as number[][]));
      return own(shape, () => filled(rounded(hull, shape.radius as number)));
    }
    case "segment":
      return own(shape, () => wall([shape.a as number[], shape.b as number[]], false));
    case "polyline":
      return own(shape, () => wall(shape.points as number[][], shape.closed === true));
    case "height_field":
      return own(shape, () => wall(heightLine(shape.heights as number[], shape.width as number), false));
    case "half_plane": {
      const [x, y] = shape.normal as number[];
      return {
        ...own(shape, () => halfPlane([x, y], reach)),
        normal: new Vector3(x, y, 0).normalize(),
        spacing: 0,
      };
    }
    case "cavity":
      return own(shape, () => cavity(shape.radius as number));
    default:
      throw new Error(`This page cannot draw the shape ${shape.type} of the plane.`);
  }
}

function form(key: string, size: [number, number, number], make: Form["make"]): Form {
  return { key: `planar ${key}`, size, make };
}

/** A form that only equal shapes share. */
function own(shape: ShapeTable, make: Form["make"]): Form {
  return form(JSON.stringify(shape), [1, 1, 1], make);
}

function corners(width: number, height: number): Point[] {
  const [x, y] = [width / 2, height / 2];
  return [new Point(-x, -y), new Point(x, -y), new Point(x, y), new Point(-x, y)];
}

function pairs(points: Point[]): number[][] {
  return points.map((point) => [point.x, point.y]);
}

function arc(x: number, y: number, radius: number, from: number, to: number, count: number): Point[] {
  return Array.from({ length: count }, (_, i) => {
    const angle = from + ((to - from) * i) / (to - from >= 2 * Math.PI ? count : count - 1);
    return new Point(x + radius * Math.cos(angle), y + radius * Math.sin(angle));
  });
}

/** The outline of a convex polygon (counter-clockwise) swept by a disc. */
function rounded(points: number[][], radius: number): Point[] {
  const count = points.length;
  return points.flatMap((point, i) => {
    const [before, after] = [points[(i + count - 1) % count], points[(i + 1) % count]];
    const from = Math.atan2(point[1] - before[1], point[0] - before[0]) - Math.PI / 2;
    let to = Math.atan2(after[1] - point[1], after[0] - point[0]) - Math.PI / 2;
    while (to < from) to += 2 * Math.PI;
    const steps = Math.max(2, Math.ceil(((to - from) / (2 * Math.PI)) * ROUND) + 1);
    return arc(point[0], point[1], radius, from, to, steps);
  });
}

/** Convex hull, counter-clockwise (Andrew's monotone chain). */
export function convexHull(points: number[][]): Point[] {
  const sorted = points.map(([x, y]) => new Point(x, y)).sort((p, q) => p.x - q.x || p.y - q.y);
  const half = (list: Point[]): Point[] => {
    const chain: Point[] = [];
    for (const point of list) {
      while (chain.length > 1 && turn(chain[chain.length - 2], chain[chain.length - 1], point) <= 0)
        chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half([...sorted].reverse())];
}

function turn(a: Point, b: Point, c: Point): number {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

function heightLine(heights: number[], width: number): number[][] {
  return heights.map((height, i) => [width * (i / (heights.length - 1) - 0.5), height]);
}

/** A filled outline; a disc also has a spoke, so that its turning is seen. */
function filled(outline: Point[], spoke = false): ReturnType<Form["make"]> {
  const lines: Point[][] = [[...outline, outline[0]]];
  if (spoke) lines.push([new Point(0, 0), outline[0]]);
  return { fill: new ShapeGeometry(new Shape(outline)), edges: edgesOf(lines) };
}

function edgesOf(lines: Vector2[][]): BufferGeometry {
  const numbers: number[] = [];
  for (const line of lines)
    for (let i = 0; i + 1 < line.length; i++) {
      numbers.push(line[i].x, line[i].y, 0, line[i + 1].x, line[i + 1].y, 0);
    }
  return new BufferGeometry().setAttribute("position", new Float32BufferAttribute(numbers, 3));
}

/** Straight walls: lines without a fill. */
function wall(points: number[][], closed: boolean): ReturnType<Form["make"]> {
  const line = points.map(([x, y]) => new Point(x, y));
  if (closed) line.push(line[0]);
  return { fill: null, edges: edgesOf([line]) };
}

/** A strip behind the line, as long as the scene needs. */
function halfPlane([nx, ny]: number[], reach: number): ReturnType<Form["make"]> {
  const length = Math.hypot(nx, ny);
  const [x, y] = [(nx / length) * reach, (ny / length) * reach];
  const outline = [new Point(y, -x), new Point(-y, x), new Point(-y - x, x - y), new Point(y - x, -x - y)];
  const { fill } = filled(outline.reverse());
  return { fill, edges: edgesOf([[new Point(y, -x), new Point(-y, x)]]) };
}

/** Everything outside a circle, as a ring. */
function cavity(radius: number): ReturnType<Form["make"]> {
  const outer = new Shape(arc(0, 0, 1.12 * radius, 0, 2 * Math.PI, 2 * ROUND));
  const inner = arc(0, 0, radius, 0, 2 * Math.PI, 2 * ROUND);
  outer.holes.push(new Path([...inner].reverse()));
  return { fill: new ShapeGeometry(outer), edges: edgesOf([[...inner, inner[0]]]) };
}
