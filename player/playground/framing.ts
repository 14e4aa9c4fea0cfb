/** A camera that keeps what moves in the picture, until the reader moves it. */

import { type Box3, Vector3 } from "three";
import { extentOf } from "../src/scene/extent";
import type { SceneView } from "../src/scene/view";
import type { Selection } from "../src/selection";
import type { LiveReplay } from "./live";

/** Room beyond what has left the picture, so that the camera moves seldom, as a share of what is seen [1]. */
const ROOM = 0.25;
/** What flies farther than this is let go, in sizes of the scene at its beginning [1]. */
const FARTHEST = 60;

/** See the file's head. */
export class Framing {
  private readonly seen: Box3;
  private readonly first: number;
  private free = true;

  constructor(
    private readonly live: LiveReplay,
    private readonly view: SceneView,
    private readonly selection: Selection,
  ) {
    this.seen = extentOf(live.asReplay).box;
    this.first = sizeOf(this.seen);
    view.stage.controls.addEventListener("start", () => {
      this.free = false;
    });
  }

  /** Shows more where something has left what is seen. */
  keep(): void {
    if (!this.free || this.selection.followed >= 0) return;
    const { box } = extentOf(this.live.asReplay);
    if (this.seen.containsBox(box) || sizeOf(box) > FARTHEST * this.first) return;
    const center = box.getCenter(new Vector3());
    if (center.distanceTo(this.seen.getCenter(new Vector3())) > FARTHEST * this.first) return;
    const grown = this.seen.clone().union(box);
    const room = grown.getSize(new Vector3()).multiplyScalar(ROOM);
    // only on the sides that were crossed
    for (const axis of ["x", "y", "z"] as const) {
      if (box.min[axis] < this.seen.min[axis]) grown.min[axis] -= room[axis];
      if (box.max[axis] > this.seen.max[axis]) grown.max[axis] += room[axis];
    }
    this.seen.copy(grown);
    this.view.stage.lookAt(grown);
  }
}

function sizeOf(box: Box3): number {
  return box.getSize(new Vector3()).length();
}
