/** What is drawn together: pieces of bodies in one fill and one set of edges; and what they are drawn with. */

import {
  type BufferGeometry,
  type Color,
  DoubleSide,
  FrontSide,
  LineBasicMaterial,
  type Material,
  type Matrix4,
  MeshBasicMaterial,
  MeshLambertMaterial,
  type Object3D,
  type Raycaster,
  type Side,
} from "three";

/** A piece of a body that a batch draws, and where it sits in its body. */
export interface Member {
  body: number;
  place: Matrix4;
}

/** Where a ray meets a batch. */
export interface Hit {
  body: number;
  distance: number;
}

/** Pieces that are drawn together. */
export interface Batch {
  readonly fill: (Object3D & { material: Material }) | null;
  readonly edges: Object3D & { material: LineBasicMaterial };
  /** What surfaces are drawn with, one at a time. */
  readonly materials: readonly Material[];
  /** Body of each piece. */
  readonly bodies: number[];
  /** Where each piece sits in its body, as columns of 3 × 4 numbers. */
  readonly places: Float64Array;
  /** Where each piece is drawn, as 4 × 4 matrices column by column. */
  readonly matrices: Float32Array;
  /** Tells that `matrices` have changed. */
  moved(): void;
  /** Colours a piece; `painted` must follow. */
  paint(piece: number, colour: Color): void;
  /** Tells that pieces were coloured. */
  painted(): void;
  /** Draws with few triangles, where there are such, or in full. */
  setRough(on: boolean): void;
  /** The piece's body that a ray meets first. */
  pick(ray: Raycaster): Hit | undefined;
}

/** Places of pieces as a batch keeps them. */
export function placesOf(members: Member[]): Float64Array {
  const places = new Float64Array(12 * members.length);
  members.forEach(({ place: { elements } }, i) => {
    for (let c = 0; c < 4; c++) for (let r = 0; r < 3; r++) places[12 * i + 3 * c + r] = elements[4 * c + r];
  });
  return places;
}

/** What surfaces are drawn with. */
export function fillMaterial(flat: boolean, opacity: number, side: Side): Material {
  const offset = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
  const made = flat
    ? new MeshBasicMaterial({ side: DoubleSide, depthTest: false })
    : new MeshLambertMaterial({ ...offset, side });
  made.userData.opacity = opacity;
  setOpacity(made, opacity);
  return made;
}

/** What edges are drawn with. */
export function edgeMaterial(flat: boolean, ghost: boolean): LineBasicMaterial {
  return new LineBasicMaterial({
    depthTest: !flat,
    transparent: true,
    opacity: ghost ? 0.9 : flat ? 0.8 : 0.5,
  });
}

/** Surfaces are seen from both sides, solids from outside. */
export function sideOf(fill: BufferGeometry, glass: boolean): Side {
  if (fill.userData.side !== undefined) return fill.userData.side as Side;
  return fill.userData.surface && !glass ? DoubleSide : FrontSide;
}

/** Makes a material see-through, or not. */
export function setOpacity(material: Material, opacity: number): void {
  material.transparent = opacity < 1;
  material.opacity = opacity;
  material.depthWrite = opacity === 1;
  material.needsUpdate = true;
}
