/** Many pieces that share one geometry. */

import {
  type BufferGeometry,
  type Color,
  DynamicDrawUsage,
  InstancedMesh,
  type LineBasicMaterial,
  type Material,
  type Raycaster,
} from "three";
import { type Batch, type Hit, type Member, placesOf } from "./batch";

/** See the file's head. */
export class Instances implements Batch {
  readonly fill: InstancedMesh<BufferGeometry, Material> | null;
  readonly edges: InstancedLines;
  readonly materials: readonly Material[];
  readonly bodies: number[];
  readonly places: Float64Array;

  constructor(
    geometry: { fill: BufferGeometry | null; edges: BufferGeometry },
    members: Member[],
    material: Material | null,
    lines: LineBasicMaterial,
  ) {
    this.bodies = members.map(({ body }) => body);
    this.places = placesOf(members);
    this.materials = material ? [material] : [];
    this.edges = new InstancedLines(geometry.edges, lines, members.length);
    this.edges.instanceMatrix.setUsage(DynamicDrawUsage);
    this.edges.frustumCulled = false;
    this.fill = null;
    if (!geometry.fill || !material) return;
    this.fill = new InstancedMesh(geometry.fill, material, members.length);
    this.fill.instanceMatrix = this.edges.instanceMatrix;
    this.fill.frustumCulled = false;
  }

  get matrices(): Float32Array {
    return this.edges.instanceMatrix.array as Float32Array;
  }

  moved(): void {
    this.edges.instanceMatrix.needsUpdate = true;
    if (this.fill) this.fill.boundingSphere = null; // of all instances, for pointing at them
  }

  paint(piece: number, colour: Color): void {
    this.fill?.setColorAt(piece, colour);
  }

  painted(): void {
    if (this.fill?.instanceColor) this.fill.instanceColor.needsUpdate = true;
  }

  setRough(): void {}

  pick(ray: Raycaster): Hit | undefined {
    if (!this.fill) return undefined;
    const [hit] = ray.intersectObject(this.fill, false);
    if (hit?.instanceId === undefined) return undefined;
    return { body: this.bodies[hit.instanceId], distance: hit.distance };
  }
}

/**
 * Lines drawn once per instance. Three has instances of meshes only; the renderer asks an object what it is,
 * and takes its instances whatever that is.
 */
class InstancedLines extends InstancedMesh<BufferGeometry, LineBasicMaterial> {
  constructor(geometry: BufferGeometry, material: LineBasicMaterial, count: number) {
    super(geometry, material, count);
    Object.assign(this, { isMesh: false, isLine: true, isLineSegments: true });
  }
}
