/** The bodies of a replay: equal shapes are drawn together, however many bodies have them. */

import { Color, FrontSide, Group, Matrix4, type Raycaster, Vector3 } from "three";
import type { Replay } from "../data/replay";
import { theme } from "../theme";
import { type Batch, edgeMaterial, fillMaterial, type Member, setOpacity, sideOf } from "./batch";
import type { Extent } from "./extent";
import { Instances } from "./instances";
import { Merged, type Single } from "./merged";
import { type Form, type Piece, piecesOf } from "./pieces";
import { type Around, Unbounded } from "./unbounded";

/** Looks of a replay: as itself, or as the ghost of a run that it is compared with. */
export type Look = "solid" | "ghost";

/** Bounded obstacles of space are glass, for they often are boxes that things lie in [1]. */
const GLASS = 0.3;
/** Of more bodies than this each is drawn with fewer corners. */
export const MANY = 300;
/** Forms of space that fewer pieces share than this are drawn together; beyond it corners would take much memory. */
const FEW = 50_000;
/** How far colours of what sleeps go towards those of obstacles [1]. */
const DIMMED = 0.7;
/** Size of a body without a shape, as a share of the scene's [1]. */
const PARTICLE = 0.006;

/** See the file's head. */
export class Bodies {
  /** What moves, and obstacles. */
  readonly group = new Group();
  readonly obstacles = new Group();
  private readonly batches: Batch[];
  private readonly unbounded = new Map<Batch, Unbounded>();
  /** What unbounded shapes are drawn around, and how large they are made [m]. */
  private readonly around: Around;
  private readonly reach: number;
  private shown = -1;
  /** Who sleeps at the frame shown, as 0 and 1, and at the one coloured last. */
  private asleep: Uint8Array;
  private dimmed: Uint8Array;
  private pointed: { hovered: readonly number[]; chosen: number } = { hovered: [], chosen: -1 };
  private readonly position = new Float64Array(3);
  private readonly quaternion = new Float64Array(4);

  constructor(
    private readonly replay: Replay,
    private readonly look: Look,
    extent: Extent,
  ) {
    this.around = { center: extent.box.getCenter(new Vector3()), scale: 1 };
    this.reach = extent.reach;
    this.asleep = new Uint8Array(replay.bodies);
    this.dimmed = new Uint8Array(replay.bodies);
    this.batches = this.batched(gathered(replay, extent.reach));
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
      const into = batch.matrices;
      let moved = first;
      const { bodies, places } = batch;
      for (let i = 0; i < bodies.length; i++) {
        const body = bodies[i];
        if (!first && this.replay.kind[body] === 1) continue; // obstacles stay
        moved = true;
        this.replay.position(frame, body, this.position);
        this.replay.rotation(frame, body, this.quaternion);
        place(this.position, this.quaternion, places, 12 * i, into, 16 * i);
      }
      if (!moved) continue;
      batch.moved();
      this.unbounded.get(batch)?.place();
    }
    this.replay.sleepers(frame, this.asleep);
    if (this.asleep.some((sleeps, i) => sleeps !== this.dimmed[i])) {
      this.recolour(this.pointed.hovered, this.pointed.chosen);
    }
  }

  /** Has unbounded shapes drawn where the camera looks, as far as it sees [m]. */
  lookAt(target: Vector3, sight: number): void {
    const { center } = this.around;
    const scale = 10 ** Math.max(0, Math.ceil(Math.log10(sight / this.reach)));
    if (scale === this.around.scale && center.distanceTo(target) < (scale * this.reach) / 4) return;
    this.around.scale = scale;
    center.copy(target);
    for (const each of this.unbounded.values()) each.place();
  }

  /** Colours all bodies: some are pointed at, one is chosen. */
  recolour(hovered: readonly number[], chosen: number): void {
    this.pointed = { hovered, chosen };
    this.dimmed.set(this.asleep);
    const colours = theme();
    const [colour, dull] = [new Color(), new Color()];
    for (const batch of this.batches) {
      const ghost = this.look === "ghost" && this.replay.kind[batch.bodies[0]] !== 1;
      batch.edges.material.color.set(ghost ? colours.ghost : colours.edge);
      batch.bodies.forEach((body, i) => {
        const isPointed = hovered.includes(body);
        colour.set(this.colourOf(body, isPointed, body === chosen));
        if (this.asleep[body] && !isPointed && body !== chosen)
          colour.lerp(dull.set(colours.obstacle), DIMMED);
        batch.paint(i, colour);
      });
      batch.painted();
    }
  }

  /** Draws solids with few triangles, or in full. */
  setRough(on: boolean): void {
    for (const batch of this.batches) batch.setRough(on);
  }

  /** Draws the edges of solids, or not. */
  showEdges(on: boolean): void {
    for (const { fill, edges } of this.batches) if (fill) edges.visible = on;
  }

  /** The body that a ray meets first, or -1. */
  pick(ray: Raycaster): number {
    let nearest = Number.POSITIVE_INFINITY;
    let found = -1;
    for (const batch of this.batches) {
      const hit = batch.pick(ray);
      if (!hit || hit.distance >= nearest) continue;
      nearest = hit.distance;
      found = hit.body;
    }
    return found;
  }

  /** Lets contacts behind bodies show through, or not. */
  setTransparent(on: boolean): void {
    for (const each of this.batches.flatMap(({ materials }) => materials))
      setOpacity(each, on ? 0.35 : (each.userData.opacity as number));
  }

  private colourOf(body: number, hovered: boolean, chosen: boolean): number {
    const colours = theme();
    if (chosen) return colours.chosen;
    if (hovered) return colours.hovered;
    if (this.look === "ghost" && this.replay.kind[body] !== 1) return colours.ghost;
    return this.replay.kind[body] === 0 ? colours.bodies[body % colours.bodies.length] : colours.obstacle;
  }

  /** Batches of all forms: of those that many pieces share, one each; of the others, one for all. */
  private batched(found: Map<Form, Member[]>): Batch[] {
    const batches: Batch[] = [];
    const [moving, resting]: Single[][] = [[], []];
    for (const [form, members] of found) {
      const rests = this.rests(members);
      if (form.rough && members.length < FEW)
        (rests ? resting : moving).push(...singlesOf(form, members, rests));
      else batches.push(this.instances(form, members));
    }
    for (const singles of [moving, resting]) if (singles.length) batches.push(this.merged(singles));
    return batches;
  }

  private instances(form: Form, members: Member[]): Batch {
    const geometry = form.make();
    const flat = this.replay.dimension === 2;
    const ghost = this.look === "ghost" && !this.rests(members); // obstacles look as those of the other run
    const { fill } = geometry;
    const glass = !!fill && !flat && !fill.userData.surface && this.rests(members);
    const opacity = ghost ? 0.3 : glass ? GLASS : 1;
    const material = fill && fillMaterial(flat, opacity, sideOf(fill, glass));
    const made = new Instances(geometry, members, material, edgeMaterial(flat, ghost));
    made.edges.renderOrder = flat ? 2 : 0;
    if (made.fill) made.fill.renderOrder = ghost || glass ? 1 : 0;
    const { normal } = form;
    if (normal) this.unbounded.set(made, new Unbounded(made, { ...form, normal }, flat, this.around));
    return made;
  }

  private merged(singles: Single[]): Batch {
    const glass = this.rests(singles);
    const ghost = this.look === "ghost" && !glass;
    const opacity = ghost ? 0.3 : glass ? GLASS : 1;
    const made = new Merged(singles, fillMaterial(false, opacity, FrontSide), edgeMaterial(false, ghost));
    made.fill.renderOrder = ghost || glass ? 1 : 0;
    return made;
  }

  /** Whether all pieces are of obstacles. */
  private rests(members: Member[]): boolean {
    return members.every(({ body }) => this.replay.kind[body] === 1);
  }
}

/** Pieces of a form, which share its geometries; obstacles, which are few and large, are never drawn roughly. */
function singlesOf(form: Form, members: Member[], rests: boolean): Single[] {
  const made = once(form.make);
  const few = rests || !form.rough ? () => made().fill! : once(form.rough);
  return members.map((member) => ({
    ...member,
    fill: () => made().fill!,
    edges: () => made().edges,
    rough: few,
  }));
}

/** Makes something when it is first asked for. */
function once<T>(make: () => T): () => T {
  let made: T | undefined;
  return () => {
    made ??= make();
    return made;
  };
}

/** All pieces of all bodies that are drawn, by form. */
function gathered(replay: Replay, reach: number): Map<Form, Member[]> {
  const d = replay.dimension;
  const detail = { reach, round: replay.bodies > MANY ? 10 : 28 };
  const byShape = replay.table.shapes.map((shape) => piecesOf(shape, replay.table.space, detail));
  const particle = piecesOf(
    { type: d === 2 ? "circle" : "sphere", radius: PARTICLE * reach },
    replay.table.space,
    detail,
  );
  const forms = new Map<string, Form>();
  const found = new Map<Form, Member[]>();
  for (let body = 0; body < replay.bodies; body++) {
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
  position: Float64Array,
  quaternion: Float64Array,
  from: Float64Array,
  at: number,
  into: Float32Array,
  to: number,
): void {
  // by number, for taking a list apart by pattern is slow
  const qx = quaternion[0];
  const qy = quaternion[1];
  const qz = quaternion[2];
  const qw = quaternion[3];
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
    const a = from[at + 3 * c];
    const b = from[at + 3 * c + 1];
    const d = from[at + 3 * c + 2];
    const last = c === 3 ? 1 : 0;
    into[to + 4 * c] = xx * a + xy * b + xz * d + last * position[0];
    into[to + 4 * c + 1] = yx * a + yy * b + yz * d + last * position[1];
    into[to + 4 * c + 2] = zx * a + zy * b + zz * d + last * position[2];
    into[to + 4 * c + 3] = last;
  }
}
