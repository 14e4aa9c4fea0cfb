/** Reads what Python packed into the page; the layout is told in `python/carom/player/payload.py`. */

const VERSION = 1;

/** A value of the table of contents. */
export interface Extreme {
  value: number | null;
  step: number;
  time: number | null;
  between: [string, string] | null;
}

/** Why a step is as accurate as it is, and the certificate of its solve. */
export interface Explained {
  findings: [topic: string, text: string, remedy: string, bodies: string[]][];
  certificate: [words: string, value: number, unit: string][];
  accurate?: boolean;
}

/** What is known of the run's worst step, and of the steps of its frames by their number. */
export interface Words extends Explained {
  step: number;
  time: number | null;
  note: string;
  steps: Record<string, Explained>;
}

/** A shape as scene files have it. */
export type ShapeTable = { type: string } & Record<string, unknown>;

/** The table of contents of a payload. */
export interface Table {
  title: string;
  space: "planar" | "spatial";
  status: string;
  created: string;
  carom: string;
  dt: number;
  ms_per_step: number | null;
  gravity: number[];
  settings: Record<string, string | number | boolean>;
  /** Solver and law of impacts, also where the scheme chose them; absent in pages from before. */
  solver?: string;
  impact?: string;
  /** Joints with the names of their bodies; `b` is null for the world. */
  joints?: { name: string; kind: string; a: string; b: string | null }[];
  /** Whether bodies may fall asleep; absent in pages from before. */
  sleeping?: boolean;
  names: string[];
  energy_closure: number;
  worst: Extreme;
  deepest: Extreme;
  error: { position: number; rotation: number };
  kept: { frames: number; of_frames: number; details: number; steps_per_point: number; steps: number };
  scale: Record<string, number>;
  shapes: ShapeTable[];
  note?: string;
  words: Words;
}

interface Entry {
  type: "u1" | "u2" | "u4" | "i4" | "f2" | "f4" | "f8";
  shape: number[];
  at: number;
  filter: string;
}

export type Numbers = Uint8Array | Uint16Array | Uint32Array | Int32Array | Float32Array | Float64Array;

/** The table and the arrays of one run. */
export class Payload {
  /** Length of the packed text [bytes]. */
  readonly packed: number;
  readonly table: Table;
  private readonly entries: Record<string, Entry>;
  private readonly bytes: ArrayBuffer;
  private readonly start: number;

  constructor(bytes: ArrayBuffer, packed: number) {
    const length = new DataView(bytes).getUint32(0, true);
    const text = new TextDecoder().decode(new Uint8Array(bytes, 4, length));
    const table = JSON.parse(text) as Table & { version: number; arrays: Record<string, Entry> };
    if (table.version !== VERSION)
      throw new Error(`This page cannot read payloads of version ${table.version}.`);
    this.table = table;
    this.entries = table.arrays;
    this.bytes = bytes;
    this.start = 4 + length;
    this.packed = packed;
  }

  /** Whether there is an array of that name. */
  has(name: string): boolean {
    return name in this.entries;
  }

  /** Lengths of an array's axes. */
  shape(name: string): number[] {
    return this.entries[name].shape;
  }

  /** Some of an array of 16-bit numbers, from `begin` to before `end`, without reading the others. */
  codes(name: string, begin: number, end: number): Uint16Array {
    const entry = this.entries[name];
    if (entry.filter !== "shuffle") return (this.array(name) as Uint16Array).subarray(begin, end);
    const at = this.start + entry.at;
    return joined(this.bytes, at + begin, at + this.length(name) + begin, end - begin);
  }

  /** Whether an array has numbers of 16 bits. */
  is16(name: string): boolean {
    return this.entries[name].type === "u2";
  }

  /** How many numbers an array has. */
  length(name: string): number {
    return this.entries[name].shape.reduce((product, length) => product * length, 1);
  }

  /** An array's numbers; halves come as their codes. */
  array(name: string): Numbers {
    const entry = this.entries[name];
    const count = this.length(name);
    const at = this.start + entry.at;
    if (entry.filter) return unshuffled(this.bytes, at, count, entry);
    switch (entry.type) {
      case "u1":
        return new Uint8Array(this.bytes, at, count);
      case "u2":
      case "f2":
        return new Uint16Array(this.bytes, at, count);
      case "u4":
        return new Uint32Array(this.bytes, at, count);
      case "i4":
        return new Int32Array(this.bytes, at, count);
      case "f4":
        return new Float32Array(this.bytes, at, count);
      case "f8":
        return new Float64Array(this.bytes, at, count);
    }
  }
}

/** Undoes the filters of 16-bit numbers: bytes by significance, then differences along the first axis. */
function unshuffled(bytes: ArrayBuffer, at: number, count: number, entry: Entry): Uint16Array {
  const found = joined(bytes, at, at + count, count);
  if (entry.filter.startsWith("delta")) {
    const row = count / Math.max(1, entry.shape[0]);
    for (let i = row; i < count; i++) found[i] += found[i - row];
  }
  return found;
}

/** Numbers of 16 bits whose low and high bytes stand apart. */
function joined(bytes: ArrayBuffer, lows: number, highs: number, count: number): Uint16Array {
  const low = new Uint8Array(bytes, lows, count);
  const high = new Uint8Array(bytes, highs, count);
  const found = new Uint16Array(count);
  for (let i = 0; i < count; i++) found[i] = low[i] | (high[i] << 8);
  return found;
}

/** Payloads of the page, in order. */
export async function readPayloads(): Promise<Payload[]> {
  const scripts = document.querySelectorAll<HTMLScriptElement>('script[type="application/carom-run"]');
  const payloads: Payload[] = [];
  for (const script of scripts) {
    const text = script.textContent?.trim() ?? "";
    script.remove();
    payloads.push(new Payload(await unpacked(text), text.length));
  }
  return payloads;
}

/** The bytes that parts of base64 of gzip, divided by dots, hold together; all are unpacked at once. */
async function unpacked(text: string): Promise<ArrayBuffer> {
  const parts = text.split(".").map(decodeBase64);
  // gzip ends with the length of what it holds
  const lengths = parts.map(({ buffer, byteLength }) => new DataView(buffer).getUint32(byteLength - 4, true));
  const all = new Uint8Array(lengths.reduce((sum, length) => sum + length, 0));
  let from = 0;
  await Promise.all(
    parts.map((part, i) => {
      const into = all.subarray(from, from + lengths[i]);
      from += lengths[i];
      return gunzip(part, into);
    }),
  );
  return all.buffer;
}

async function gunzip(packed: Uint8Array<ArrayBuffer>, into: Uint8Array): Promise<void> {
  const reader = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip")).getReader();
  let at = 0;
  for (let got = await reader.read(); !got.done; got = await reader.read()) {
    into.set(got.value, at);
    at += got.value.length;
  }
}

function decodeBase64(text: string): Uint8Array<ArrayBuffer> {
  const reader = Uint8Array as unknown as { fromBase64?: (text: string) => Uint8Array<ArrayBuffer> };
  if (reader.fromBase64) return reader.fromBase64(text); // browsers since 2025, several times as fast
  const plain = atob(text);
  const found = new Uint8Array(plain.length);
  for (let i = 0; i < plain.length; i++) found[i] = plain.charCodeAt(i);
  return found;
}
