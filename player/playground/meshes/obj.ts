/** Wavefront OBJ: vertices and faces; polygons become fans, materials, normals and texture coordinates are left out. */

import { addPolygon, type Triangles } from "./index";

/** See the file's head. */
export function readObj(bytes: ArrayBuffer): Triangles {
  const vertices: number[] = [];
  const triangles: number[] = [];
  // a line may go on after a backslash
  for (const line of new TextDecoder()
    .decode(bytes)
    .replace(/\\\r?\n/g, " ")
    .split(/\r?\n|\r/)) {
    const words = line.trim().split(/\s+/);
    if (words[0] === "v") vertices.push(Number(words[1]), Number(words[2]), Number(words[3]));
    if (words[0] !== "f") continue;
    const corners = words.slice(1).map((word) => {
      const index = Number.parseInt(word, 10);
      // counted from 1; negative ones from the last vertex back
      return index < 0 ? vertices.length / 3 + index : index - 1;
    });
    if (!corners.every((corner) => corner >= 0))
      throw new Error(`a face that cannot be read: '${line.trim()}'`);
    addPolygon(triangles, corners);
  }
  return { vertices, triangles };
}
