/**
 * Which contacts hang together: islands, and the pattern and values of A = J M⁻¹ Jᵀ for the normals
 * (theory chapter 3; row i of J is [n, r_a × n, −n, −(r_b × n)]). Knows no drawing.
 */

import type { Contacts } from "./data/contacts";
import type { Replay } from "./data/replay";

/** An entry of A: contacts i ≤ j that share a body forces move [1/kg]. */
export interface Entry {
  i: number;
  j: number;
  value: number;
}

/** Island of each contact, numbered from 0 in order of appearance; joints join too, and bodies that forces do not move join nothing. */
export function islandsOf(replay: Replay, contacts: Contacts): Int32Array {
  const parent = Int32Array.from({ length: replay.bodies }, (_, body) => body);
  const root = (body: number): number => {
    let at = body;
    while (parent[at] !== at) {
      parent[at] = parent[parent[at]];
      at = parent[at];
    }
    return at;
  };
  const moves = (body: number): boolean => replay.inverseMass[body] > 0;
  for (const [a, b] of replay.jointed) parent[root(a)] = root(b);
  for (let i = 0; i < contacts.count; i++) {
    if (moves(contacts.a[i]) && moves(contacts.b[i])) parent[root(contacts.a[i])] = root(contacts.b[i]);
  }
  const numbers = new Map<number, number>();
  return Int32Array.from({ length: contacts.count }, (_, i) => {
    const at = root(moves(contacts.a[i]) ? contacts.a[i] : contacts.b[i]);
    if (!numbers.has(at)) numbers.set(at, numbers.size);
    return numbers.get(at)!;
  });
}

/** The entries of A at a frame, i ≤ j. */
export function entriesOf(replay: Replay, frame: number, contacts: Contacts): Entry[] {
  const touching = contactsByBody(replay, contacts);
  const found = new Map<number, Entry>();
  const position = new Float64Array(3);
  const quaternion = new Float64Array(4);
  for (const [body, sides] of touching) {
    replay.position(frame, body, position);
    replay.rotation(frame, body, quaternion);
    const inverse = worldInverseInertia(replay, body, quaternion);
    const rows = sides.map(([contact, sign]) => rowOf(contacts, contact, sign, position, replay.dimension));
    for (let p = 0; p < sides.length; p++) {
      for (let q = p; q < sides.length; q++) {
        const i = Math.min(sides[p][0], sides[q][0]);
        const j = Math.max(sides[p][0], sides[q][0]);
        const key = i * contacts.count + j;
        const entry = found.get(key) ?? { i, j, value: 0 };
        entry.value += product(rows[p], rows[q], replay.inverseMass[body], inverse);
        found.set(key, entry);
      }
    }
  }
  return [...found.values()];
}

/** Names of the bodies that two contacts share. */
export function sharedBodies(contacts: Contacts, i: number, j: number): number[] {
  const first = [contacts.a[i], contacts.b[i]];
  return [contacts.a[j], contacts.b[j]].filter((body) => first.includes(body));
}

/** For each body that forces move: its contacts, with +1 where it is a and −1 where it is b. */
function contactsByBody(replay: Replay, contacts: Contacts): Map<number, [number, number][]> {
  const found = new Map<number, [number, number][]>();
  for (let i = 0; i < contacts.count; i++) {
    for (const [body, sign] of [
      [contacts.a[i], 1],
      [contacts.b[i], -1],
    ]) {
      if (!(replay.inverseMass[body] > 0)) continue;
      const sides = found.get(body);
      if (sides) sides.push([i, sign]);
      else found.set(body, [[i, sign]]);
    }
  }
  return found;
}

/** A body's six numbers of a row of J: ± n and ± r × n. */
function rowOf(
  contacts: Contacts,
  contact: number,
  sign: number,
  position: Float64Array,
  dimension: number,
): number[] {
  const at = contact * dimension;
  const n = [0, 1, 2].map((k) => (k < dimension ? sign * contacts.normal[at + k] : 0));
  const r = [0, 1, 2].map((k) => (k < dimension ? contacts.point[at + k] - position[k] : 0));
  const moment = [r[1] * n[2] - r[2] * n[1], r[2] * n[0] - r[0] * n[2], r[0] * n[1] - r[1] * n[0]];
  return [...n, ...moment];
}

/** p M⁻¹ qᵀ for one body. */
function product(p: number[], q: number[], inverseMass: number, inverse: number[]): number {
  let sum = inverseMass * (p[0] * q[0] + p[1] * q[1] + p[2] * q[2]);
  for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) sum += p[3 + i] * inverse[3 * i + j] * q[3 + j];
  return sum;
}

/** R I⁻¹ Rᵀ of a body, row by row [1/(kg m²)]; in the plane only the last number. */
export function worldInverseInertia(replay: Replay, body: number, quaternion: Float64Array): number[] {
  if (replay.dimension === 2) return [0, 0, 0, 0, 0, 0, 0, 0, replay.inverseInertia[body]];
  const inertia = replay.inverseInertia.subarray(9 * body, 9 * body + 9);
  const turn = matrixOf(quaternion);
  const found = new Array<number>(9).fill(0);
  for (let i = 0; i < 3; i++)
    for (let j = 0; j < 3; j++)
      for (let k = 0; k < 3; k++)
        for (let l = 0; l < 3; l++)
          found[3 * i + j] += turn[3 * i + k] * inertia[3 * k + l] * turn[3 * j + l];
  return found;
}

/** Rotation matrix of a quaternion (x, y, z, w), row by row. */
export function matrixOf([x, y, z, w]: Float64Array): number[] {
  return [
    1 - 2 * (y * y + z * z),
    2 * (x * y - w * z),
    2 * (x * z + w * y),
    2 * (x * y + w * z),
    1 - 2 * (x * x + z * z),
    2 * (y * z - w * x),
    2 * (x * z - w * y),
    2 * (y * z + w * x),
    1 - 2 * (x * x + y * y),
  ];
}
