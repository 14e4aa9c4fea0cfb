/** STL, binary or text: triangles without common vertices. */

import type { Triangles } from "./index";

/** Bytes before the triangles, and of each. */
const [HEAD, EACH] = [84, 50];

/** See the file's head. */
export function readStl(bytes: ArrayBuffer): Triangles {
  const view = new DataView(bytes);
  const count = bytes.byteLength >= HEAD ? view.getUint32(80, true) : -1;
  const vertices = bytes.byteLength === HEAD + EACH * count ? binary(view, count) : text(bytes);
  return { vertices, triangles: Array.from({ length: vertices.length / 3 }, (_, i) => i) };
}

function binary(view: DataView, count: number): number[] {
  const vertices: number[] = [];
  for (let triangle = 0; triangle < count; triangle++) {
    const at = HEAD + EACH * triangle + 12; // after the normal
    for (let k = 0; k < 9; k++) vertices.push(view.getFloat32(at + 4 * k, true));
  }
  return vertices;
}

function text(bytes: ArrayBuffer): number[] {
  const read = new TextDecoder().decode(bytes);
  if (!read.trimStart().startsWith("solid")) {
    throw new Error("neither binary of the size that its header says, nor text");
  }
  const found = read.matchAll(/\bvertex\s+(\S+)\s+(\S+)\s+(\S+)/gi);
  const vertices = [...found].flatMap(([, x, y, z]) => [Number(x), Number(y), Number(z)]);
  if (vertices.length % 9 !== 0) throw new Error("a triangle has not three vertices");
  return vertices;
}
