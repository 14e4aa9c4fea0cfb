/** The scene of a page: one run, or two as ghosts of each other or side by side. Ties drawing to time and pointer. */

import { Vector3 } from "three";
import type { Clock } from "../clock";
import type { Contacts } from "../data/contacts";
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
  /** Contacts of the first run. */
  readonly arrows: Arrows;
  /** What is told of the thing under the pointer. */
  readonly tip = element("div", { class: "tip", role: "status" });
  readonly bodies: Bodies;
  private readonly other: Bodies | undefined;
  private readonly otherArrows: Arrows | undefined;
  /** For each body of a run the one of the other with its name, or -1. */
  private readonly twins: Int32Array[] = [];
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
    this.bodies = new Bodies(replay, "solid", extent);
    const length = Math.min(extent.body, extent.reach / 16);
    // arrows of both runs are measured by the same
    const usual = (): number => Math.max(replay.usualImpulse, second?.usualImpulse ?? 0);
    this.arrows = new Arrows(replay, length, usual);
    this.stage.add(this.bodies.obstacles, this.bodies.group, this.arrows.group);
    if (second) {
      this.other = new Bodies(second, "ghost", extent);
      this.otherArrows = new Arrows(second, length, usual);
      this.stage.add(this.other.obstacles, this.other.group, this.otherArrows.group);
      this.other.obstacles.visible = this.otherArrows.group.visible = false;
      this.twins = [twinsOf(replay, second), twinsOf(second, replay)];
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
      if (!this.other || !this.otherArrows) return;
      this.other.group.visible = second;
      // contacts of the ghosts would hide those of the others
      this.otherArrows.group.visible = second && !first;
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
    const run = how === "second" ? 1 : how === "beside" ? this.selection.run : 0;
    this.selection.choose(this.counterpart(this.selection.body, this.selection.run, run), run);
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
    for (const each of [this.arrows, this.otherArrows]) if (each) Object.assign(each.settings, settings);
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
    this.follow();
    for (const each of [this.bodies, this.other])
      each?.lookAt(this.stage.controls.target, this.stage.sight());
    this.bodies.show(frame);
    if (this.second && this.other) this.other.show(this.frameOf(1));
    [this.arrows, this.otherArrows].forEach((arrows, run) => {
      if (!arrows || (run === 1 && !this.showsAlone(1))) return;
      if (this.replay.dimension === 3) arrows.eye.copy(this.stage.camera.position);
      arrows.shortest = this.stage.coarse ? SHORT * this.stage.scale() : 0;
      arrows.show(this.frameOf(run), this.selection.contactsOf(run), this.worst(run));
    });
  }

  private replayOf(run: number): Replay {
    return run === 1 && this.second ? this.second : this.replay;
  }

  /** The frame of a run that is shown. */
  private frameOf(run: number): number {
    return run === 1 && this.second ? this.second.frameAt(this.clock.time) : this.clock.frame;
  }

  /** Whether somewhere in the picture a run stands without the other. */
  private showsAlone(run: number): boolean {
    return this.compare === "beside" || this.compare === (run === 1 ? "second" : "first");
  }

  /** The body of a run that has the name of another's; -1 without. */
  private counterpart(body: number, from: number, to: number): number {
    return body < 0 || from === to ? body : (this.twins[from]?.[body] ?? -1);
  }

  /** Bodies of the worst contact of the step shown. */
  private worst(run: number): number[] {
    const replay = this.replayOf(run);
    const pairs = replay.steps.column("worst");
    const row = replay.stepAt(this.clock.time);
    return pairs && row >= 0 && pairs[2 * row] >= 0 ? [pairs[2 * row], pairs[2 * row + 1]] : [];
  }

  private follow(): void {
    const { followed, followedRun } = this.selection;
    if (followed < 0) {
      this.last.setScalar(Number.NaN);
      return;
    }
    const position = new Float64Array(3);
    this.replayOf(followedRun).position(this.frameOf(followedRun), followed, position);
    const now = new Vector3(...position);
    const by = Number.isNaN(this.last.x)
      ? now.clone().sub(this.stage.controls.target)
      : now.clone().sub(this.last);
    this.last.copy(now);
    if (by.lengthSq() > 0) this.stage.shift(by);
  }

  private changed(): void {
    const { hoveredBodies, hoveredRun, body, run } = this.selection;
    // what is pointed at and what is chosen is marked in both runs
    [this.bodies, this.other].forEach((each, at) => {
      const hovered = hoveredBodies.map((one) => this.counterpart(one, hoveredRun, at));
      each?.recolour(hovered, this.counterpart(body, run, at));
    });
    this.stage.draw();
  }

  private rethemed(): void {
    this.stage.retheme();
    this.changed();
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
      const { body, run } = this.met(event);
      this.selection.choose(body, run);
    });
  }

  /** The body under the pointer and its run; of ghosts only where no body of the first run is. */
  private met(event: PointerEvent | MouseEvent): { body: number; run: number } {
    const ray = this.stage.rayAt(event.clientX, event.clientY);
    const seen = this.runsAt(event.clientX);
    for (const run of seen) {
      const body = (run === 1 ? this.other : this.bodies)?.pick(ray) ?? -1;
      if (body >= 0 && (seen.length === 1 || this.replayOf(run).kind[body] !== 1)) return { body, run };
    }
    return { body: seen.length > 1 ? this.bodies.pick(ray) : -1, run: seen[0] };
  }

  /** Runs that are drawn where the pointer is. */
  private runsAt(x: number): number[] {
    if (!this.second || this.compare === "first") return [0];
    if (this.compare === "second") return [1];
    return this.compare === "beside" ? [this.stage.viewAt(x)] : [0, 1];
  }

  /** Finds what is under the pointer: a contact first, for it is the smaller. */
  private point(): void {
    const event = this.pointer;
    this.pointer = undefined;
    if (!event) return;
    const [first] = this.runsAt(event.clientX);
    const arrows = first === 1 && this.otherArrows ? this.otherArrows : this.arrows;
    const contact = arrows.pick(this.stage.rayAt(event.clientX, event.clientY));
    const { contacts } = arrows;
    if (contact >= 0 && contacts) {
      this.selection.hover([contacts.a[contact], contacts.b[contact]], [contact], first);
      this.tip.textContent = this.contactText(contacts, contact, this.replayOf(first));
      return;
    }
    const { body, run } = this.met(event);
    this.selection.hover(body >= 0 ? [body] : [], [], run);
    this.tip.textContent = body >= 0 ? this.replayOf(run).names[body] : "";
  }

  private contactText(contacts: Contacts, contact: number, { dimension: d, names }: Replay): string {
    const size = (values: Float32Array): number =>
      Math.hypot(...values.subarray(contact * d, contact * d + d));
    return [
      `${names[contacts.a[contact]]} on ${names[contacts.b[contact]]}: ${STATUSES[contacts.status[contact]]}`,
      `normal ${quantity(contacts.normalImpulse[contact], "N s", 3)}`,
      `friction ${quantity(size(contacts.frictionImpulse), "N s", 3)}`,
      `slip ${quantity(size(contacts.slip), "m/s", 3)}`,
      `gap ${quantity(contacts.gap[contact], "m", 3)}`,
    ].join(" · ");
  }
}

/** For each body of a run the one of the other that has its name, or -1. */
function twinsOf(from: Replay, to: Replay): Int32Array {
  const rows = new Map(to.names.map((name, row) => [name, row]));
  return Int32Array.from(from.names, (name) => rows.get(name) ?? -1);
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
