/**
 * Where the drawn part of an unbounded shape stands: under the scene, wherever the body itself is. A part with a grid
 * moves by whole meshes of it, so that the grid seems to stay with the body.
 */

import { Quaternion, Vector3 } from "three";
import type { Batch } from "./batch";
import type { Form } from "./pieces";

const Z = new Vector3(0, 0, 1);

/** What unbounded shapes are drawn around. */
export interface Around {
  center: Vector3;
  /** How many times as large as they are made, a power of ten [1]. */
  scale: number;
}

/** See the file's head. */
export class Unbounded {
  /** Directions along the bounding plane, in the shape's axes. */
  private readonly along: Vector3[];

  constructor(
    private readonly batch: Batch,
    private readonly form: Form & { normal: Vector3 },
    flat: boolean,
    private readonly around: Around,
  ) {
    const { normal } = form;
    const turn = new Quaternion().setFromUnitVectors(Z, normal);
    this.along = flat
      ? [new Vector3(normal.y, -normal.x, 0)]
      : [new Vector3(1, 0, 0).applyQuaternion(turn), new Vector3(0, 1, 0).applyQuaternion(turn)];
  }

  /** Moves what is drawn of all pieces along their planes to where the center is now. */
  place(): void {
    const { matrices, bodies } = this.batch;
    const { center, scale } = this.around;
    const spacing = scale * (this.form.spacing ?? 0);
    for (let piece = 0; piece < bodies.length; piece++) {
      const at = 16 * piece;
      const now = Math.hypot(matrices[at], matrices[at + 1], matrices[at + 2]);
      for (let k = 0; k < 11; k++) if (k % 4 < 3) matrices[at + k] *= scale / now;
      const offset = new Vector3(matrices[at + 12], matrices[at + 13], matrices[at + 14]);
      offset.subVectors(center, offset);
      for (const direction of this.along) {
        const world = turned(direction, matrices, at).normalize();
        const far = offset.dot(world);
        const by = spacing > 0 ? spacing * Math.round(far / spacing) : far;
        for (let axis = 0; axis < 3; axis++) matrices[at + 12 + axis] += by * world.getComponent(axis);
      }
    }
    this.batch.moved();
  }
}

/** A direction turned by a 4 × 4 matrix that stands in a list. */
function turned({ x, y, z }: Vector3, matrices: Float32Array, at: number): Vector3 {
  const row = (r: number): number =>
    matrices[at + r] * x + matrices[at + 4 + r] * y + matrices[at + 8 + r] * z;
  return new Vector3(row(0), row(1), row(2));
}
