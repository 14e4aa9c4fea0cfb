/**
 * Mesh files that a user gives to the page beside a scene: read here into triangles, in the units and axes of the file;
 * welded, checked and made shapes by the engine (`crates/playground/src/scene/mesh.rs`). Nothing that a file refers to is opened.
 */

import { readGlb } from "./glb";
import { readObj } from "./obj";
import { readPly } from "./ply";
import { readStl } from "./stl";

/** Three numbers to a vertex [units of the file], three indices to a triangle. */
export interface Triangles {
  vertices: number[];
  triangles: number[];
}

/** Largest file that is read [bytes]. */
const MOST_BYTES = 64 * 1024 * 1024;

const READERS: Record<string, (bytes: ArrayBuffer) => Triangles> = {
  obj: readObj,
  stl: readStl,
  ply: readPly,
  glb: readGlb,
};

/** Ends of file names that are meshes, as a file dialogue takes them. */
export const SUFFIXES = Object.keys(READERS)
  .map((suffix) => `.${suffix}`)
  .join(",");

function suffixOf(name: string): string {
  return name.slice(name.lastIndexOf(".") + 1).toLowerCase();
}

/** Whether a file's name is that of a mesh. */
export function isMesh(name: string): boolean {
  return suffixOf(name) in READERS;
}

/** Reads a mesh file. Raises an error that names it. */
export async function readMesh(file: File): Promise<Triangles> {
  const suffix = suffixOf(file.name);
  if (file.size > MOST_BYTES) throw new Error(`mesh '${file.name}': larger than 64 MiB; simplify the mesh`);
  try {
    const mesh = READERS[suffix](await file.arrayBuffer());
    if (mesh.triangles.length === 0) throw new Error("it holds no triangles");
    if (!mesh.vertices.every(Number.isFinite)) throw new Error("a vertex is no place");
    return mesh;
  } catch (error) {
    const reason = error instanceof Error ? error.message : String(error);
    throw new Error(
      `mesh '${file.name}': cannot be read as ${suffix.toUpperCase()}: ${reason}; export it again`,
    );
  }
}

/** Adds a polygon as a fan of triangles. */
export function addPolygon(triangles: number[], corners: ArrayLike<number>): void {
  for (let k = 2; k < corners.length; k++) triangles.push(corners[0], corners[k - 1], corners[k]);
}
