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
  type ShaderMaterial,
} from "three";
import { type Batch, type Hit, type Member, placesOf, setOpacity } from "./batch";
import { litAtCorners } from "./plain";

/** A piece and its geometry, which is made when it is drawn or pointed at. */
export interface Single extends Member {
  fill: () => BufferGeometry;
  edges: () => BufferGeometry;
  rough: () => BufferGeometry;
}

/** Pieces per row of the textures. */
const ROW = 64;

/** See the file's head. */
export class Merged implements Batch {
  readonly fill: Mesh<BufferGeometry, Material>;
  /** Of the full drawing and of the rough one. */
  readonly materials: [Material, ShaderMaterial];
  readonly edges: LineSegments<BufferGeometry, LineBasicMaterial>;
  readonly bodies: number[];
  readonly places: Float64Array;
  readonly matrices: Float32Array;
  private readonly poses: DataTexture;
  private readonly tints: DataTexture;
  private readonly tintValues: Float32Array;
  /** Each piece for itself, for pointing at it. */
  private targets: Mesh[] | undefined;
  private roughly = false;
  private full: { fill: BufferGeometry; edges: BufferGeometry } | undefined;
  private rough: BufferGeometry | undefined;

  constructor(
    private readonly singles: Single[],
    material: Material,
    lines: LineBasicMaterial,
  ) {
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
    this.materials = [material, litAtCorners(this.poses, this.tints, POSES)];
    for (const each of this.materials) setOpacity(each, material.opacity);
    this.materials[1].userData.opacity = material.userData.opacity;
    this.fill = new Mesh(new BufferGeometry(), material);
    this.fill.onBeforeRender = () => {
      this.materials[1].uniforms.opacity.value = this.materials[1].opacity;
    };
    this.edges = new LineSegments(new BufferGeometry(), lines);
    this.fill.frustumCulled = this.edges.frustumCulled = false;
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

  setRough(on: boolean): void {
    if (on) {
      if (this.roughly) return;
      this.rough ??= joined(this.singles.map(({ rough }) => rough()));
      this.fill.geometry = this.rough;
      this.fill.material = this.materials[1];
    } else {
      if (this.full && !this.roughly) return;
      this.full ??= {
        fill: joined(this.singles.map(({ fill }) => fill())),
        edges: joined(this.singles.map(({ edges }) => edges())),
      };
      this.fill.geometry = this.full.fill;
      this.fill.material = this.materials[0];
      this.edges.geometry = this.full.edges;
    }
    this.roughly = on;
  }

  pick(ray: Raycaster): Hit | undefined {
    let found: Hit | undefined;
    this.targets ??= this.singles.map(({ fill }) => new Mesh(fill(), this.fill.material));
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

/** Where a corner's piece has its pose, and the pose; for vertex shaders. */
const POSES = `
    in float piece;
    uniform highp sampler2D poses;
    uniform highp sampler2D tints;
    vec4 column(ivec2 first, int number) { return texelFetch(poses, first + ivec2(number, 0), 0); }
    ivec2 homeOf(float piece) { return ivec2(int(piece) % ${ROW}, int(piece) / ${ROW}); }
    mat4 poseAt(ivec2 home) {
      ivec2 first = ivec2(4 * home.x, home.y);
      return mat4(column(first, 0), column(first, 1), column(first, 2), column(first, 3));
    }`;

/** Parts of three's vertex shaders, and what stands there instead: each corner moves with its piece. */
const POSED: readonly (readonly [part: string, text: string])[] = [
  ["common", `#include <common>${POSES}`],
  [
    "uv_vertex",
    `#include <uv_vertex>
    ivec2 home = homeOf(piece);
    mat4 pose = poseAt(home);`,
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
