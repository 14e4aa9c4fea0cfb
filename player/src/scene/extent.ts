/** How large a scene is, for the camera's first place, the ground's size and the arrows' length. */

import { Box3, Matrix4, Quaternion, Vector3 } from "three";
import type { ShapeTable } from "../data/payload";
import type { Replay } from "../data/replay";

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

/** The extent of a run: where bodies that move are most of the time, with those at rest around them. */
export function extentOf(replay: Replay): Extent {
  const sizes = replay.table.shapes.map(sizeOf);
  const moving = rows(replay, (kind) => kind !== 1);
  const bodies = moving.length ? moving : rows(replay, () => true);
  const known = bodies.map((body) => sizes[replay.shape[body]] ?? 0).filter((size) => size > 0);
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
    const few = values.length < 50 * FRAMES; // of few bodies all are wanted
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
  const shape = replay.table.shapes[replay.shape[body]];
  const sides = shape.type === "box" ? (shape.size as number[]) : [size, size, size];
  const quaternion = new Float64Array(4);
  replay.rotation(0, body, quaternion);
  const half = new Vector3(sides[0], sides[1], replay.dimension === 2 ? 0 : sides[2]).multiplyScalar(0.5);
  const turn = new Matrix4().makeRotationFromQuaternion(new Quaternion(...quaternion));
  const around = new Box3(half.clone().negate(), half).applyMatrix4(turn);
  box.union(around.translate(new Vector3(...position)));
}

/** About the largest extent of a shape [m]; 0 where it has none. */
export function sizeOf(shape: ShapeTable): number {
  const number = (name: string): number => (shape[name] as number | undefined) ?? 0;
  switch (shape.type) {
    case "circle":
    case "sphere":
    case "cavity":
      return 2 * number("radius");
    case "capsule":
      return number("length") + 2 * number("radius");
    case "cylinder":
    case "cone":
      return Math.max(number("height"), 2 * number("radius"));
    case "round_cylinder":
    case "round_cone":
      return Math.max(number("height"), 2 * number("radius")) + 2 * number("rounding");
    case "box":
    case "round_box":
      return Math.max(...(shape.size as number[])) + 2 * number("radius");
    case "height_field":
      return Math.max(number("width"), ...((shape.size as number[] | undefined) ?? [0]));
    case "segment":
      return span([shape.a as number[], shape.b as number[]]);
    case "compound": {
      const parts = shape.parts as { pose: { position: number[] }; shape: ShapeTable }[];
      return Math.max(...parts.map((part) => 2 * Math.hypot(...part.pose.position) + sizeOf(part.shape)));
    }
    case "half_plane":
    case "half_space":
      return 0;
    default:
      return span((shape.points ?? shape.vertices ?? []) as number[][]) + 2 * number("radius");
  }
}

/** Largest extent of points along an axis [m]. */
function span(points: number[][]): number {
  let largest = 0;
  for (let axis = 0; axis < (points[0]?.length ?? 0); axis++) {
    let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
    for (const point of points) {
      low = Math.min(low, point[axis]);
      high = Math.max(high, point[axis]);
    }
    largest = Math.max(largest, high - low);
  }
  return largest;
}
