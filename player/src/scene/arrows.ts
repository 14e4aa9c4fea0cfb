/**
 * Contacts: a point, a tick along the normal, and the impulse on the body that it lifts as an arrow. They are drawn
 * over the bodies, so that nothing buries them. Knows no page.
 */

import {
  BufferGeometry,
  Color,
  ConeGeometry,
  CylinderGeometry,
  DynamicDrawUsage,
  Float32BufferAttribute,
  Group,
  IcosahedronGeometry,
  InstancedMesh,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  MeshBasicMaterial,
  Quaternion,
  type Raycaster,
  Vector3,
} from "three";
import { islandsOf } from "../coupling";
import type { Contacts } from "../data/contacts";
import type { Replay } from "../data/replay";
import { theme } from "../theme";
import { Needles } from "./needles";

/** What the colour of a contact tells. */
/** Digits above the tolerance at which the colour of residuals ends. */
const FAR = 4;

export type ColourOf = "status" | "island" | "residual";

/** What is drawn of contacts. */
export interface ArrowSettings {
  points: boolean;
  normals: boolean;
  impulses: boolean;
  colour: ColourOf;
  /** Length of an arrow against the usual one [1]. */
  length: number;
}

/** Arrows are at most this many times as long as the usual impulse's [1]. */
const LONGEST = 3;
/** Of more contacts than this points and normals are drawn on demand, impulses as needles, and those that do nothing not at all. */
const MANY = 300;
const UP = new Vector3(0, 1, 0);

/** See the file's head. */
export class Arrows {
  readonly group = new Group();
  settings: ArrowSettings = { points: true, normals: true, impulses: true, colour: "status", length: 1 };
  contacts: Contacts | undefined;
  private points: InstancedMesh;
  private shafts: InstancedMesh;
  private heads: InstancedMesh;
  private readonly ticks: LineSegments<BufferGeometry, LineBasicMaterial>;
  private room = 256;
  /** Whether impulses are needles, which cost a tenth of arrows. */
  private readonly needles: Needles | undefined;
  /** Needles shorter than this are not drawn [m]. */
  shortest = 0;
  /** Where needles are seen from [m]; in the plane far above it. */
  readonly eye = new Vector3(0, 0, 1e6);
  /** Whether points stand where the contacts shown are. */
  private placed = false;
  private lit: readonly number[] = [];
  /** Contacts that are drawn, in order. */
  private readonly drawn: number[] = [];

  constructor(
    private readonly replay: Replay,
    /** Length of the usual arrow [m]. */
    private readonly unit: number,
    /** The impulse that it stands for [N s]. */
    private readonly usual: () => number,
  ) {
    const most = Math.max(
      ...[0, replay.frames >> 1, replay.frames - 1].map((at) => replay.contacts(at).count),
    );
    const many = most > MANY;
    this.needles = many ? new Needles() : undefined;
    this.settings.normals = this.settings.points = !many;
    this.points = instances(new IcosahedronGeometry(1, many ? 0 : 2), this.room);
    this.shafts = instances(new CylinderGeometry(1, 1, 1, 8, 1, true).translate(0, 0.5, 0), this.room);
    this.heads = instances(new ConeGeometry(1, 1, 12).translate(0, 0.5, 0), this.room);
    const over = { depthTest: false, depthWrite: false, transparent: true };
    this.ticks = new LineSegments(new BufferGeometry(), new LineBasicMaterial(over));
    this.ticks.frustumCulled = false;
    this.ticks.renderOrder = 10;
    this.group.add(this.points, this.shafts, this.heads, this.ticks);
    if (this.needles) this.group.add(this.needles.mesh);
  }

  /** Draws the contacts of a frame; `hovered` are pointed at, `worst` the bodies of the worst contact. */
  show(frame: number, hovered: readonly number[], worst: readonly number[]): void {
    const contacts = this.replay.contacts(frame);
    this.contacts = contacts;
    this.grow(contacts.count);
    const colours = this.coloursOf(contacts, worst);
    const light = new Color(theme().chosen);
    const ticks: number[] = [];
    this.drawn.length = 0;
    this.lit = hovered;
    let needles = 0;
    for (let i = 0; i < contacts.count; i++) {
      const lit = hovered.includes(i);
      if (contacts.status[i] === 0 && contacts.count > MANY && !lit) continue;
      const colour = lit ? light : colours(i);
      if (this.needles) needles = this.needle(contacts, i, needles, colour, lit);
      else this.arrow(contacts, i, this.drawn.length, colour);
      if (this.settings.points) this.points.setColorAt(this.drawn.length, colour);
      if (this.settings.normals) this.tick(contacts, i, ticks);
      this.drawn.push(i);
    }
    this.placed = false;
    if (this.settings.points) this.placePoints();
    this.points.visible = this.settings.points;
    for (const mesh of [this.shafts, this.heads]) {
      mesh.visible = this.settings.impulses && !this.needles;
      if (mesh.visible) upload(mesh, this.drawn.length);
    }
    if (this.needles) {
      this.needles.show(needles);
      this.needles.mesh.visible = this.settings.impulses;
    }
    this.ticks.visible = this.settings.normals && ticks.length > 0;
    if (this.settings.normals)
      this.ticks.geometry.setAttribute("position", new Float32BufferAttribute(ticks, 3));
    this.ticks.material.color.set(theme().edge);
    if (theme().dark) this.ticks.material.color.set(0xe8ecef);
  }

  /** The contact whose point a ray meets first, or -1; points are met whether they are drawn or not. */
  pick(ray: Raycaster): number {
    this.placePoints();
    if (this.points.count === 0) return -1;
    const [hit] = ray.intersectObject(this.points, false);
    return hit?.instanceId === undefined ? -1 : this.drawn[hit.instanceId];
  }

  /** Puts points where contacts are, unless they are there already. */
  private placePoints(): void {
    const { contacts } = this;
    if (this.placed || !contacts) return;
    this.placed = true;
    this.drawn.forEach((i, slot) => {
      const lit = this.lit.includes(i);
      const thick = this.unit * (lit ? 0.06 : 0.032);
      const size = contacts.status[i] === 0 && !lit ? 0.45 * thick : thick;
      this.read(contacts.point, i, POINT);
      this.points.setMatrixAt(slot, MATRIX.compose(POINT, STILL, SIZE.setScalar(size)));
    });
    upload(this.points, this.drawn.length);
    this.points.boundingSphere = null;
  }

  /** Colour of each contact. */
  private coloursOf(contacts: Contacts, worst: readonly number[]): (contact: number) => Color {
    const { status, lines } = theme();
    if (this.settings.colour === "status") {
      const known = status.map((colour) => new Color(colour));
      return (i) => known[contacts.status[i]];
    }
    if (this.settings.colour === "residual") {
      const [unknown, within, above, bad] = status.map((colour) => new Color(colour));
      const { tolerance } = this.replay;
      return (i) => {
        const residual = contacts.residual[i];
        if (Number.isNaN(residual)) {
          return worst.includes(contacts.a[i]) && worst.includes(contacts.b[i]) ? bad : unknown;
        }
        if (residual <= tolerance) return within;
        return above.clone().lerp(bad, Math.min(1, Math.log10(residual / tolerance) / FAR));
      };
    }
    const islands = islandsOf(this.replay, contacts);
    const known = lines.slice(1).map((colour) => new Color(colour));
    return (i) => known[islands[i] % known.length];
  }

  /** The impulse of a contact on the body that it is drawn for, as a unit vector in IMPULSE; its length drawn [m]. */
  private impulse(contacts: Contacts, i: number): number {
    this.read(contacts.normal, i, NORMAL);
    this.read(contacts.frictionImpulse, i, IMPULSE).addScaledVector(NORMAL, contacts.normalImpulse[i]);
    IMPULSE.multiplyScalar(this.sideOf(contacts, i, IMPULSE));
    const size = IMPULSE.length();
    const length = Math.min(size / (this.usual() || 1), LONGEST) * this.unit * this.settings.length;
    if (length > 1e-4 * this.unit) IMPULSE.multiplyScalar(1 / size);
    else IMPULSE.copy(UP);
    return length;
  }

  /** Draws a contact's impulse as a needle, unless it is too short; how many there are then. */
  private needle(contacts: Contacts, i: number, slot: number, colour: Color, lit: boolean): number {
    const length = this.impulse(contacts, i);
    if (length < this.shortest && !lit) return slot;
    this.read(contacts.point, i, POINT);
    this.needles!.set(
      slot,
      POINT,
      IMPULSE,
      length,
      Math.min(0.05 * this.unit, 0.1 * length),
      this.eye,
      colour,
    );
    return slot + 1;
  }

  /** Draws a contact's impulse as an arrow. */
  private arrow(contacts: Contacts, i: number, slot: number, colour: Color): void {
    const length = this.impulse(contacts, i);
    this.read(contacts.point, i, POINT);
    TURN.setFromUnitVectors(UP, IMPULSE);
    const head = Math.min(0.35 * length, 0.22 * this.unit);
    const radius = Math.min(0.018 * this.unit, 0.1 * length);
    this.shafts.setMatrixAt(slot, MATRIX.compose(POINT, TURN, SIZE.set(radius, length - head, radius)));
    TIP.copy(POINT).addScaledVector(IMPULSE, length - head);
    this.heads.setMatrixAt(slot, MATRIX.compose(TIP, TURN, SIZE.set(0.3 * head, head, 0.3 * head)));
    for (const mesh of [this.shafts, this.heads]) mesh.setColorAt(slot, colour);
  }

  /** Draws the normal of a contact at which something acts. */
  private tick(contacts: Contacts, i: number, ticks: number[]): void {
    if (contacts.status[i] === 0) return;
    const { x, y, z } = this.read(contacts.point, i, POINT);
    TIP.copy(POINT).addScaledVector(this.read(contacts.normal, i, NORMAL), 0.16 * this.unit);
    ticks.push(x, y, z, TIP.x, TIP.y, TIP.z);
  }

  private read(values: Float32Array, i: number, into: Vector3): Vector3 {
    const d = this.replay.dimension;
    return into.set(values[i * d], values[i * d + 1], d === 3 ? values[i * d + 2] : 0);
  }

  /** 1 where the impulse on a is drawn, −1 for that on b: on the body that moves, of two on the one it lifts. */
  private sideOf(contacts: Contacts, i: number, onA: Vector3): 1 | -1 {
    const { inverseMass } = this.replay;
    if (!(inverseMass[contacts.a[i]] > 0)) return -1;
    if (!(inverseMass[contacts.b[i]] > 0)) return 1;
    const gravity = this.replay.table.gravity;
    const sinks = gravity[0] * onA.x + (gravity[1] ?? 0) * onA.y + (gravity[2] ?? 0) * onA.z;
    return sinks > 0 ? -1 : 1;
  }

  /** Makes room for more contacts. */
  private grow(count: number): void {
    this.needles?.grow(count);
    if (count <= this.room) return;
    while (this.room < count) this.room *= 2;
    this.points = this.regrown(this.points);
    this.shafts = this.regrown(this.shafts);
    this.heads = this.regrown(this.heads);
  }

  private regrown(mesh: InstancedMesh): InstancedMesh {
    this.group.remove(mesh);
    mesh.dispose();
    const larger = instances(mesh.geometry, this.room);
    this.group.add(larger);
    return larger;
  }
}

const POINT = new Vector3();
const NORMAL = new Vector3();
const IMPULSE = new Vector3();
const TIP = new Vector3();
const SIZE = new Vector3();
const MATRIX = new Matrix4();
const TURN = new Quaternion();
const STILL = new Quaternion();

/** Draws the first `count` instances where they were put. */
function upload(mesh: InstancedMesh, count: number): void {
  mesh.count = count;
  mesh.instanceMatrix.clearUpdateRanges();
  mesh.instanceMatrix.addUpdateRange(0, 16 * count);
  mesh.instanceMatrix.needsUpdate = true;
  if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
}

/** Instances that are drawn over everything else. */
function instances(geometry: BufferGeometry, room: number): InstancedMesh {
  const material = new MeshBasicMaterial({ depthTest: false, depthWrite: false, transparent: true });
  const made = new InstancedMesh(geometry, material, room);
  made.instanceMatrix.setUsage(DynamicDrawUsage);
  made.frustumCulled = false;
  made.renderOrder = 11;
  made.count = 0;
  return made;
}
