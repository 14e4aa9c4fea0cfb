/** A run that is being computed, as the parts of the replay page see a recorded one: its frame is always the last. */

import type { Clock } from "../src/clock";
import { type Contacts, pressing } from "../src/data/contacts";
import type { ShapeTable, Table } from "../src/data/payload";
import type { Replay, Steps } from "../src/data/replay";

/** What the engine tells of a scene when it is loaded. */
export interface About {
  space: "planar" | "spatial";
  name: string;
  description: string;
  gravity: number[];
  settings: Record<string, unknown> & {
    dt: number;
    scheme: string;
    tolerance: number;
    iterations: number;
  } & {
    soft?: { sleeping?: boolean };
  };
  solver: string;
  impact: string;
  names: string[];
  kind: number[];
  shapes: ShapeTable[];
  shape: number[];
  center: number[];
  /** Friction and restitution of the bodies in the scene [1]. */
  own: [number, number][];
  /** Pairs of movable bodies that a joint joins. */
  jointed: [number, number][];
  inverse_mass: number[];
  inverse_inertia: number[][];
}

/** Figures before a frame's motion, as `crates/playground/src/frame.rs` states them. */
const FIGURES = 33;
const [TIME, STEPS, RESIDUAL, , WORST_A, WORST_B, ITERATIONS, GAP, KINETIC, POTENTIAL, CONTACTS] = [
  0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10,
];
const MOMENTUM = 12;
const ANGULAR = 15;
const LEDGER = 18;
const LINES = [
  "gravity",
  "applied",
  "driven",
  "damping",
  "contact_normal",
  "friction",
  "impact_normal",
  "impact_friction",
  "rest_cut",
  "fallback",
  "constraint",
  "projection",
  "integrator",
  "sleep",
  "closure",
];
/** Points of the plots that are kept; of more, every other one is dropped. */
const MOST_POINTS = 4000;

type Public<T> = Pick<T, keyof T>;

/** See the file's head. */
export class LiveReplay implements Omit<Public<Replay>, "payload" | "steps"> {
  readonly table: Table;
  readonly dimension: 2 | 3;
  readonly names: string[];
  readonly bodies: number;
  readonly frames = 1;
  readonly time = new Float64Array(1);
  readonly kind: Uint8Array;
  readonly shape: Int32Array;
  readonly center: Float64Array;
  readonly inverseMass: Float64Array;
  readonly inverseInertia: Float64Array;
  readonly payload = { has: () => false };
  usualImpulse = 0;
  /** Numbers of the frame that is shown. */
  private now: Float64Array = new Float64Array(FIGURES);
  private read: Contacts | undefined;
  private points: Float64Array[] = [];
  private every = 1;
  private skipped = 0;

  constructor(readonly about: About) {
    const planar = about.space === "planar";
    this.dimension = planar ? 2 : 3;
    this.names = about.names;
    this.bodies = about.names.length;
    this.kind = Uint8Array.from(about.kind);
    this.shape = Int32Array.from(about.shape);
    this.center = Float64Array.from(about.center);
    this.inverseMass = Float64Array.from(about.inverse_mass);
    this.inverseInertia = Float64Array.from(
      about.inverse_inertia.flatMap((i) =>
        planar ? i : [i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2]],
      ),
    );
    const settings = about.settings as unknown as Table["settings"];
    this.table = {
      title: about.name,
      space: about.space,
      gravity: about.gravity,
      settings,
      names: about.names,
      shapes: about.shapes,
    } as unknown as Table;
  }

  /** What was asked for, or a millionth [m/s]. */
  get tolerance(): number {
    return Number(this.table.settings.tolerance) || 1e-6;
  }

  /** This, as the parts of the replay page take it; they read no more than what is here. */
  get asReplay(): Replay {
    return this as unknown as Replay;
  }

  get end(): number {
    return this.time[0];
  }

  get jointed(): [number, number][] {
    return this.about.jointed;
  }

  /** Steps taken. */
  get taken(): number {
    return this.now[STEPS];
  }

  /** Bodies that sleep. */
  get asleep(): number {
    const who = new Uint8Array(this.bodies);
    this.sleepers(0, who);
    return who.reduce((sum, one) => sum + one, 0);
  }

  /** Largest residual of the last frame's steps [m/s]. */
  get residual(): number {
    return this.now[RESIDUAL];
  }

  /** What the books do not account for [J], and the energy [J]. */
  get books(): { closure: number; energy: number } {
    return {
      closure: this.now[LEDGER + LINES.indexOf("closure")],
      energy: this.now[KINETIC] + this.now[POTENTIAL],
    };
  }

  /** Shows another frame; `counts` when steps led to it. */
  show(frame: Float64Array, counts: boolean): void {
    this.now = frame;
    this.time[0] = frame[TIME];
    this.read = undefined;
    if (!counts) return;
    this.skipped += 1;
    if (this.skipped < this.every) return;
    this.skipped = 0;
    this.points.push(frame.slice(0, FIGURES));
    if (this.points.length > MOST_POINTS) {
      this.points = this.points.filter((_, i) => i % 2 === 0);
      this.every *= 2;
    }
    const { normalImpulse, status } = this.contacts();
    const usual = pressing(normalImpulse, status);
    // the first at once, then as the frames go
    if (usual > 0) this.usualImpulse += (this.usualImpulse > 0 ? 0.1 : 1) * (usual - this.usualImpulse);
  }

  /** Columns over the points that are kept. */
  get steps(): Steps {
    const { points } = this;
    const column = (at: number): Float32Array => Float32Array.from(points, (point) => point[at]);
    const many = (at: number, width: number): Float32Array =>
      Float32Array.from(
        { length: points.length * width },
        (_, i) => points[Math.floor(i / width)][at + (i % width)],
      );
    const turns = this.dimension === 2 ? 1 : 3;
    const widths: Record<string, number> = { momentum: this.dimension, angular_momentum: turns, worst: 2 };
    const read: Record<string, () => Float32Array> = {
      residual: () => column(RESIDUAL),
      iterations: () => column(ITERATIONS),
      contacts: () => column(CONTACTS),
      deepest_gap: () => column(GAP),
      kinetic: () => column(KINETIC),
      potential: () => column(POTENTIAL),
      momentum: () => many(MOMENTUM, this.dimension),
      angular_momentum: () => many(ANGULAR, turns),
      worst: () => Float32Array.of(this.now[WORST_A], this.now[WORST_B]),
    };
    LINES.forEach((name, i) => {
      read[`ledger_${name}`] = () => column(LEDGER + i);
    });
    return {
      count: points.length,
      time: Float64Array.from(points, (point) => point[TIME]),
      column: (name) => read[name]?.(),
      width: (name) => widths[name] ?? 1,
    };
  }

  frameAt(): number {
    return 0;
  }

  stepAt(): number {
    return 0;
  }

  position(_: number, body: number, into: Float64Array): void {
    const d = this.dimension;
    into[2] = 0;
    for (let axis = 0; axis < d; axis++) into[axis] = this.now[FIGURES + body * d + axis];
  }

  rotation(_: number, body: number, into: Float64Array): void {
    const turns = FIGURES + this.bodies * this.dimension;
    if (this.dimension === 2) {
      const half = Math.atan2(this.now[turns + 2 * body + 1], this.now[turns + 2 * body]) / 2;
      into[0] = into[1] = 0;
      into[2] = Math.sin(half);
      into[3] = Math.cos(half);
      return;
    }
    const at = turns + 4 * body;
    for (let part = 0; part < 3; part++) into[part] = this.now[at + 1 + part];
    into[3] = this.now[at];
  }

  /** There is one frame: its number in `time`, while the clock's only tells that it is another. */
  detailFrame(): number {
    return 0;
  }

  velocity(_: number, body: number): Float32Array {
    const d = this.dimension;
    const at = FIGURES + this.bodies * (d + (d === 2 ? 2 : 4)) + body * d;
    return Float32Array.from(this.now.subarray(at, at + d));
  }

  angularVelocity(_: number, body: number): Float32Array {
    const d = this.dimension;
    const width = d === 2 ? 1 : 3;
    const at = FIGURES + this.bodies * (2 * d + (d === 2 ? 2 : 4)) + body * width;
    return Float32Array.from(this.now.subarray(at, at + width));
  }

  /** As the replay's, exact: what is held has no velocity at all. */
  sleepers(_: number, into: Uint8Array): void {
    into.fill(0);
    const { scheme, soft } = this.about.settings;
    if (this.taken === 0 || scheme !== "soft_step" || !soft?.sleeping) return;
    const d = this.dimension;
    const turns = d === 2 ? 1 : 3;
    const [velocity, spin] = [
      this.bodies * (d + (d === 2 ? 2 : 4)),
      this.bodies * (2 * d + (d === 2 ? 2 : 4)),
    ];
    const rests = (from: number, count: number): boolean => {
      for (let i = 0; i < count; i++) if (this.now[FIGURES + from + i] !== 0) return false;
      return true;
    };
    for (let i = 0; i < this.bodies; i++) {
      if (this.kind[i] === 0 && rests(velocity + i * d, d) && rests(spin + i * turns, turns)) into[i] = 1;
    }
  }

  contacts(): Contacts {
    this.read ??= contactsOf(this.now, this.bodies, this.dimension);
    return this.read;
  }
}

/** The contacts at the end of a frame's numbers. */
function contactsOf(now: Float64Array, bodies: number, d: 2 | 3): Contacts {
  const start = FIGURES + bodies * (d === 2 ? 2 + 2 + 2 + 1 : 3 + 4 + 3 + 3);
  const width = 5 + 4 * d;
  const count = Math.max(0, Math.floor((now.length - start) / width));
  const one = (at: number): Float32Array =>
    Float32Array.from({ length: count }, (_, i) => now[start + i * width + at]);
  const vector = (at: number): Float32Array =>
    Float32Array.from({ length: count * d }, (_, i) => now[start + Math.floor(i / d) * width + at + (i % d)]);
  return {
    count,
    a: one(0),
    b: one(1),
    point: vector(2),
    normal: vector(2 + d),
    gap: one(2 + 2 * d),
    normalImpulse: one(3 + 2 * d),
    frictionImpulse: vector(4 + 2 * d),
    slip: vector(4 + 3 * d),
    status: Uint8Array.from(one(4 + 4 * d)),
    residual: new Float32Array(count).fill(Number.NaN),
  };
}

/** The time cursor of a run that is being computed: its moment is always now. */
export class LiveClock implements Public<Clock> {
  frame = 0;
  speed = 1;
  playing = false;
  readonly frames = 1;
  private readonly moved: (() => void)[] = [];
  private readonly changed: (() => void)[] = [];

  constructor(private readonly now: Float64Array) {}

  get time(): number {
    return this.now[0];
  }

  /** This, as the parts of the replay page take it. */
  get asClock(): Clock {
    return this as unknown as Clock;
  }

  /** Tells everybody that there is another frame. */
  advance(): void {
    this.frame += 1; // what is shown is known by its number
    for (const listener of this.moved) listener();
  }

  onMove(listener: () => void): void {
    this.moved.push(listener);
  }

  onChange(listener: () => void): void {
    this.changed.push(listener);
  }

  show(): void {}

  seek(): void {}

  /** Steps to take at the next frame of the page, while it pauses. */
  pending = 0;

  stepBy(steps: number): void {
    this.pause();
    if (steps > 0) this.pending += steps;
  }

  toggle(): void {
    if (this.playing) this.pause();
    else this.play();
  }

  play(): void {
    this.playing = true;
    this.tell();
  }

  pause(): void {
    this.playing = false;
    this.tell();
  }

  setSpeed(speed: number): void {
    this.speed = speed;
    this.tell();
  }

  private tell(): void {
    for (const listener of this.changed) listener();
  }
}
