/**
 * Binary glTF 2.0: the triangles of every mesh, placed where the scene's nodes put it; no axis is swapped. Materials,
 * textures, skins and animations are left out; compressed meshes and buffers in other files are refused.
 */

import { Matrix4, Quaternion, Vector3 } from "three";
import type { Triangles } from "./index";

interface Primitive {
  attributes: { POSITION?: number };
  indices?: number;
  mode?: number;
}
interface Node {
  mesh?: number;
  children?: number[];
  matrix?: number[];
  translation?: number[];
  rotation?: number[];
  scale?: number[];
}
interface Accessor {
  bufferView?: number;
  byteOffset?: number;
  componentType: number;
  count: number;
  type: string;
  sparse?: unknown;
}
interface Tree {
  scene?: number;
  scenes?: { nodes?: number[] }[];
  nodes?: Node[];
  meshes?: { primitives: Primitive[] }[];
  accessors?: Accessor[];
  bufferViews?: { buffer?: number; byteOffset?: number; byteStride?: number }[];
  buffers?: { uri?: string }[];
}

const [MAGIC, JSON_CHUNK, BINARY_CHUNK] = [0x46546c67, 0x4e4f534a, 0x004e4942];
/** Triangles one by one. */
const TRIANGLES = 4;
/** Bytes of a component, by its type. */
const SIZES: Record<number, number> = { 5121: 1, 5123: 2, 5125: 4, 5126: 4 };

/** See the file's head. */
export function readGlb(bytes: ArrayBuffer): Triangles {
  const { tree, binary } = chunks(bytes);
  const mesh: Triangles = { vertices: [], triangles: [] };
  const visit = (index: number, parent: Matrix4, depth: number): void => {
    const node = tree.nodes?.[index];
    if (!node || depth > 64) throw new Error("its nodes are not a tree");
    const place = parent.clone().multiply(placed(node));
    if (node.mesh !== undefined) {
      for (const part of tree.meshes?.[node.mesh].primitives ?? []) add(mesh, part, place, tree, binary);
    }
    for (const child of node.children ?? []) visit(child, place, depth + 1);
  };
  const roots = tree.scenes?.[tree.scene ?? 0]?.nodes ?? [];
  for (const root of roots) visit(root, new Matrix4(), 0);
  return mesh;
}

function chunks(bytes: ArrayBuffer): { tree: Tree; binary: DataView } {
  const view = new DataView(bytes);
  if (bytes.byteLength < 20 || view.getUint32(0, true) !== MAGIC) throw new Error("it is no binary glTF");
  let tree: Tree | undefined;
  let binary = new DataView(new ArrayBuffer(0));
  for (let at = 12; at + 8 <= bytes.byteLength; ) {
    const [length, kind] = [view.getUint32(at, true), view.getUint32(at + 4, true)];
    if (kind === JSON_CHUNK)
      tree = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, at + 8, length)));
    if (kind === BINARY_CHUNK) binary = new DataView(bytes, at + 8, length);
    at += 8 + length;
  }
  if (!tree) throw new Error("it holds no scene");
  if (tree.buffers?.some(({ uri }) => uri !== undefined)) throw new Error("its numbers are in another file");
  return { tree, binary };
}

function placed({ matrix, translation, rotation, scale }: Node): Matrix4 {
  if (matrix) return new Matrix4().fromArray(matrix);
  return new Matrix4().compose(
    new Vector3(...(translation ?? [0, 0, 0])),
    new Quaternion(...(rotation ?? [0, 0, 0, 1])),
    new Vector3(...(scale ?? [1, 1, 1])),
  );
}

function add(mesh: Triangles, part: Primitive, place: Matrix4, tree: Tree, binary: DataView): void {
  const mode = part.mode ?? TRIANGLES;
  if (mode > TRIANGLES) throw new Error("its triangles are strips or fans, which are not read");
  if (mode < TRIANGLES || part.attributes.POSITION === undefined) return; // points and lines
  const first = mesh.vertices.length / 3;
  const places = numbers(part.attributes.POSITION, 3, tree, binary);
  for (let i = 0; i < places.length; i += 3) {
    const point = new Vector3(places[i], places[i + 1], places[i + 2]).applyMatrix4(place);
    mesh.vertices.push(point.x, point.y, point.z);
  }
  const count = places.length / 3;
  const corners =
    part.indices === undefined
      ? Array.from({ length: count - (count % 3) }, (_, i) => i)
      : numbers(part.indices, 1, tree, binary);
  // a mirroring placement turns triangles over
  const mirrored = place.determinant() < 0;
  for (let k = 0; k + 2 < corners.length; k += 3) {
    const [a, b, c] = [corners[k] + first, corners[k + 1] + first, corners[k + 2] + first];
    mesh.triangles.push(a, mirrored ? c : b, mirrored ? b : c);
  }
}

/** The numbers of an accessor, `width` to an entry. */
function numbers(index: number, width: number, tree: Tree, binary: DataView): number[] {
  const accessor = tree.accessors?.[index];
  const view = accessor?.bufferView === undefined ? undefined : tree.bufferViews?.[accessor.bufferView];
  const size = accessor ? SIZES[accessor.componentType] : undefined;
  if (!accessor || !view || !size || accessor.sparse) {
    throw new Error("its numbers are compressed or sparse, which is not read");
  }
  const start = (view.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
  const stride = view.byteStride ?? width * size;
  const one = (at: number): number => {
    if (accessor.componentType === 5126) return binary.getFloat32(at, true);
    if (size === 1) return binary.getUint8(at);
    return size === 2 ? binary.getUint16(at, true) : binary.getUint32(at, true);
  };
  const found: number[] = [];
  for (let i = 0; i < accessor.count; i++) {
    for (let k = 0; k < width; k++) found.push(one(start + i * stride + k * size));
  }
  return found;
}
