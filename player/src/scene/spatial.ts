/** Shapes of space as surfaces with their edges; what they mean is told in `python/carom/_shapes.py`. */

import {
  BackSide,
  BoxGeometry,
  BufferGeometry,
  CapsuleGeometry,
  ConeGeometry,
  CylinderGeometry,
  EdgesGeometry,
  Float32BufferAttribute,
  PlaneGeometry,
  Quaternion,
  SphereGeometry,
  Vector3,
} from "three";
import { ConvexGeometry } from "three/addons/geometries/ConvexGeometry.js";
import type { ShapeTable } from "../data/payload";
import type { Detail, Form } from "./pieces";
import { ofBall, ofBox, ofCone, ofCylinder, ofPoints, rough, roughBox, swept } from "./rough";

/** Faces that meet at more than this have an edge drawn between them [degrees]. */
const SHARP = 25;

/** The form of a shape of space. */
export function spatialForm(shape: ShapeTable, { reach, round }: Detail): Form {
  const radius = shape.radius as number;
  const height = shape.height as number;
  const points = shape.points as number[][];
  const size = shape.size as [number, number, number];
  switch (shape.type) {
    case "sphere":
      return form("sphere", [radius, radius, radius], () => ball(1, round), rough(ofBall));
    case "box":
      return form("box", size, () => solid(new BoxGeometry(1, 1, 1)), roughBox([1, 1, 1], 0));
    case "cylinder":
      return form(
        "cylinder",
        [radius, radius, height],
        () => solid(upright(new CylinderGeometry(1, 1, 1, round)), true),
        rough(ofCylinder(1, 1)),
      );
    case "cone":
      return form(
        "cone",
        [radius, radius, height],
        () => solid(upright(new ConeGeometry(1, 1, round)), true),
        rough(ofCone(1, 1)),
      );
    case "capsule": {
      const length = shape.length as number;
      return own(shape, () => capsule(radius, length, round), rough(swept(ofBox([0, 0, length]), radius)));
    }
    case "convex_hull":
      return own(shape, () => solid(hullOf(points, 0, round)), rough(ofPoints(points)));
    case "round_convex_hull":
      return own(shape, () => solid(hullOf(points, radius, round)), rough(swept(ofPoints(points), radius)));
    case "round_box":
      return own(shape, () => solid(hullOf(boxCorners(size), radius, round)), roughBox(size, radius));
    case "round_cylinder": {
      const [ends, rounding] = [[height / 2, -height / 2], shape.rounding as number];
      return own(
        shape,
        () =>
          solid(
            hullOf(
              ends.flatMap((z) => circle(radius, z, round)),
              rounding,
              round,
            ),
          ),
        rough(swept(ofCylinder(radius, height), rounding)),
      );
    }
    case "round_cone": {
      const rounding = shape.rounding as number;
      const corners = (): number[][] => [...circle(radius, -height / 2, round), [0, 0, height / 2]];
      return own(
        shape,
        () => solid(hullOf(corners(), rounding, round)),
        rough(swept(ofCone(radius, height), rounding)),
      );
    }
    case "tri_mesh":
      return own(shape, () => mesh(shape.vertices as number[][], (shape.triangles as number[][]).flat()));
    case "height_field":
      return own(shape, () => terrain(shape.heights as number[][], shape.size as unknown as number[]));
    case "half_space":
      return {
        ...own(shape, () => halfSpace(shape.normal as number[], reach)),
        normal: new Vector3(...(shape.normal as number[])).normalize(),
        spacing: spacingOf(reach),
      };
    case "cavity":
      return own(shape, () => cavity(radius, 2 * round));
    default:
      throw new Error(`This page cannot draw the shape ${shape.type} of space.`);
  }
}

function form(key: string, size: Form["size"], make: Form["make"], few?: Form["rough"]): Form {
  return { key: `spatial ${key}`, size, make, ...(few ? { rough: few } : {}) };
}

/** A form that only equal shapes share. */
function own(shape: ShapeTable, make: Form["make"], few?: Form["rough"]): Form {
  return form(JSON.stringify(shape), [1, 1, 1], make, few);
}

/** A surface with its sharp edges; round ones also get a spoke on top, so that turning is seen. */
function solid(fill: BufferGeometry, spoke = false): ReturnType<Form["make"]> {
  const edges = new EdgesGeometry(fill, SHARP);
  if (!spoke) return { fill, edges };
  const more = [0, 0, 0.501, 1, 0, -0.5, 1, 0, -0.5, 1, 0, 0.5, 0, 0, -0.501, 1, 0, -0.5];
  return { fill, edges: withLines(edges, more) };
}

function withLines(edges: BufferGeometry, more: number[]): BufferGeometry {
  const all = [...(edges.getAttribute("position").array as Float32Array), ...more];
  return new BufferGeometry().setAttribute("position", new Float32BufferAttribute(all, 3));
}

/** Three builds along y; carom's shapes stand along z. */
function upright(geometry: BufferGeometry): BufferGeometry {
  return geometry.rotateX(Math.PI / 2);
}

/** A ball with two great circles. */
function ball(radius: number, round: number): ReturnType<Form["make"]> {
  const lines: number[] = [];
  for (let i = 0; i < round; i++) {
    for (const axis of [0, 1]) {
      for (const k of [i, i + 1]) {
        const [c, s] = [Math.cos((2 * Math.PI * k) / round), Math.sin((2 * Math.PI * k) / round)];
        const r = 1.003 * radius;
        lines.push(...(axis === 0 ? [r * c, r * s, 0] : [r * c, 0, r * s]));
      }
    }
  }
  const edges = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(lines, 3));
  return { fill: new SphereGeometry(radius, round, round / 2), edges };
}

function capsule(radius: number, length: number, round: number): ReturnType<Form["make"]> {
  const fill = upright(new CapsuleGeometry(radius, length, Math.ceil(round / 4), round));
  const lines: number[] = [];
  for (let i = 0; i < round; i++)
    for (const z of [-length / 2, length / 2])
      for (const k of [i, i + 1]) {
        const angle = (2 * Math.PI * k) / round;
        lines.push(1.003 * radius * Math.cos(angle), 1.003 * radius * Math.sin(angle), z);
      }
  const r = 1.003 * radius;
  lines.push(r, 0, -length / 2, r, 0, length / 2);
  const edges = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(lines, 3));
  return { fill, edges };
}

function boxCorners([x, y, z]: number[]): number[][] {
  const signs = [-0.5, 0.5];
  return signs.flatMap((i) => signs.flatMap((j) => signs.map((k) => [i * x, j * y, k * z])));
}

function circle(radius: number, z: number, round: number): number[][] {
  return Array.from({ length: round }, (_, i) => {
    const angle = (2 * Math.PI * i) / round;
    return [radius * Math.cos(angle), radius * Math.sin(angle), z];
  });
}

/** Convex hull of points, each swept by a ball of `radius` [m]; with few corners per turn the ball has few too. */
function hullOf(points: number[][], radius: number, round: number): BufferGeometry {
  const centers = points.map(([x, y, z]) => new Vector3(x, y, z));
  if (!(radius > 0)) return new ConvexGeometry(centers);
  const [across, down] = round < 12 ? [6, 4] : [12, 8];
  const sphere = new SphereGeometry(radius, across, down).getAttribute("position");
  const cloud: Vector3[] = [];
  for (const center of centers)
    for (let i = 0; i < sphere.count; i++)
      cloud.push(new Vector3().fromBufferAttribute(sphere, i).add(center));
  return new ConvexGeometry(cloud);
}

function mesh(vertices: number[][], triangles: number[]): ReturnType<Form["make"]> {
  const indexed = new BufferGeometry();
  indexed.setAttribute("position", new Float32BufferAttribute(vertices.flat(), 3));
  indexed.setIndex(triangles);
  const edges = new EdgesGeometry(indexed, SHARP);
  const fill = indexed.toNonIndexed(); // flat faces, as the engine has them
  fill.computeVertexNormals();
  fill.userData.surface = true;
  return { fill, edges };
}

function terrain(heights: number[][], [width, depth]: number[]): ReturnType<Form["make"]> {
  const [rows, columns] = [heights.length, heights[0].length];
  const across = (k: number, n: number): number => k / (n - 1) - 0.5;
  const vertices = heights.flatMap((row, r) =>
    row.map((height, c) => [width * across(c, columns), depth * across(r, rows), height]),
  );
  const triangles: number[] = [];
  for (let r = 0; r + 1 < rows; r++)
    for (let c = 0; c + 1 < columns; c++) {
      const at = r * columns + c;
      triangles.push(at, at + 1, at + columns + 1, at, at + columns + 1, at + columns);
    }
  return mesh(vertices, triangles);
}

/** How far apart the lines of a grid are [m]. */
function spacingOf(reach: number): number {
  return 10 ** Math.floor(Math.log10(reach / 2));
}

/** A square of the bounding plane with a grid, as large as the scene needs. */
function halfSpace(normal: number[], reach: number): ReturnType<Form["make"]> {
  const spacing = spacingOf(reach);
  const half = Math.ceil(reach / spacing) * spacing;
  const lines: number[] = [];
  // mesh by mesh: drawing in software leaves out a line of which one end is behind the camera
  const count = Math.round((2 * half) / spacing);
  for (let line = 0; line <= count; line++)
    for (let part = 0; part < count; part++) {
      const [at, from, to] = [line, part, part + 1].map((k) => k * spacing - half);
      lines.push(at, from, 0, at, to, 0, from, at, 0, to, at, 0);
    }
  const edges = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(lines, 3));
  const fill = new PlaneGeometry(2 * half, 2 * half);
  const [x, y, z] = normal;
  const turn = new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(x, y, z).normalize());
  fill.userData.surface = true;
  return { fill: fill.applyQuaternion(turn), edges: edges.applyQuaternion(turn) };
}

/** The inside of a ball, seen from where the reader stands: only the far wall hides anything. */
function cavity(radius: number, round: number): ReturnType<Form["make"]> {
  const { edges } = ball(radius, round);
  const fill = new SphereGeometry(radius, round, round / 2);
  fill.userData.side = BackSide;
  fill.userData.surface = true;
  return { fill, edges };
}
