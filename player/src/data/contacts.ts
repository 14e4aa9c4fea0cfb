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
  /** How far the pair's contacts are off their laws [m/s]; NaN where that is not known. */
  residual: Float32Array;
}

/** Vectors and numbers of contacts that are kept as halves. */
type Halves = "normal" | "gap" | "normal_impulse" | "friction_impulse" | "slip";

/** Contacts and frames that are looked at for the usual impulse. */
const MOST_LOOKED_AT = 300_000;
const MOST_FRAMES = 200;
/** Code of a contact that strikes. */
const STRIKES = 3;

/** The largest impulse of contacts that do not strike, else of those that do; 0 where none presses [N s]. */
export function pressing(impulse: ArrayLike<number>, status: ArrayLike<number>): number {
  let [resting, striking] = [0, 0];
  for (let i = 0; i < impulse.length; i++) {
    if (status[i] === STRIKES) striking = Math.max(striking, impulse[i]);
    else resting = Math.max(resting, impulse[i]);
  }
  return resting || striking;
}

/** See the file's head. */
export class PackedContacts {
  private readonly status: Uint8Array;
  private readonly low: Float64Array;
  private readonly residuals: Uint8Array;
  /** What was read last: many parts of the page ask for the same frame. */
  private last: { begin: number; end: number; contacts: Contacts } | undefined;

  constructor(
    private readonly payload: Payload,
    private readonly dimension: number,
  ) {
    this.status = payload.array("contact_status") as Uint8Array;
    this.low = payload.array("contact_point_low") as Float64Array;
    this.residuals = payload.array("contact_residual") as Uint8Array;
  }

  /** Contacts from `begin` to before `end`. */
  between(begin: number, end: number): Contacts {
    if (this.last?.begin === begin && this.last.end === end) return this.last.contacts;
    const d = this.dimension;
    const contacts = {
      count: end - begin,
      a: this.bodies("contact_a", begin, end),
      b: this.bodies("contact_b", begin, end),
      point: this.pointsBetween(begin * d, end * d),
      normal: this.read("normal", begin * d, end * d),
      gap: this.read("gap", begin, end),
      normalImpulse: this.read("normal_impulse", begin, end),
      frictionImpulse: this.read("friction_impulse", begin * d, end * d),
      slip: this.read("slip", begin * d, end * d),
      status: this.status.subarray(begin, end),
      residual: Float32Array.from(this.residuals.subarray(begin, end), residualOf),
    };
    this.last = { begin, end, contacts };
    return contacts;
  }

  /**
   * The median over frames of the largest impulse that presses without striking [N s]: a blow that lasts one frame is not
   * what the others are measured by. `offsets` are where the frames' contacts begin. 0 where nothing presses.
   */
  usualImpulse(offsets: ArrayLike<number>): number {
    const frames = offsets.length - 1;
    const contacts = offsets[frames];
    // all frames of small runs, some of large ones
    const stride = Math.max(1, Math.ceil(contacts / MOST_LOOKED_AT), Math.ceil(frames / MOST_FRAMES));
    const largest: number[] = [];
    for (let frame = frames - 1; frame >= 0; frame -= stride) {
      const [begin, end] = [offsets[frame], offsets[frame + 1]];
      const found = pressing(this.read("normal_impulse", begin, end), this.status.subarray(begin, end));
      if (found > 0) largest.push(found);
    }
    return largest.sort((a, b) => a - b)[largest.length >> 1] ?? 0;
  }

  private read(name: Halves, begin: number, end: number): Float32Array {
    return fromHalves(this.payload.codes(`contact_${name}`, begin, end), this.scale(name));
  }

  /** Rows of bodies; wider than 16 bits where there are many. */
  private bodies(name: string, begin: number, end: number): ArrayLike<number> {
    return this.payload.is16(name)
      ? this.payload.codes(name, begin, end)
      : this.payload.array(name).subarray(begin, end);
  }

  private scale(name: string): number {
    return this.payload.table.scale[`contact_${name}`];
  }

  private pointsBetween(begin: number, end: number): Float32Array {
    const step = this.scale("point");
    const codes = this.payload.codes("contact_point", begin, end);
    const found = new Float32Array(end - begin);
    for (let i = 0; i < found.length; i++) found[i] = this.low[i % this.dimension] + codes[i] * step;
    return found;
  }
}

/** A residual from its byte: 0 where it is not known, else a twelfth of a digit from 1e-18 on. */
function residualOf(code: number): number {
  return code === 0 ? Number.NaN : 10 ** ((code - 1) / 12 - 18);
}
