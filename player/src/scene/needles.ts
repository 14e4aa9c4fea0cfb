/** Impulses of many contacts as thin pyramids, all in one list: instances cost more where drawing is in software. */

import {
  BufferAttribute,
  BufferGeometry,
  type Color,
  DynamicDrawUsage,
  type Matrix4,
  Mesh,
  MeshBasicMaterial,
  Vector3,
} from "three";

/** Corners of a needle that is one long and one thick: three around its foot, and its tip. */
const CORNERS = [0, 1, 2]
  .map((i) => new Vector3(Math.sin((2 * Math.PI * i) / 3), 0, Math.cos((2 * Math.PI * i) / 3)))
  .concat(new Vector3(0, 1, 0));
/** Its three sides, seen from outside. */
const SIDES = [0, 1, 3, 1, 2, 3, 2, 0, 3];
const CORNER = new Vector3();

/** See the file's head. */
export class Needles {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  private room = 0;
  private positions = new BufferAttribute(new Float32Array(0), 3);
  private colours = new BufferAttribute(new Float32Array(0), 3);

  constructor() {
    const over = { depthTest: false, depthWrite: false, transparent: true, vertexColors: true };
    this.mesh = new Mesh(new BufferGeometry(), new MeshBasicMaterial(over));
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 11;
  }

  /** Makes room for more needles. */
  grow(count: number): void {
    if (count <= this.room) return;
    this.room = 2 ** Math.ceil(Math.log2(count));
    const corners = (): BufferAttribute =>
      new BufferAttribute(new Float32Array(12 * this.room), 3).setUsage(DynamicDrawUsage);
    this.positions = corners();
    this.colours = corners();
    const sides = new Uint32Array(9 * this.room);
    for (let i = 0; i < sides.length; i++) sides[i] = 4 * Math.floor(i / 9) + SIDES[i % 9];
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry()
      .setAttribute("position", this.positions)
      .setAttribute("color", this.colours)
      .setIndex(new BufferAttribute(sides, 1));
  }

  /** Puts a needle where a matrix places it. */
  set(slot: number, place: Matrix4, colour: Color): void {
    for (let i = 0; i < 4; i++) {
      CORNER.copy(CORNERS[i])
        .applyMatrix4(place)
        .toArray(this.positions.array, 12 * slot + 3 * i);
      colour.toArray(this.colours.array, 12 * slot + 3 * i);
    }
  }

  /** Draws the first `count` needles. */
  show(count: number): void {
    this.mesh.geometry.setDrawRange(0, 9 * count);
    this.positions.needsUpdate = this.colours.needsUpdate = true;
  }
}
