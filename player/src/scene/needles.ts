/**
 * Impulses of many contacts as one triangle each that turns its side to the eye, all in one list: where drawing is in
 * software instances cost more, and so does every triangle.
 */

import {
  BufferAttribute,
  BufferGeometry,
  type Color,
  DynamicDrawUsage,
  Mesh,
  type RawShaderMaterial,
  Vector3,
} from "three";
import { unlit } from "./plain";

const SIDE = new Vector3();

/** See the file's head. */
export class Needles {
  readonly mesh: Mesh<BufferGeometry, RawShaderMaterial>;
  private room = 0;
  private positions = new BufferAttribute(new Float32Array(0), 3);
  private colours = new BufferAttribute(new Uint8Array(0), 4, true);

  constructor() {
    this.mesh = new Mesh(new BufferGeometry(), unlit());
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 11;
  }

  /** Makes room for more needles. */
  grow(count: number): void {
    if (count <= this.room) return;
    this.room = 2 ** Math.ceil(Math.log2(count));
    this.positions = new BufferAttribute(new Float32Array(9 * this.room), 3).setUsage(DynamicDrawUsage);
    this.colours = new BufferAttribute(new Uint8Array(12 * this.room), 4, true).setUsage(DynamicDrawUsage);
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry()
      .setAttribute("position", this.positions)
      .setAttribute("color", this.colours);
  }

  /** Puts a needle at a point, along a unit vector, seen from `eye`; length and radius in m. */
  set(
    slot: number,
    at: Vector3,
    along: Vector3,
    length: number,
    radius: number,
    eye: Vector3,
    colour: Color,
  ): void {
    // across both the needle and the way to the eye
    SIDE.subVectors(eye, at).cross(along);
    SIDE.multiplyScalar(radius / (SIDE.length() || 1));
    const into = this.positions.array;
    const to = 9 * slot;
    into[to] = at.x - SIDE.x;
    into[to + 1] = at.y - SIDE.y;
    into[to + 2] = at.z - SIDE.z;
    into[to + 3] = at.x + SIDE.x;
    into[to + 4] = at.y + SIDE.y;
    into[to + 5] = at.z + SIDE.z;
    into[to + 6] = at.x + length * along.x;
    into[to + 7] = at.y + length * along.y;
    into[to + 8] = at.z + length * along.z;
    const hex = colour.getHex();
    const tints = this.colours.array;
    for (let k = 12 * slot; k < 12 * slot + 12; k += 4) {
      tints[k] = hex >> 16;
      tints[k + 1] = (hex >> 8) & 255;
      tints[k + 2] = hex & 255;
    }
  }

  /** Draws the first `count` needles. */
  show(count: number): void {
    this.mesh.geometry.setDrawRange(0, 3 * count);
    for (const values of [this.positions, this.colours]) {
      values.clearUpdateRanges();
      values.addUpdateRange(0, 3 * values.itemSize * count);
      values.needsUpdate = true;
    }
  }
}
