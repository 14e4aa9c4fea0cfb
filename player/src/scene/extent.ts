/** How large a scene is, for the camera's first place, the ground's size and the arrows' length. */

import { Box3, Matrix4, Quaternion, Vector3 } from "three";
import type { ShapeTable } from "../data/payload";
import type { Replay } from "../data/replay";
import { type Pose, poseOf } from "./pieces";

/** What the camera should see first, and sizes that follow from it [m]. */
export interface Extent {
  /** Around what moves. */
  box: Box3;
  /** Half the size of the ground and of other unbounded shapes. */
  reach: number;
  /** Size of a usual body. */
  body: number;
}

/** Frames that are looked at. */
const FRAMES = 24;
/** Of fewer bodies than this all are seen, of more nearly all. */
const FEW = 50;

/** The extent of a run: where bodies that move are most of the time, with those at rest around them. */
export function extentOf(replay: Replay): Extent {
  const sizes = replay.table.shapes.map(sizeOf);
  const moving = rows(replay, (kind) => kind !== 1);
  const bodies = moving.length ? moving : rows(replay, () => true);
  // of what is driven, a belt say, the size tells nothing
  const free = bodies.filter((body) => replay.kind[body] === 0);
  const known = (free.length ? free : bodies)
    .map((body) => sizes[replay.shape[body]] ?? 0)
    .filter((size) => size > 0);
  known.sort((a, b) => a - b);
  const body = known.length ? known[known.length >> 1] : 0;
  const box = new Box3(percentile(replay, bodies, 0.02), percentile(replay, bodies, 0.98));
  box.expandByScalar(Math.max(body / 2, 1e-6));
  const span = box.getSize(new Vector3()).length();
  for (const obstacle of rows(replay, (kind) => kind === 1))
    include(box, replay, obstacle, sizes, 1.25 * span);
  const size = box.getSize(new Vector3()).length() || 1;
  return { box, reach: 2.5 * size, body: body || 0.05 * size };
}

function rows(replay: Replay, wanted: (kind: number) => boolean): number[] {
  return replay.names.map((_, body) => body).filter((body) => wanted(replay.kind[body]));
}

/** The corner below which a share of all positions lies, axis by axis. */
function percentile(replay: Replay, bodies: number[], share: number): Vector3 {
  const corner = new Vector3();
  const position = new Float64Array(3);
  const frames = Math.min(FRAMES, replay.frames);
  for (let axis = 0; axis < replay.dimension; axis++) {
    const values = new Float64Array(frames * bodies.length); // sorts as numbers, and fast
    for (let i = 0; i < frames; i++) {
      const frame = Math.round((i * (replay.frames - 1)) / Math.max(1, frames - 1));
      bodies.forEach((body, k) => {
        replay.position(frame, body, position);
        values[i * bodies.length + k] = position[axis];
      });
    }
    values.sort();
    const few = bodies.length < FEW; // of few bodies all are wanted
    corner.setComponent(
      axis,
      values[Math.round((few ? Math.round(share) : share) * (values.length - 1))] ?? 0,
    );
  }
  return corner;
}

/** Adds an obstacle that is bounded and not much larger than what moves. */
function include(box: Box3, replay: Replay, body: number, sizes: number[], limit: number): void {
  const size = sizes[replay.shape[body]] ?? 0;
  if (!(size > 0 && size < limit)) return;
  const position = new Float64Array(3);
  replay.position(0, body, position);
  const quaternion = new Float64Array(4);
  replay.rotation(0, body, quaternion);
  const d = replay.dimension;
  const center = [0, 1, 2].map((axis) => (axis < d ? replay.center[body * d + axis] : 0));
  const place = new Matrix4()
    .makeRotationFromQuaternion(new Quaternion(...quaternion))
    .setPosition(...(position as unknown as [number, number, number]))
    .multiply(new Matrix4().makeTranslation(-center[0], -center[1], -center[2]));
  box.union(boundsOf(replay.table.shapes[replay.shape[body]]).applyMatrix4(place));
}

/** About the largest extent of a shape [m]; 0 where it has none. */
export function sizeOf(shape: ShapeTable): number {
  const bounds = boundsOf(shape);
  if (bounds.isEmpty()) return 0;
  const { x, y, z } = bounds.getSize(new Vector3());
  return Math.max(x, y, z);
}

/** The bounds of a shape in its own axes [m]; empty where it has none. */
export function boundsOf(shape: ShapeTable): Box3 {
  const number = (name: string): number => (shape[name] as number | undefined) ?? 0;
  const [radius, height] = [number("radius"), number("height")];
  switch (shape.type) {
    case "circle":
    case "cavity":
    case "sphere":
      return around(radius, radius, radius);
    case "capsule": // along x in the plane, along z in space
      return around(number("length") / 2 + radius, radius, number("length") / 2 + radius);
    case "cylinder":
    case "cone":
    case "round_cylinder":
    case "round_cone": {
      const more = number("rounding");
      return around(radius + more, radius + more, height / 2 + more);
    }
    case "box":
    case "round_box": {
      const [x, y, z] = (shape.size as number[]).map((side) => side / 2 + radius);
      return around(x, y, z ?? 0);
    }
    case "height_field":
      return field(shape);
    case "segment":
      return spanned([shape.a as number[], shape.b as number[]], radius);
    case "compound": {
      const all = new Box3();
      for (const part of shape.parts as { pose: Pose; shape: ShapeTable }[])
        all.union(boundsOf(part.shape).applyMatrix4(poseOf(part.pose)));
      return all;
    }
    case "half_plane":
    case "half_space":
      return new Box3();
    default:
      return spanned((shape.points ?? shape.vertices ?? []) as number[][], radius);
  }
}

/** Bounds whose middle is the origin. */
function around(x: number, y: number, z: number): Box3 {
  return new Box3(new Vector3(-x, -y, -z), new Vector3(x, y, z));
}

/** Bounds of points, each with a ball around it. */
function spanned(points: number[][], radius: number): Box3 {
  const all = new Box3().setFromPoints(points.map(([x, y, z]) => new Vector3(x, y, z ?? 0)));
  return all.isEmpty() ? all : all.expandByScalar(radius);
}

/** Bounds of heights over a line or a rectangle. */
function field(shape: ShapeTable): Box3 {
  const heights = (shape.heights as (number | number[])[]).flat();
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (const height of heights) {
    low = Math.min(low, height);
    high = Math.max(high, height);
  }
  if (typeof shape.width === "number")
    return spanned(
      [
        [-shape.width / 2, low],
        [shape.width / 2, high],
      ],
      0,
    );
  const [width, depth] = shape.size as number[];
  return spanned(
    [
      [-width / 2, -depth / 2, low],
      [width / 2, depth / 2, high],
    ],
    0,
  );
}
