/**
 * The pattern of A = J M⁻¹ Jᵀ for the normals at the frame shown. Pointing at an entry lights up its two
 * contacts and the bodies that they share; contacts and bodies pointed at in the scene light up their rows.
 */

import { Calm } from "../calm";
import type { Clock } from "../clock";
import { type Entry, entriesOf, sharedBodies } from "../coupling";
import type { Contacts } from "../data/contacts";
import type { Replay } from "../data/replay";
import { element } from "../dom";
import { counted, quantity } from "../format";
import type { Selection } from "../selection";
import { onTheme, theme } from "../theme";

/** Most pixels of the drawing along a side. */
const MOST_PIXELS = 1200;
/** Decades of |A| that have a shade of their own [1]. */
const DECADES = 4;

/** See the file's head. */
export class MatrixPanel {
  readonly root: HTMLElement;
  private readonly canvas = element("canvas", { class: "matrix", "aria-label": "pattern of A" });
  private readonly marks = element("canvas", { class: "marks" });
  private readonly title = element("p", { class: "hint" });
  private readonly told = element("p", { class: "told" });
  private contacts: Contacts | undefined;
  private entries = new Map<number, Entry>();
  private shown = -1;
  /** The run that is shown. */
  private run = 0;

  constructor(
    private readonly replays: readonly Replay[],
    private readonly clock: Clock,
    private readonly selection: Selection,
  ) {
    const frame = element("div", { class: "matrix-frame" }, this.canvas, this.marks);
    this.root = element("div", { class: "matrix-panel" }, this.title, frame, this.told);
    this.marks.addEventListener("pointermove", (event) => this.point(event));
    this.marks.addEventListener("pointerleave", () => selection.hover([], []));
    clock.onMove(new Calm(() => this.show()).ask);
    selection.onChange(() => {
      if (selection.run === this.run) this.mark();
      else this.show(true);
    });
    onTheme(() => this.show(true));
    new ResizeObserver(() => this.show()).observe(this.root);
  }

  private get replay(): Replay {
    return this.replays[this.run];
  }

  /** Draws the pattern at the frame shown, while the panel is seen. */
  show(again = false): void {
    if (this.root.hidden || this.root.clientWidth === 0) return;
    const other = this.run !== this.selection.run;
    this.run = this.selection.run;
    const now = this.run === 0 ? this.clock.frame : this.replay.frameAt(this.clock.time);
    const frame = this.replay.detailFrame(now);
    if (frame === this.shown && !again && !other) return;
    this.shown = frame;
    const contacts = this.replay.contacts(frame);
    this.contacts = contacts;
    const entries = entriesOf(this.replay, frame, contacts);
    this.entries = new Map(entries.map((entry) => [entry.i * contacts.count + entry.j, entry]));
    const blocks = `${counted(entries.length, "entry", "entries")} on and above the diagonal`;
    const which = this.replays.length > 1 ? ` of run ${this.run + 1}` : "";
    this.title.textContent = contacts.count
      ? `A = J M⁻¹ Jᵀ of the normals${which} at t = ${quantity(this.replay.time[frame], "s")}: ${counted(contacts.count, "contact")}, ${blocks}. Stronger colour: larger.`
      : `No contacts${which} at t = ${quantity(this.replay.time[frame], "s")}.`;
    this.paint(entries, contacts.count);
    this.mark();
  }

  /** The middle of an entry on the page, for tests and pointers. */
  placeOf(i: number, j: number): { x: number; y: number } {
    const box = this.marks.getBoundingClientRect();
    const cell = box.width / Math.max(1, this.contacts?.count ?? 1);
    return { x: box.left + (j + 0.5) * cell, y: box.top + (i + 0.5) * cell };
  }

  private paint(entries: Entry[], count: number): void {
    const size = Math.max(1, Math.min(count, MOST_PIXELS));
    this.canvas.width = this.canvas.height = size;
    const context = this.canvas.getContext("2d")!;
    const image = context.createImageData(size, size);
    const largest = entries.reduce((most, { value }) => Math.max(most, Math.abs(value)), 0) || 1;
    const [red, green, blue] = theme().dark ? [140, 200, 245] : [0, 80, 140];
    for (const { i, j, value } of entries) {
      const depth = Math.log10(Math.abs(value) / largest + 1e-12) / DECADES;
      const shade = Math.round(255 * Math.max(0.18, 1 + depth));
      for (const [row, column] of [
        [i, j],
        [j, i],
      ]) {
        const at = 4 * (Math.floor((row * size) / count) * size + Math.floor((column * size) / count));
        if (image.data[at + 3] >= shade) continue;
        image.data.set([red, green, blue, shade], at);
      }
    }
    context.putImageData(image, 0, 0);
  }

  /** Marks rows and columns of what is pointed at. */
  private mark(): void {
    const side = this.marks.clientWidth;
    if (!this.contacts || side === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    this.marks.width = this.marks.height = side * ratio;
    const context = this.marks.getContext("2d")!;
    const { count } = this.contacts;
    const cell = (side * ratio) / Math.max(1, count);
    context.fillStyle = theme().dark ? "rgba(245, 207, 122, 0.35)" : "rgba(230, 159, 0, 0.28)";
    for (const i of this.rows()) {
      const thick = Math.max(cell, 1.5);
      context.fillRect(0, i * cell, side * ratio, thick);
      context.fillRect(i * cell, 0, thick, side * ratio);
    }
  }

  /** Contacts to mark: those pointed at, else those of the bodies pointed at or chosen. */
  private rows(): number[] {
    const { hoveredBodies, hoveredRun, body } = this.selection;
    const hovered = this.selection.contactsOf(this.run);
    if (hovered.length) return [...hovered];
    const bodies = hoveredBodies.length && hoveredRun === this.run ? hoveredBodies : body >= 0 ? [body] : [];
    const { contacts } = this;
    if (!contacts || !bodies.length) return [];
    const rows = Array.from({ length: contacts.count }, (_, i) => i);
    return rows.filter((i) => bodies.includes(contacts.a[i]) || bodies.includes(contacts.b[i]));
  }

  private point(event: PointerEvent): void {
    const { contacts } = this;
    if (!contacts?.count) return;
    const box = this.marks.getBoundingClientRect();
    const index = (offset: number): number =>
      Math.max(0, Math.min(contacts.count - 1, Math.floor((offset / box.width) * contacts.count)));
    const [i, j] = [index(event.clientY - box.top), index(event.clientX - box.left)];
    const entry = this.entries.get(Math.min(i, j) * contacts.count + Math.max(i, j));
    const bodies = i === j ? [contacts.a[i], contacts.b[i]] : sharedBodies(contacts, i, j);
    this.selection.hover(bodies, i === j ? [i] : [i, j], this.run);
    this.told.textContent = this.sentence(i, j, entry);
  }

  private sentence(i: number, j: number, entry: Entry | undefined): string {
    const { contacts, replay } = this;
    if (!contacts) return "";
    const name = (k: number): string =>
      `contact ${k} (${replay.names[contacts.a[k]]} on ${replay.names[contacts.b[k]]})`;
    if (i === j) return `${name(i)}: A = ${quantity(entry?.value ?? 0, "1/kg")}`;
    if (!entry) return `${name(i)} and ${name(j)} share no body that moves: 0`;
    const shared = sharedBodies(contacts, i, j).map((body) => replay.names[body]);
    return `${name(i)} and ${name(j)} share ${shared.join(" and ")}: A = ${quantity(entry.value, "1/kg")}`;
  }
}
