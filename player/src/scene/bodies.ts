/** The bodies of a replay: equal shapes are drawn together, however many bodies have them. */

import {
  type BufferGeometry,
  Color,
  DoubleSide,
  DynamicDrawUsage,
  FrontSide,
  Group,
  InstancedMesh,
  LineBasicMaterial,
  type Material,
  Matrix4,
  MeshBasicMaterial,
  MeshLambertMaterial,
  type Raycaster,
  type Side,
} from "three";
import type { Replay } from "../data/replay";
import { theme } from "../theme";
import { type Form, type Piece, piecesOf } from "./pieces";

/** Looks of a replay: as itself, or as the ghost of a run that it is compared with. */
export type Look = "solid" | "ghost";

/** Instances that share a geometry: pieces of bodies, fill and edges. */
interface Batch {
  fill: InstancedMesh | null;
  edges: InstancedMesh;
  /** Body of each instance. */
  bodies: number[];
  /** Where each piece sits in its body, as columns of 3 × 4 numbers. */
  places: Float64Array;
}

/** Bounded obstacles of space are glass, for they often are boxes that things lie in [1]. */
const GLASS = 0.3;
/** Of more bodies than this each is drawn with fewer corners. */
export const MANY = 300;
/** Size of a body without a shape, as a share of the scene's [1]. */
const PARTICLE = 0.006;

/** See the file's head. */
export class Bodies {
  /** What moves, and obstacles. */
  readonly group = new Group();
  readonly obstacles = new Group();
  private readonly batches: Batch[] = [];
  private shown = -1;
  private readonly position = new Float64Array(3);
  private readonly quaternion = new Float64Array(4);

  constructor(
    private readonly replay: Replay,
    private readonly look: Look,
    reach: number,
  ) {
    // a ghost has no obstacles: they are where those of the other run are
    const drawn = (body: number): boolean => look === "solid" || replay.kind[body] !== 1;
    for (const [form, members] of gathered(replay, reach, drawn))
      this.batches.push(this.batch(form, members));
    for (const { fill, edges, bodies } of this.batches) {
      const group = replay.kind[bodies[0]] === 1 ? this.obstacles : this.group;
      if (fill) group.add(fill);
      group.add(edges);
    }
    this.recolour([], -1);
  }

  /** Puts all bodies where they are at a frame. */
  show(frame: number): void {
    if (frame === this.shown) return;
    const first = this.shown < 0;
    this.shown = frame;
    for (const batch of this.batches) {
      const into = batch.edges.instanceMatrix.array as Float32Array;
      let moved = first;
      batch.bodies.forEach((body, i) => {
        if (!first && this.replay.kind[body] === 1) return; // obstacles stay
        moved = true;
        this.replay.position(frame, body, this.position);
        this.replay.rotation(frame, body, this.quaternion);
        place(this.position, this.quaternion, batch.places, 12 * i, into, 16 * i);
      });
      if (!moved) continue;
      batch.edges.instanceMatrix.needsUpdate = true;
      if (batch.fill) batch.fill.boundingSphere = null; // of all instances, for pointing at them
    }
  }

  /** Colours all bodies: some are pointed at, one is chosen. */
  recolour(hovered: readonly number[], chosen: number): void {
    const colours = theme();
    const colour = new Color();
    for (const { fill, bodies, edges } of this.batches) {
      (edges.material as LineBasicMaterial).color.set(this.look === "ghost" ? colours.ghost : colours.edge);
      if (!fill) continue;
      bodies.forEach((body, i) => {
        fill.setColorAt(i, colour.set(this.colourOf(body, hovered.includes(body), body === chosen)));
      });
      if (fill.instanceColor) fill.instanceColor.needsUpdate = true;
    }
  }

  /** Draws the edges of solids, or not. */
  showEdges(on: boolean): void {
    for (const { fill, edges } of this.batches) if (fill) edges.visible = on;
  }

  /** The body that a ray meets first, or -1. */
  pick(ray: Raycaster): number {
    let nearest = Number.POSITIVE_INFINITY;
    let found = -1;
    for (const { fill, bodies } of this.batches) {
      if (!fill) continue;
      const [hit] = ray.intersectObject(fill, false);
      if (hit?.instanceId === undefined || hit.distance >= nearest) continue;
      nearest = hit.distance;
      found = bodies[hit.instanceId];
    }
    return found;
  }

  /** Lets contacts behind bodies show through, or not. */
  setTransparent(on: boolean): void {
    for (const { fill } of this.batches) {
      const material = fill?.material as Material | undefined;
      if (!material) continue;
      setOpacity(material, on ? 0.35 : (material.userData.opacity as number));
    }
  }

  private colourOf(body: number, hovered: boolean, chosen: boolean): number {
    const colours = theme();
    if (chosen) return colours.chosen;
    if (hovered) return colours.hovered;
    if (this.look === "ghost") return colours.ghost;
    return this.replay.kind[body] === 0 ? colours.bodies[body % colours.bodies.length] : colours.obstacle;
  }

  private batch(form: Form, members: { body: number; place: Matrix4 }[]): Batch {
    const { fill, edges } = form.make();
    const count = members.length;
    const flat = this.replay.dimension === 2;
    const ghost = this.look === "ghost";
    const lines = new InstancedLines(edges, edgeMaterial(flat, ghost), count);
    lines.instanceMatrix.setUsage(DynamicDrawUsage);
    lines.renderOrder = flat ? 2 : 0;
    lines.frustumCulled = false;
    const places = new Float64Array(12 * count);
    members.forEach(({ place }, i) => {
      const columns = place.elements;
      for (let c = 0; c < 4; c++) for (let r = 0; r < 3; r++) places[12 * i + 3 * c + r] = columns[4 * c + r];
    });
    const made: Batch = { fill: null, edges: lines, bodies: members.map(({ body }) => body), places };
    if (fill) {
      const glass =
        !flat && !fill.userData.surface && members.every(({ body }) => this.replay.kind[body] === 1);
      const opacity = ghost ? 0.3 : glass ? GLASS : 1;
      const mesh = new InstancedMesh(fill, fillMaterial(flat, opacity, sideOf(fill, glass)), count);
      mesh.instanceMatrix = lines.instanceMatrix;
      mesh.frustumCulled = false;
      mesh.renderOrder = ghost || glass ? 1 : 0;
      made.fill = mesh;
    }
    return made;
  }
}

/**
 * Lines drawn once per instance. Three has instances of meshes only; the renderer asks an object what it is,
 * and takes its instances whatever that is.
 */
class InstancedLines extends InstancedMesh<BufferGeometry, LineBasicMaterial> {
  constructor(geometry: BufferGeometry, material: LineBasicMaterial, count: number) {
    super(geometry, material, count);
    Object.assign(this, { isMesh: false, isLine: true, isLineSegments: true });
  }
}

function fillMaterial(flat: boolean, opacity: number, side: Side): Material {
  const offset = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
  const made = flat
    ? new MeshBasicMaterial({ side: DoubleSide, depthTest: false })
    : new MeshLambertMaterial({ ...offset, side });
  made.userData.opacity = opacity;
  setOpacity(made, opacity);
  return made;
}

/** Surfaces are seen from both sides, solids from outside. */
function sideOf(fill: BufferGeometry, glass: boolean): Side {
  if (fill.userData.side !== undefined) return fill.userData.side as Side;
  return fill.userData.surface && !glass ? DoubleSide : FrontSide;
}

function setOpacity(material: Material, opacity: number): void {
  material.transparent = opacity < 1;
  material.opacity = opacity;
  material.depthWrite = opacity === 1;
  material.needsUpdate = true;
}

function edgeMaterial(flat: boolean, ghost: boolean): LineBasicMaterial {
  return new LineBasicMaterial({
    depthTest: !flat,
    transparent: true,
    opacity: ghost ? 0.9 : flat ? 0.8 : 0.5,
  });
}

/** All pieces of all bodies that are drawn, by form. */
function gathered(
  replay: Replay,
  reach: number,
  drawn: (body: number) => boolean,
): Map<Form, { body: number; place: Matrix4 }[]> {
  const d = replay.dimension;
  const detail = { reach, round: replay.bodies > MANY ? 10 : 28 };
  const byShape = replay.table.shapes.map((shape) => piecesOf(shape, replay.table.space, detail));
  const particle = piecesOf(
    { type: d === 2 ? "circle" : "sphere", radius: PARTICLE * reach },
    replay.table.space,
    detail,
  );
  const forms = new Map<string, Form>();
  const found = new Map<Form, { body: number; place: Matrix4 }[]>();
  for (let body = 0; body < replay.bodies; body++) {
    if (!drawn(body)) continue;
    const pieces: Piece[] = replay.shape[body] < 0 ? particle : byShape[replay.shape[body]];
    const center = [0, 1, 2].map((axis) => (axis < d ? replay.center[body * d + axis] : 0));
    for (const { form, place } of pieces) {
      const key = `${replay.kind[body] === 1} ${form.key}`; // obstacles are drawn apart from what moves
      const known = forms.get(key) ?? { ...form };
      forms.set(key, known);
      const moved = new Matrix4().makeTranslation(-center[0], -center[1], -center[2]).multiply(place);
      const members = found.get(known);
      if (members) members.push({ body, place: moved });
      else found.set(known, [{ body, place: moved }]);
    }
  }
  return found;
}

/** Writes pose × place as a 4 × 4 matrix, column by column. */
function place(
  [x, y, z]: Float64Array,
  [qx, qy, qz, qw]: Float64Array,
  from: Float64Array,
  at: number,
  into: Float32Array,
  to: number,
): void {
  const xx = 1 - 2 * (qy * qy + qz * qz);
  const xy = 2 * (qx * qy - qw * qz);
  const xz = 2 * (qx * qz + qw * qy);
  const yx = 2 * (qx * qy + qw * qz);
  const yy = 1 - 2 * (qx * qx + qz * qz);
  const yz = 2 * (qy * qz - qw * qx);
  const zx = 2 * (qx * qz - qw * qy);
  const zy = 2 * (qy * qz + qw * qx);
  const zz = 1 - 2 * (qx * qx + qy * qy);
  for (let c = 0; c < 4; c++) {
    const [a, b, d] = [from[at + 3 * c], from[at + 3 * c + 1], from[at + 3 * c + 2]];
    const last = c === 3 ? 1 : 0;
    into[to + 4 * c] = xx * a + xy * b + xz * d + last * x;
    into[to + 4 * c + 1] = yx * a + yy * b + yz * d + last * y;
    into[to + 4 * c + 2] = zx * a + zy * b + zz * d + last * z;
    into[to + 4 * c + 3] = last;
  }
}
