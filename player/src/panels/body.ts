/** What is known of the body that is chosen: pose, velocity, energy, and its contacts. */

import { Calm } from "../calm";
import type { Clock } from "../clock";
import { matrixOf } from "../coupling";
import { KINDS, type Replay, STATUSES } from "../data/replay";
import { button, choice, element, facts } from "../dom";
import { figure, quantity, vector } from "../format";
import type { Selection } from "../selection";

/** Most contacts that are listed. */
const MOST = 60;
/** Most bodies that a list offers; of more, names are looked for. */
const MOST_LISTED = 200;
/** Most names that are proposed while one is written. */
const MOST_PROPOSED = 50;

/** See the file's head. */
export class BodyPanel {
  readonly root = element("div", { class: "body-panel" });
  private readonly content = element("div");
  private readonly follow: HTMLButtonElement;
  private readonly pickers: { root: HTMLInputElement | HTMLSelectElement; show(body: number): void }[];

  constructor(
    private readonly replays: readonly Replay[],
    private readonly clock: Clock,
    private readonly selection: Selection,
  ) {
    this.follow = button("follow", "let the camera follow this body (f)", () =>
      selection.follow(selection.isFollowed ? -1 : selection.body),
    );
    this.pickers = replays.map((replay) =>
      replay.bodies > MOST_LISTED ? this.searched(replay.names) : this.listed(replay.names),
    );
    const row = element("div", { class: "row" }, ...this.pickers.map(({ root }) => root), this.follow);
    if (replays.length > 1) row.prepend(this.runs());
    this.root.append(row, this.content);
    selection.onChange(() => this.show());
    clock.onMove(new Calm(() => this.show()).ask);
    this.show();
  }

  private get replay(): Replay {
    return this.replays[this.selection.run];
  }

  private get frame(): number {
    return this.selection.run === 0 ? this.clock.frame : this.replay.frameAt(this.clock.time);
  }

  /** Tells of the chosen body at the frame shown. */
  show(): void {
    const { body, run } = this.selection;
    this.follow.disabled = body < 0;
    this.follow.textContent = this.selection.isFollowed ? "following" : "follow";
    this.pickers.forEach((picker, i) => {
      picker.root.hidden = i !== run;
      picker.show(body);
    });
    if (body < 0) {
      this.content.replaceChildren(
        element("p", { class: "hint" }, "Click a body in the scene, or choose one by name."),
      );
      return;
    }
    if (this.root.hidden && this.content.childElementCount) return;
    this.content.replaceChildren(this.motion(body), this.touching(body));
  }

  /** Which run's bodies are told of. */
  private runs(): HTMLSelectElement {
    const { selection } = this;
    const list = choice(
      "run",
      [
        ["0", "run 1"],
        ["1", "run 2"],
      ],
      "0",
      (value) => {
        const name = this.replay.names[selection.body];
        const run = Number(value);
        selection.choose(name === undefined ? -1 : this.replays[run].names.indexOf(name), run);
      },
    );
    selection.onChange(() => {
      list.value = String(selection.run);
    });
    return list;
  }

  /** A list of all bodies. */
  private listed(names: readonly string[]): BodyPanel["pickers"][number] {
    const options = names.map((name, body) => [String(body), name] as const);
    const root = choice("body", [["-1", "choose a body …"], ...options], "-1", (value) =>
      this.selection.choose(Number(value)),
    );
    return {
      root,
      show: (body) => {
        root.value = String(body);
      },
    };
  }

  /** A field for a name, which proposes those that hold what was written. */
  private searched(names: readonly string[]): BodyPanel["pickers"][number] {
    const proposed = element("datalist", { id: `names-${this.replays.findIndex((r) => r.names === names)}` });
    const root = element("input", {
      type: "text",
      list: proposed.id,
      placeholder: `name of one of ${names.length.toLocaleString("en")} bodies`,
      "aria-label": "body",
      autocomplete: "off",
      spellcheck: "false",
    });
    this.root.append(proposed);
    const rows = new Map(names.map((name, row) => [name, row]));
    root.addEventListener("input", () => {
      const found: HTMLElement[] = [];
      for (let row = 0; row < names.length && found.length < MOST_PROPOSED; row++)
        if (names[row].includes(root.value)) found.push(element("option", { value: names[row] }));
      proposed.replaceChildren(...found);
      const row = rows.get(root.value);
      if (row !== undefined) this.selection.choose(row);
    });
    root.addEventListener("change", () => root.classList.toggle("wrong", !rows.has(root.value)));
    return {
      root,
      show: (body) => {
        if (body >= 0) root.classList.remove("wrong");
        if (document.activeElement === root && body < 0) return;
        const name = names[body] ?? "";
        if (root.value !== name) root.value = name;
      },
    };
  }

  private motion(body: number): HTMLElement {
    const { replay } = this;
    const { frame } = this;
    const d = replay.dimension;
    const position = new Float64Array(3);
    const quaternion = new Float64Array(4);
    replay.position(frame, body, position);
    replay.rotation(frame, body, quaternion);
    const velocity = replay.velocity(frame, body);
    const spin = replay.angularVelocity(frame, body);
    const inverse = replay.inverseMass[body];
    const rows: [string, string][] = [
      ["kind", KINDS[replay.kind[body]] + (this.sleeps(body) ? ", asleep" : "")],
      ["mass", inverse > 0 ? quantity(1 / inverse, "kg") : "∞"],
      ["centre of mass", vector(position.subarray(0, d), "m")],
      ["rotation", rotationText(quaternion, d)],
      ["velocity", `${vector(velocity, "m/s")}, speed ${quantity(Math.hypot(...velocity), "m/s", 3)}`],
      ["angular velocity", d === 2 ? quantity(spin[0], "rad/s") : vector(spin, "rad/s")],
    ];
    if (inverse > 0) {
      const kinetic = (0.5 * velocity.reduce((sum, v) => sum + v * v, 0)) / inverse;
      const gravity = replay.table.gravity;
      const height = gravity.reduce((sum, g, axis) => sum - g * position[axis], 0);
      rows.push(["kinetic energy", `${quantity(kinetic, "J")} of translation`]);
      rows.push(["", `${quantity(rotational(replay, body, quaternion, spin), "J")} of rotation`]);
      rows.push(["potential energy", quantity(height / inverse, "J")]);
    }
    return facts(rows);
  }

  private sleeps(body: number): boolean {
    const who = new Uint8Array(this.replay.bodies);
    this.replay.sleepers(this.frame, who);
    return who[body] === 1;
  }

  private touching(body: number): HTMLElement {
    const contacts = this.replay.contacts(this.frame);
    const rows: HTMLElement[] = [];
    for (let i = 0; i < contacts.count && rows.length < MOST; i++) {
      if (contacts.a[i] !== body && contacts.b[i] !== body) continue;
      const partner = contacts.a[i] === body ? contacts.b[i] : contacts.a[i];
      const row = element(
        "tr",
        {},
        element("td", {}, this.replay.names[partner]),
        element("td", {}, STATUSES[contacts.status[i]]),
        element("td", {}, figure(contacts.normalImpulse[i], 3)),
        element("td", {}, figure(contacts.gap[i], 3)),
        element("td", {}, figure(contacts.residual[i], 2)),
      );
      row.addEventListener("pointerenter", () => this.selection.hover([contacts.a[i], contacts.b[i]], [i]));
      row.addEventListener("pointerleave", () => this.selection.hover([], []));
      rows.push(row);
    }
    if (!rows.length) return element("p", { class: "hint" }, "It touches nothing at this frame.");
    const heads = ["touches", "does", "N s", "gap [m]", "off [m/s]"].map((text) =>
      element("th", { scope: "col" }, text),
    );
    const head = element("thead", {}, element("tr", {}, ...heads));
    return element("table", { class: "list" }, head, element("tbody", {}, ...rows));
  }
}

/** ½ ω · I ω [J]. */
function rotational(replay: Replay, body: number, quaternion: Float64Array, spin: Float32Array): number {
  if (replay.dimension === 2) {
    const inverse = replay.inverseInertia[body];
    return inverse > 0 ? (0.5 * spin[0] ** 2) / inverse : 0;
  }
  const turn = matrixOf(quaternion);
  const own = [0, 1, 2].map((k) => turn[k] * spin[0] + turn[3 + k] * spin[1] + turn[6 + k] * spin[2]);
  const inertia = inverted(replay.inverseInertia.subarray(9 * body, 9 * body + 9));
  let sum = 0;
  for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) sum += own[i] * inertia[3 * i + j] * own[j];
  return sum / 2;
}

/** Inverse of a symmetric 3 × 3 matrix, row by row; 0 of 0. */
function inverted(m: Float64Array): number[] {
  const minor = (i: number, j: number): number => {
    const [r, s] = [0, 1, 2].filter((k) => k !== i);
    const [p, q] = [0, 1, 2].filter((k) => k !== j);
    return (m[3 * r + p] * m[3 * s + q] - m[3 * r + q] * m[3 * s + p]) * ((i + j) % 2 ? -1 : 1);
  };
  const determinant = m[0] * minor(0, 0) + m[1] * minor(0, 1) + m[2] * minor(0, 2);
  if (determinant === 0) return new Array<number>(9).fill(0);
  return Array.from({ length: 9 }, (_, k) => minor(k % 3, Math.floor(k / 3)) / determinant);
}

/** An angle in the plane; axis and angle in space. */
function rotationText([x, y, z, w]: Float64Array, dimension: number): string {
  if (dimension === 2) {
    const angle = 2 * Math.atan2(z, w);
    return quantity(angle > Math.PI ? angle - 2 * Math.PI : angle, "rad");
  }
  const angle = 2 * Math.acos(Math.min(1, Math.abs(w)));
  const length = Math.hypot(x, y, z) * (w < 0 ? -1 : 1);
  if (Math.abs(length) < 1e-6) return "none";
  return `${quantity(angle, "rad")} about ${vector([x / length, y / length, z / length], "1", 3)}`;
}
