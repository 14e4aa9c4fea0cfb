/** Dragging bodies: the pointer holds a point of a body, and the engine's spring pulls it to the pointer. */

import { Plane, Vector3 } from "three";
import type { SceneView } from "../src/scene/view";
import type { LiveReplay } from "./live";

/** What the page does with the hand. */
export interface Hand {
  hold(body: number, place: number[]): boolean;
  pull(place: number[]): void;
  release(): void;
}

/** Lets the pointer drag bodies of a scene; the camera stays meanwhile. */
export function letDrag(host: HTMLElement, view: SceneView, live: LiveReplay, hand: Hand): void {
  const { stage } = view;
  let plane: Plane | undefined;
  let pointer = -1;
  const place = (event: PointerEvent): number[] | undefined => {
    const met = stage.rayAt(event.clientX, event.clientY).ray.intersectPlane(plane!, new Vector3());
    return met ? [met.x, met.y, met.z] : undefined;
  };
  const { bodies } = view;
  host.addEventListener(
    "pointerdown",
    (event) => {
      if (event.target !== stage.canvas || event.button !== 0) return;
      const body = bodies.pick(stage.rayAt(event.clientX, event.clientY));
      if (body < 0 || live.kind[body] !== 0) return;
      const center = new Float64Array(3);
      live.position(0, body, center);
      const towards = stage.camera.getWorldDirection(new Vector3());
      plane = new Plane().setFromNormalAndCoplanarPoint(towards, new Vector3(...center));
      const at = place(event);
      if (!at || !hand.hold(body, at)) return;
      pointer = event.pointerId;
      stage.controls.enabled = false;
    },
    true,
  );
  window.addEventListener("pointermove", (event) => {
    if (event.pointerId !== pointer || !plane) return;
    const at = place(event);
    if (at) hand.pull(at);
  });
  const end = (event: PointerEvent): void => {
    if (event.pointerId !== pointer) return;
    pointer = -1;
    stage.controls.enabled = true;
    hand.release();
  };
  window.addEventListener("pointerup", end);
  window.addEventListener("pointercancel", end);
}
