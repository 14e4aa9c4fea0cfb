/** A run as the page uses it: poses by frame, contacts and velocities by frame, columns by step. */

import { type Contacts, PackedContacts } from "./contacts";
import { fromHalves } from "./half";
import type { Payload, Table } from "./payload";

/** Kinds of bodies by code. */
export const KINDS = ["dynamic", "static", "kinematic"] as const;
/** What a contact did in a step, by code. */
export const STATUSES = ["apart", "sticks", "slips", "strikes"] as const;

/** Columns over the points of the plots. */
export interface Steps {
  count: number;
  time: Float64Array;
  column(name: string): Float32Array | Int32Array | undefined;
  width(name: string): number;
}

/** See the file's head. */
export class Replay {
  readonly table: Table;
  readonly dimension: 2 | 3;
  readonly names: string[];
  readonly bodies: number;
  readonly frames: number;
  /** Moments of the frames [s]. */
  readonly time: Float64Array;
  readonly kind: Uint8Array;
  readonly shape: Int32Array;
  /** Centre of mass in the shape's axes [m]. */
  readonly center: Float64Array;
  /** [1/kg], 0 for what forces do not move. */
  readonly inverseMass: Float64Array;
  /** 1 or 9 numbers per body, body axes [1/(kg m²)]. */
  readonly inverseInertia: Float64Array;
  readonly steps: Steps;
  /** What residuals are measured by [m/s]: what was asked for, or a millionth. */
  readonly tolerance: number;
  /** Pairs of bodies that forces move and a joint joins. */
  readonly jointed: [number, number][];
  /** What presses hardest in a usual frame, strikes apart: an arrow of the usual length [N s]; 0 where nothing presses. */
  readonly usualImpulse: number;
  private readonly codes: Uint16Array;
  private readonly turns: Uint16Array;
  private readonly low: Float64Array;
  private readonly step: Float64Array;
  private readonly detailFrames: Int32Array;
  private readonly offsets: Uint32Array;
  private readonly all: PackedContacts;

  constructor(readonly payload: Payload) {
    this.table = payload.table;
    this.dimension = this.table.space === "planar" ? 2 : 3;
    this.names = this.table.names;
    const asked = Number(this.table.settings.tolerance);
    this.tolerance = asked > 0 ? asked : 1e-6;
    this.bodies = this.names.length;
    this.time = payload.array("time") as Float64Array;
    this.frames = this.time.length;
    this.kind = payload.array("kind") as Uint8Array;
    this.shape = payload.array("shape") as Int32Array;
    this.center = payload.array("center") as Float64Array;
    this.inverseMass = payload.array("inverse_mass") as Float64Array;
    this.inverseInertia = payload.array("inverse_inertia") as Float64Array;
    this.codes = payload.array("position") as Uint16Array;
    this.turns = payload.array("rotation") as Uint16Array;
    this.low = payload.array("position_low") as Float64Array;
    this.step = payload.array("position_step") as Float64Array;
    this.detailFrames = payload.array("detail_frames") as Int32Array;
    this.offsets = payload.array("contact_offsets") as Uint32Array;
    this.all = new PackedContacts(payload, this.dimension);
    this.usualImpulse = this.all.usualImpulse(this.offsets);
    this.jointed = this.joined();
    this.steps = stepsOf(payload);
  }

  /** Moment of the last frame [s]. */
  get end(): number {
    return this.time[this.frames - 1];
  }

  /** The frame nearest to a moment [s]. */
  frameAt(time: number): number {
    return nearest(this.time, time);
  }

  /** The plots' point nearest to a moment [s]; -1 without any. */
  stepAt(time: number): number {
    return this.steps.count ? nearest(this.steps.time, time) : -1;
  }

  /** Writes the centre of mass of a body [m] into `into`, z = 0 in the plane. */
  position(frame: number, body: number, into: Float64Array): void {
    const d = this.dimension;
    into[2] = 0;
    for (let axis = 0; axis < d; axis++) {
      const column = body * d + axis;
      into[axis] = this.low[column] + this.codes[frame * this.bodies * d + column] * this.step[column];
    }
  }

  /** Writes the rotation of a body as a quaternion (x, y, z, w) into `into`. */
  rotation(frame: number, body: number, into: Float64Array): void {
    if (this.dimension === 2) {
      const half = (this.turns[frame * this.bodies + body] * Math.PI) / 65536;
      into[0] = into[1] = 0;
      into[2] = Math.sin(half);
      into[3] = Math.cos(half);
      return;
    }
    const at = 3 * (frame * this.bodies + body);
    const dropped = (this.turns[at] >> 15) + 2 * (this.turns[at + 1] >> 15);
    let rest = 1;
    for (let part = 0, slot = 0; slot < 4; slot++) {
      if (slot === dropped) continue;
      const value = (((this.turns[at + part++] & 32767) / 32767) * 2 - 1) * Math.SQRT1_2;
      into[(slot + 3) % 4] = value; // stored as (w, x, y, z)
      rest -= value * value;
    }
    into[(dropped + 3) % 4] = Math.sqrt(Math.max(0, rest));
  }

  /** The frame whose contacts and velocities are shown at a frame: itself, or the nearest that has them. */
  detailFrame(frame: number): number {
    return this.detailFrames[nearest(this.detailFrames, frame)];
  }

  /** Velocity of a body [m/s]. */
  velocity(frame: number, body: number): Float32Array {
    const at = (nearest(this.detailFrames, frame) * this.bodies + body) * this.dimension;
    return this.halves("velocity", at, at + this.dimension);
  }

  /** Angular velocity of a body, world axes [rad/s]. */
  angularVelocity(frame: number, body: number): Float32Array {
    const width = this.dimension === 2 ? 1 : 3;
    const at = (nearest(this.detailFrames, frame) * this.bodies + body) * width;
    return this.halves("angular_velocity", at, at + width);
  }

  /** Writes 1 for each body that sleeps at a frame, else 0: in runs with sleep, what is held has no velocity at all. */
  sleepers(frame: number, into: Uint8Array): void {
    into.fill(0);
    if (frame === 0 || !this.table.sleeping) return;
    const row = nearest(this.detailFrames, frame) * this.bodies;
    const [d, turns] = this.dimension === 2 ? [2, 1] : [3, 3];
    const velocity = this.payload.codes("velocity", row * d, (row + this.bodies) * d);
    const spin = this.payload.codes("angular_velocity", row * turns, (row + this.bodies) * turns);
    const rests = (codes: Uint16Array, begin: number, end: number): boolean => {
      for (let i = begin; i < end; i++) if (codes[i] & 0x7fff) return false; // but for the sign all bits are 0
      return true;
    };
    for (let i = 0; i < this.bodies; i++) {
      const held = this.kind[i] === 0 && rests(velocity, i * d, i * d + d);
      if (held && rests(spin, i * turns, (i + 1) * turns)) into[i] = 1;
    }
  }

  /** Contacts at a frame. */
  contacts(frame: number): Contacts {
    const row = nearest(this.detailFrames, frame);
    const [begin, end] = [this.offsets[row], this.offsets[row + 1]];
    return this.all.between(begin, end);
  }

  private joined(): [number, number][] {
    const rows = new Map(this.names.map((name, row) => [name, row]));
    const moves = (row: number | undefined): row is number => row !== undefined && this.inverseMass[row] > 0;
    return (this.table.joints ?? []).flatMap(({ a, b }): [number, number][] => {
      const [first, second] = [rows.get(a), b === null ? undefined : rows.get(b)];
      return moves(first) && moves(second) ? [[first, second]] : [];
    });
  }

  private halves(name: string, begin: number, end: number): Float32Array {
    return fromHalves(this.payload.codes(name, begin, end), this.table.scale[name]);
  }
}

function stepsOf(payload: Payload): Steps {
  const time = payload.array("step_time") as Float64Array;
  return {
    count: time.length,
    time,
    column: (name) =>
      payload.has(`step_${name}`) ? (payload.array(`step_${name}`) as Float32Array) : undefined,
    width: (name) => payload.shape(`step_${name}`)[1] ?? 1,
  };
}

/** Index of the value of a rising list that is nearest to `wanted`. */
function nearest(values: ArrayLike<number>, wanted: number): number {
  let low = 0;
  let high = values.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (values[middle] <= wanted) low = middle;
    else high = middle;
  }
  return Math.abs(values[high] - wanted) < Math.abs(values[low] - wanted) ? high : low;
}
