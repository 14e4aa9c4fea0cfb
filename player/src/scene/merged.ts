/**
 * Pieces with geometries of their own in one drawing: all corners stand in one list, each with the number of its
 * piece, and the pieces' poses and colours in two textures. Hundreds of hulls cost one call instead of hundreds;
 * and drawing in software takes each instance of a geometry for a call too.
 */

import {
  BufferGeometry,
  type Color,
  DataTexture,
  Float32BufferAttribute,
  FloatType,
  type LineBasicMaterial,
  LineSegments,
  type Material,
  Mesh,
  type Raycaster,
  RGBAFormat,
} from "three";
import { type Batch, type Hit, type Member, placesOf } from "./batch";

/** A piece and its geometry. */
export interface Single extends Member {
  fill: BufferGeometry;
  edges: BufferGeometry;
}

/** Pieces per row of the textures. */
const ROW = 64;

/** See the file's head. */
export class Merged implements Batch {
  readonly fill: Mesh<BufferGeometry, Material>;
  readonly edges: LineSegments<BufferGeometry, LineBasicMaterial>;
  readonly bodies: number[];
  readonly places: Float64Array;
  readonly matrices: Float32Array;
  private readonly poses: DataTexture;
  private readonly tints: DataTexture;
  private readonly tintValues: Float32Array;
  /** Each piece for itself, for pointing at it. */
  private readonly targets: Mesh[];

  constructor(singles: Single[], material: Material, lines: LineBasicMaterial) {
    this.bodies = singles.map(({ body }) => body);
    this.places = placesOf(singles);
    const rows = Math.ceil(singles.length / ROW);
    this.matrices = new Float32Array(16 * ROW * rows);
    this.tintValues = new Float32Array(4 * ROW * rows);
    this.poses = new DataTexture(this.matrices, 4 * ROW, rows, RGBAFormat, FloatType);
    this.tints = new DataTexture(this.tintValues, ROW, rows, RGBAFormat, FloatType);
    Object.assign(material, { vertexColors: true });
    this.patch(material, true);
    this.patch(lines, false);
    this.fill = new Mesh(joined(singles.map(({ fill }) => fill)), material);
    this.edges = new LineSegments(joined(singles.map(({ edges }) => edges)), lines);
    this.fill.frustumCulled = this.edges.frustumCulled = false;
    this.targets = singles.map(({ fill }) => new Mesh(fill, material));
  }

  moved(): void {
    this.poses.needsUpdate = true;
  }

  paint(piece: number, colour: Color): void {
    colour.toArray(this.tintValues, 4 * piece);
  }

  painted(): void {
    this.tints.needsUpdate = true;
  }

  pick(ray: Raycaster): Hit | undefined {
    let found: Hit | undefined;
    this.targets.forEach((target, i) => {
      target.matrixWorld.fromArray(this.matrices, 16 * i);
      const [hit] = ray.intersectObject(target, false);
      if (hit && !(found && found.distance <= hit.distance))
        found = { body: this.bodies[i], distance: hit.distance };
    });
    return found;
  }

  /** Has a material take poses, and colours of surfaces, from the textures. */
  private patch(material: Material, tinted: boolean): void {
    material.onBeforeCompile = (shader) => {
      shader.uniforms.poses = { value: this.poses };
      shader.uniforms.tints = { value: this.tints };
      for (const [part, text] of tinted ? [...POSED, ...TINTED] : POSED)
        shader.vertexShader = shader.vertexShader.replace(`#include <${part}>`, text);
    };
    material.customProgramCacheKey = () => `merged ${tinted}`;
  }
}

/** Parts of three's vertex shaders, and what stands there instead: each corner moves with its piece. */
const POSED: readonly (readonly [part: string, text: string])[] = [
  [
    "common",
    `#include <common>
    attribute float piece;
    uniform highp sampler2D poses;
    uniform highp sampler2D tints;
    vec4 column(ivec2 first, int number) { return texelFetch(poses, first + ivec2(number, 0), 0); }`,
  ],
  [
    "uv_vertex",
    `#include <uv_vertex>
    ivec2 home = ivec2(int(piece) % ${ROW}, int(piece) / ${ROW});
    ivec2 first = ivec2(4 * home.x, home.y);
    mat4 pose = mat4(column(first, 0), column(first, 1), column(first, 2), column(first, 3));`,
  ],
  ["begin_vertex", "vec3 transformed = (pose * vec4(position, 1.0)).xyz;"],
];

/** The same for surfaces, which have normals and colours; normals of a stretched piece shrink with it. */
const TINTED: readonly (readonly [part: string, text: string])[] = [
  ["color_vertex", "vColor = vec4(texelFetch(tints, home, 0).rgb, 1.0);"],
  [
    "beginnormal_vertex",
    `mat3 turn = mat3(pose);
    vec3 objectNormal = turn * (normal / vec3(dot(turn[0], turn[0]), dot(turn[1], turn[1]), dot(turn[2], turn[2])));`,
  ],
];

/** Geometries one after another, each corner with the number of its geometry. */
function joined(geometries: BufferGeometry[]): BufferGeometry {
  const made = new BufferGeometry();
  const counts = geometries.map((geometry) => geometry.getAttribute("position").count);
  const total = counts.reduce((sum, count) => sum + count, 0);
  for (const name of ["position", "normal"]) {
    if (!geometries.every((geometry) => geometry.hasAttribute(name))) continue;
    const values = new Float32Array(3 * total);
    let at = 0;
    for (const geometry of geometries) {
      const { array } = geometry.getAttribute(name);
      values.set(array, at);
      at += array.length;
    }
    made.setAttribute(name, new Float32BufferAttribute(values, 3));
  }
  const pieces = new Float32Array(total);
  const corners: number[] = [];
  let first = 0;
  geometries.forEach((geometry, i) => {
    pieces.fill(i, first, first + counts[i]);
    const length = geometry.index?.count ?? counts[i];
    for (let k = 0; k < length; k++) corners.push(first + (geometry.index?.getX(k) ?? k));
    first += counts[i];
  });
  made.setIndex(corners);
  return made.setAttribute("piece", new Float32BufferAttribute(pieces, 1));
}
