/** Stanford PLY, text or binary of either order of bytes: x, y, z of `vertex`, the list of corners of `face`. */

import { addPolygon, type Triangles } from "./index";

interface Property {
  name: string;
  type: string;
  /** Type of the count, of a list. */
  counted?: string;
}
interface Element {
  name: string;
  count: number;
  properties: Property[];
}
type Next = (type: string) => number;

/** Other names of the types. */
const SAME: Record<string, string> = {
  char: "int8",
  uchar: "uint8",
  short: "int16",
  ushort: "uint16",
  int: "int32",
  uint: "uint32",
  float: "float32",
  double: "float64",
};
const CORNERS = ["vertex_indices", "vertex_index"];

/** See the file's head. */
export function readPly(bytes: ArrayBuffer): Triangles {
  const start = new TextDecoder("latin1").decode(bytes.slice(0, 65_536));
  const end = /end_header\r?\n/.exec(start);
  if (!start.startsWith("ply") || !end) throw new Error("it has no header");
  const lines = start.slice(0, end.index).split(/\r?\n/);
  const form = lines.find((line) => line.startsWith("format"))?.split(/\s+/)[1];
  const body = end.index + end[0].length;
  const next = form === "ascii" ? words(bytes, body) : numbers(bytes, body, form === "binary_little_endian");
  const mesh: Triangles = { vertices: [], triangles: [] };
  for (const element of elements(lines)) read(element, next, mesh);
  return mesh;
}

function elements(lines: string[]): Element[] {
  const found: Element[] = [];
  for (const line of lines) {
    const [kind, ...rest] = line.trim().split(/\s+/);
    if (kind === "element") found.push({ name: rest[0], count: Number(rest[1]), properties: [] });
    if (kind !== "property") continue;
    const [name, type, counted] = [...rest].reverse();
    found.at(-1)?.properties.push(rest[0] === "list" ? { name, type, counted } : { name, type });
  }
  return found;
}

function read({ name, count, properties }: Element, next: Next, mesh: Triangles): void {
  for (let i = 0; i < count; i++) {
    const place = [0, 0, 0];
    for (const property of properties) {
      if (property.counted === undefined) {
        const value = next(property.type);
        const axis = ["x", "y", "z"].indexOf(property.name);
        if (axis >= 0) place[axis] = value;
        continue;
      }
      const list = Array.from({ length: next(property.counted) }, () => next(property.type));
      if (name === "face" && CORNERS.includes(property.name)) addPolygon(mesh.triangles, list);
    }
    if (name === "vertex") mesh.vertices.push(...place);
  }
}

function words(bytes: ArrayBuffer, from: number): Next {
  const all = new TextDecoder().decode(bytes.slice(from)).split(/\s+/).filter(Boolean);
  let at = 0;
  return () => {
    const value = Number(all[at++]);
    if (Number.isNaN(value)) throw new Error("it ends too early, or a number cannot be read");
    return value;
  };
}

function numbers(bytes: ArrayBuffer, from: number, little: boolean): Next {
  const view = new DataView(bytes);
  let at = from;
  return (type) => {
    const kind = SAME[type] ?? type;
    const size = Number(/\d+$/.exec(kind)?.[0]) / 8;
    const place = at;
    at += size;
    switch (kind) {
      case "int8":
        return view.getInt8(place);
      case "uint8":
        return view.getUint8(place);
      case "int16":
        return view.getInt16(place, little);
      case "uint16":
        return view.getUint16(place, little);
      case "int32":
        return view.getInt32(place, little);
      case "uint32":
        return view.getUint32(place, little);
      case "float32":
        return view.getFloat32(place, little);
      case "float64":
        return view.getFloat64(place, little);
      default:
        throw new Error(`numbers of a type that is not known: '${type}'`);
    }
  };
}
