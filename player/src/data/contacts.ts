/** Contacts of a run as they are packed; numbers are read when a frame asks for them. */

import { fromHalves } from "./half";
import type { Payload } from "./payload";

/** Contacts of a frame; numbers of one contact stand `dimension` apart where they are vectors. */
export interface Contacts {
  count: number;
  a: ArrayLike<number>;
  b: ArrayLike<number>;
  /** Where [m]. */
  point: Float32Array;
  /** Unit normal from b to a. */
  normal: Float32Array;
  /** Distance of the surfaces [m], negative for overlap. */
  gap: Float32Array;
  /** On a along the normal [N s]. */
  normalImpulse: Float32Array;
  /** On a across it [N s]. */
  frictionImpulse: Float32Array;
  /** Velocity of a's point against b's across the normal [m/s]. */
  slip: Float32Array;
  status: Uint8Array;
}

/** Vectors and numbers of contacts that are kept as halves. */
type Halves = "normal" | "gap" | "normal_impulse" | "friction_impulse" | "slip";

/** See the file's head. */
export class PackedContacts {
  private readonly a: Uint16Array;
  private readonly b: Uint16Array;
  private readonly status: Uint8Array;
  private readonly points: Uint16Array;
  private readonly low: Float64Array;
  private readonly codes: Record<Halves, Uint16Array>;
  /** What was read last: many parts of the page ask for the same frame. */
  private last: { begin: number; end: number; contacts: Contacts } | undefined;

  constructor(
    private readonly payload: Payload,
    private readonly dimension: number,
  ) {
    const codes = (name: string): Uint16Array => payload.array(`contact_${name}`) as Uint16Array;
    this.a = codes("a");
    this.b = codes("b");
    this.status = payload.array("contact_status") as Uint8Array;
    this.points = codes("point");
    this.low = payload.array("contact_point_low") as Float64Array;
    this.codes = {
      normal: codes("normal"),
      gap: codes("gap"),
      normal_impulse: codes("normal_impulse"),
      friction_impulse: codes("friction_impulse"),
      slip: codes("slip"),
    };
  }

  /** Contacts from `begin` to before `end`. */
  between(begin: number, end: number): Contacts {
    if (this.last?.begin === begin && this.last.end === end) return this.last.contacts;
    const d = this.dimension;
    const contacts = {
      count: end - begin,
      a: this.a.subarray(begin, end),
      b: this.b.subarray(begin, end),
      point: this.pointsBetween(begin * d, end * d),
      normal: this.read("normal", begin * d, end * d),
      gap: this.read("gap", begin, end),
      normalImpulse: this.read("normal_impulse", begin, end),
      frictionImpulse: this.read("friction_impulse", begin * d, end * d),
      slip: this.read("slip", begin * d, end * d),
      status: this.status.subarray(begin, end),
    };
    this.last = { begin, end, contacts };
    return contacts;
  }

  /** The impulse that 98 of 100 pressing contacts stay below [N s]. */
  usualImpulse(): number {
    const codes = this.codes.normal_impulse;
    const stride = Math.max(1, Math.floor(codes.length / 20000));
    const some = codes.filter((_, i) => i % stride === 0);
    const pressing = fromHalves(some, this.scale("normal_impulse")).filter((impulse) => impulse > 0);
    pressing.sort();
    return pressing.length ? pressing[Math.floor(0.98 * (pressing.length - 1))] : 1;
  }

  private read(name: Halves, begin: number, end: number): Float32Array {
    return fromHalves(this.codes[name].subarray(begin, end), this.scale(name));
  }

  private scale(name: string): number {
    return this.payload.table.scale[`contact_${name}`];
  }

  private pointsBetween(begin: number, end: number): Float32Array {
    const step = this.scale("point");
    const found = new Float32Array(end - begin);
    for (let i = 0; i < found.length; i++)
      found[i] = this.low[i % this.dimension] + this.points[begin + i] * step;
    return found;
  }
}
