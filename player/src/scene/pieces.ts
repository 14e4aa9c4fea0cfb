/** Pieces of a body for drawing: a geometry that equal bodies share, and where the piece sits in the body. */

import { type BufferGeometry, Matrix4, Quaternion, Vector3 } from "three";
import type { ShapeTable } from "../data/payload";
import { planarForm } from "./planar";
import { spatialForm } from "./spatial";

/** A geometry that many pieces share; `size` scales it to a piece. */
export interface Form {
  /** Pieces with the same key share one geometry. */
  key: string;
  size: [number, number, number];
  /** Fill and edges, made once per key. */
  make(): { fill: BufferGeometry | null; edges: BufferGeometry };
  /** Unbounded shapes only: the normal of the plane that bounds them, in the shape's axes. */
  normal?: Vector3;
  /** Unbounded shapes only: how far apart the lines of what is drawn are, 0 where there are none [m]. */
  spacing?: number;
  /** Convex solids only: a fill of few triangles, in the size of the other. */
  rough?: () => BufferGeometry;
}

/** How shapes are drawn. */
export interface Detail {
  /** How far unbounded shapes are drawn [m]. */
  reach: number;
  /** Corners of a full turn. */
  round: number;
}

/** A form at its place in the shape's frame. */
export interface Piece {
  form: Form;
  place: Matrix4;
}

/** The pieces of a shape. */
export function piecesOf(shape: ShapeTable, space: "planar" | "spatial", detail: Detail): Piece[] {
  if (shape.type !== "compound") {
    const form = space === "planar" ? planarForm(shape, detail.reach) : spatialForm(shape, detail);
    return [{ form, place: new Matrix4().makeScale(...form.size) }];
  }
  const parts = shape.parts as { pose: Pose; shape: ShapeTable }[];
  return parts.flatMap((part) => {
    const pose = poseOf(part.pose);
    return piecesOf(part.shape, space, detail).map(({ form, place }) => ({
      form,
      place: pose.clone().multiply(place),
    }));
  });
}

/** Where a part sits in its shape, as scene files have it. */
export interface Pose {
  position: number[];
  rotation: number[];
}

/** A part's pose as a matrix. */
export function poseOf({ position, rotation }: Pose): Matrix4 {
  const turn = new Quaternion();
  if (rotation.length === 2)
    turn.setFromAxisAngle(new Vector3(0, 0, 1), Math.atan2(rotation[1], rotation[0]));
  else turn.set(rotation[1], rotation[2], rotation[3], rotation[0]);
  return new Matrix4().compose(
    new Vector3(position[0], position[1], position[2] ?? 0),
    turn,
    new Vector3(1, 1, 1),
  );
}
