/** The scene of a page: one run, or two as ghosts of each other or side by side. Ties drawing to time and pointer. */

import { Vector3 } from "three";
import type { Clock } from "../clock";
import { type Replay, STATUSES } from "../data/replay";
import { element } from "../dom";
import { quantity } from "../format";
import type { Selection } from "../selection";
import { onTheme } from "../theme";
import { Arrows } from "./arrows";
import { Bodies, MANY } from "./bodies";
import { extentOf } from "./extent";
import { Stage } from "./stage";

/** How two runs are shown. */
export type Compare = "ghosts" | "beside" | "first" | "second";

/** A click is a press that moved less than this [px]. */
const STILL = 5;
/** While drawings are coarse, bodies smaller than this are drawn with few triangles [px]. */
const SMALL = 48;
/** While drawings are coarse, impulses shorter than this are left out [px]. */
const SHORT = 1.5;

/** See the file's head. */
export class SceneView {
  readonly stage: Stage;
  readonly arrows: Arrows;
  /** What is told of the thing under the pointer. */
  readonly tip = element("div", { class: "tip", role: "status" });
  private readonly bodies: Bodies;
  private readonly other: Bodies | undefined;
  /** Size of a usual body [m]. */
  private readonly usual: number;
  private compare: Compare = "ghosts";
  private transparent = false;
  private readonly last = new Vector3();
  private pointer: PointerEvent | undefined;

  constructor(
    host: HTMLElement,
    private readonly replay: Replay,
    private readonly second: Replay | undefined,
    private readonly clock: Clock,
    private readonly selection: Selection,
  ) {
    const extent = extentOf(replay);
    this.usual = extent.body;
    this.stage = new Stage(host, replay.dimension === 2, upOf(replay), replay.bodies <= MANY);
    this.bodies = new Bodies(replay, "solid", extent.reach);
    this.arrows = new Arrows(replay, Math.min(extent.body, extent.reach / 16));
    this.stage.add(this.bodies.obstacles, this.bodies.group, this.arrows.group);
    if (second) {
      this.other = new Bodies(second, "ghost", extent.reach);
      this.stage.add(this.other.obstacles, this.other.group);
      this.other.obstacles.visible = false;
    }
    host.append(this.tip);
    this.stage.lookAt(extent.box);
    this.stage.beforeDraw = () => this.update();
    this.stage.onCoarse = (coarse) => {
      for (const each of [this.bodies, this.other]) each?.showEdges(!coarse || replay.dimension === 2);
    };
    clock.onMove(() => this.stage.draw());
    selection.onChange(() => this.changed());
    onTheme(() => this.rethemed());
    this.listen();
  }

  /** Shows two runs in another way. */
  setCompare(how: Compare): void {
    this.compare = how;
    const show = (first: boolean, second: boolean) => () => {
      this.bodies.group.visible = this.arrows.group.visible = this.bodies.obstacles.visible = first;
      if (!this.other) return;
      this.other.group.visible = second;
      // of both runs together those of the first are enough: they are at the same places
      this.other.obstacles.visible = second && !first;
    };
    this.stage.views =
      how === "beside"
        ? [
            { from: 0, to: 0.5, prepare: show(true, false) },
            { from: 0.5, to: 1, prepare: show(false, true) },
          ]
        : [];
    show(how !== "second", how !== "first")();
    this.stage.resize();
    this.stage.reset();
  }

  /** Lets contacts show through bodies. */
  setTransparent(on: boolean): void {
    this.transparent = on;
    this.bodies.setTransparent(this.transparent);
    this.stage.draw();
  }

  /** What the colours of residuals are measured by [m/s]. */
  get tolerance(): number {
    return this.replay.tolerance;
  }

  /** Draws contacts in another way. */
  setArrows(settings: Partial<Arrows["settings"]>): void {
    Object.assign(this.arrows.settings, settings);
    this.stage.draw();
  }

  /** Where a contact of the frame shown is on the page, in pixels from the canvas's corner. */
  contactOnScreen(contact: number): { x: number; y: number } {
    const d = this.replay.dimension;
    const { point } = this.replay.contacts(this.clock.frame);
    return this.stage.toScreen(
      new Vector3(point[contact * d], point[contact * d + 1], d === 3 ? point[contact * d + 2] : 0),
    );
  }

  /** Where a body's centre is on the page, in pixels from the canvas's corner. */
  bodyOnScreen(body: number): { x: number; y: number } {
    const position = new Float64Array(3);
    this.replay.position(this.clock.frame, body, position);
    return this.stage.toScreen(new Vector3(...position));
  }

  /** Brings everything to the frame shown, before it is drawn. */
  private update(): void {
    const { frame } = this.clock;
    const rough = this.stage.coarse && this.usual < SMALL * this.stage.scale();
    for (const each of [this.bodies, this.other]) each?.setRough(rough);
    this.follow(frame);
    this.bodies.show(frame);
    if (this.second && this.other) this.other.show(this.second.frameAt(this.clock.time));
    if (this.replay.dimension === 3) this.arrows.eye.copy(this.stage.camera.position);
    this.arrows.shortest = this.stage.coarse ? SHORT * this.stage.scale() : 0;
    this.arrows.show(frame, this.selection.hoveredContacts, this.worst());
  }

  /** Bodies of the worst contact of the step shown. */
  private worst(): number[] {
    const pairs = this.replay.steps.column("worst");
    const row = this.replay.stepAt(this.clock.time);
    return pairs && row >= 0 && pairs[2 * row] >= 0 ? [pairs[2 * row], pairs[2 * row + 1]] : [];
  }

  private follow(frame: number): void {
    const { followed } = this.selection;
    if (followed < 0) {
      this.last.setScalar(Number.NaN);
      return;
    }
    const position = new Float64Array(3);
    this.replay.position(frame, followed, position);
    const now = new Vector3(...position);
    const by = Number.isNaN(this.last.x)
      ? now.clone().sub(this.stage.controls.target)
      : now.clone().sub(this.last);
    this.last.copy(now);
    if (by.lengthSq() > 0) this.stage.shift(by);
  }

  private changed(): void {
    this.bodies.recolour(this.selection.hoveredBodies, this.selection.body);
    this.stage.draw();
  }

  private rethemed(): void {
    this.stage.retheme();
    this.changed();
    this.other?.recolour([], -1);
  }

  private listen(): void {
    const { canvas } = this.stage;
    let pressed = { x: 0, y: 0 };
    canvas.addEventListener("pointerdown", (event) => {
      pressed = { x: event.clientX, y: event.clientY };
    });
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) return;
      if (!this.pointer) requestAnimationFrame(() => this.point());
      this.pointer = event;
    });
    canvas.addEventListener("pointerleave", () => {
      this.selection.hover([], []);
      this.tip.textContent = "";
    });
    canvas.addEventListener("click", (event) => {
      if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > STILL) return;
      this.selection.choose(this.bodies.pick(this.stage.rayAt(event.clientX, event.clientY)));
    });
  }

  /** Finds what is under the pointer: a contact first, for it is the smaller. */
  private point(): void {
    const event = this.pointer;
    this.pointer = undefined;
    if (!event || this.compare === "second") return;
    const ray = this.stage.rayAt(event.clientX, event.clientY);
    const contact = this.arrows.pick(ray);
    const contacts = this.arrows.contacts;
    if (contact >= 0 && contacts) {
      this.selection.hover([contacts.a[contact], contacts.b[contact]], [contact]);
      this.tip.textContent = this.contactText(contact);
      return;
    }
    const body = this.bodies.pick(ray);
    this.selection.hover(body >= 0 ? [body] : [], []);
    this.tip.textContent = body >= 0 ? this.replay.names[body] : "";
  }

  private contactText(contact: number): string {
    const contacts = this.arrows.contacts!;
    const d = this.replay.dimension;
    const size = (values: Float32Array): number =>
      Math.hypot(...values.subarray(contact * d, contact * d + d));
    const names = `${this.replay.names[contacts.a[contact]]} on ${this.replay.names[contacts.b[contact]]}`;
    return [
      `${names}: ${STATUSES[contacts.status[contact]]}`,
      `normal ${quantity(contacts.normalImpulse[contact], "N s", 3)}`,
      `friction ${quantity(size(contacts.frictionImpulse), "N s", 3)}`,
      `slip ${quantity(size(contacts.slip), "m/s", 3)}`,
      `gap ${quantity(contacts.gap[contact], "m", 3)}`,
    ].join(" · ");
  }
}

/** Against gravity, along an axis; z where there is none. */
function upOf(replay: Replay): Vector3 {
  const gravity = replay.table.gravity;
  if (replay.dimension === 2 || gravity.length !== 3) return new Vector3(0, 0, 1);
  const sizes = gravity.map(Math.abs);
  const axis = sizes.indexOf(Math.max(...sizes));
  if (sizes[axis] === 0) return new Vector3(0, 0, 1);
  return new Vector3().setComponent(axis, gravity[axis] > 0 ? -1 : 1);
}
