/** What the run's figures are worth, in words: the step shown, the worst step and why, and what the page keeps. */

import { Calm } from "../calm";
import type { Clock } from "../clock";
import type { Explained } from "../data/payload";
import type { Replay } from "../data/replay";
import { impactOf, isSoft, solverOf } from "../data/settings";
import { button, element, facts } from "../dom";
import { bytes, counted, figure, quantity } from "../format";
import type { Selection } from "../selection";

const STOPS = ["within its tolerance", "out of iterations", "out of factorisations"];

/** See the file's head. */
export class CertificatePanel {
  readonly root = element("div", { class: "certificate" });
  private readonly steps: HTMLElement[];
  /** A step that was asked for, by its run and row, and the frame that was shown for it. */
  private asked: { run: number; row: number; frame: number } | undefined;

  constructor(
    private readonly replays: readonly Replay[],
    private readonly clock: Clock,
    private readonly selection: Selection,
  ) {
    const many = replays.length > 1;
    const which = (run: number): string => (many ? ` of run ${run + 1}` : "");
    this.steps = replays.map(() => element("div"));
    this.steps.forEach((step, run) => {
      this.root.append(element("h3", {}, `The step shown${which(run)}`), step);
    });
    replays.forEach((replay, run) => {
      this.root.append(element("h3", {}, `The worst step${which(run)}`), this.worst(replay, run));
      this.root.append(element("h3", {}, `The run${which(run)}`), runFacts(replay));
      this.root.append(element("h3", {}, `What this page keeps${which(run)}`), keptFacts(replay));
    });
    clock.onMove(new Calm(() => this.show()).ask);
    this.show();
  }

  /** Tells of the step that ended at the frame shown, or of the one that was asked for. */
  show(): void {
    if (this.root.hidden) return;
    if (this.asked?.frame !== this.clock.frame) this.asked = undefined;
    this.replays.forEach((replay, run) => {
      const asked = this.asked?.run === run ? this.asked.row : undefined;
      this.steps[run].replaceChildren(...this.told(replay, asked));
    });
  }

  private told(replay: Replay, asked: number | undefined): HTMLElement[] {
    const { time } = this.clock;
    const moments = replay.steps.time;
    if (asked !== undefined) {
      const apart = Math.abs(moments[asked] - time) > 1e-9 * Math.max(1, Math.abs(time));
      const note = `The scene shows the frame nearest to it, t = ${figure(time, 5)} s.`;
      const said = apart ? [element("p", { class: "hint" }, note)] : [];
      return [...this.sentences(replay, asked), ...said, ...this.explained(replay, asked)];
    }
    const row = moments.length ? replay.stepAt(time) : -1;
    if (row < 0 || time < moments[0] * (1 - 1e-9))
      return [element("p", { class: "hint" }, "The initial state: no step has been taken.")];
    return [...this.sentences(replay, row), ...this.explained(replay, row)];
  }

  private sentences(replay: Replay, row: number): HTMLElement[] {
    const read = (name: string): number => replay.steps.column(name)?.[row] ?? Number.NaN;
    const pair = (name: string): string => this.pair(replay, name, row);
    const every = replay.table.kept.steps_per_point;
    const span =
      every > 1 ? `The ${every} steps around step ${read("number") + 1}` : `Step ${read("number") + 1}`;
    const residual = read("residual");
    const tolerance = Number(replay.table.settings.tolerance);
    const how = isSoft(replay.table)
      ? "soft springs hold them, and no solve aims at a tolerance"
      : `${solverOf(replay.table)} took ${counted(read("iterations"), "iteration")} and ended ${STOPS[read("stop")] ?? ""}`;
    const judged = tolerance > 0 && !isSoft(replay.table);
    const told = [
      `${span}, up to t = ${figure(replay.steps.time[row], 5)} s: ${counted(read("contacts"), "contact")}; ${how}.`,
      `The answer is off the laws of contact by ${quantity(residual, "m/s", 3)}${pair("worst")}${
        judged
          ? `, ${residual <= tolerance ? "within" : "above"} the tolerance of ${quantity(tolerance, "m/s", 3)}`
          : ""
      }.`,
    ];
    const gap = read("deepest_gap");
    if (gap < 0) told.push(`Deepest overlap: ${quantity(-gap, "m", 3)}${pair("deepest")}.`);
    told.push(`Energy books since the start close to ${quantity(Math.abs(read("ledger_closure")), "J", 3)}.`);
    return told.map((text) => element("p", {}, text));
  }

  /** Why, and the certificate, of the step that ended at the frame shown or at the nearest frame that is told. */
  private explained(replay: Replay, row: number): HTMLElement[] {
    const { words } = replay.table;
    const at = replay.steps.column("number")?.[row] ?? row;
    if (at === words.step && words.certificate.length)
      return [element("h4", {}, "Why"), ...explanation(words)];
    const numbers = Object.keys(words.steps).map(Number);
    if (!numbers.length) return [];
    const step = numbers.reduce((best, n) => (Math.abs(n - at) < Math.abs(best - at) ? n : best));
    const own = element("h4", {}, step === at ? "Why" : `Why, at step ${step + 1}`);
    return [own, ...explanation(words.steps[step])];
  }

  /** The two bodies of a step's extreme contact, in words. */
  private pair(replay: Replay, name: string, row: number): string {
    const pairs = replay.steps.column(name);
    if (!pairs || pairs[2 * row] < 0) return "";
    return `, worst between ${replay.names[pairs[2 * row]]} and ${replay.names[pairs[2 * row + 1]]}`;
  }

  private worst(replay: Replay, run: number): HTMLElement {
    const { worst, words } = replay.table;
    const root = element("div");
    if (worst.step < 0) {
      root.append(element("p", {}, "No step has a residual."));
      return root;
    }
    const between = worst.between ? ` between ${worst.between[0]} and ${worst.between[1]}` : "";
    const text = `Step ${worst.step + 1}, t = ${figure(worst.time ?? 0, 5)} s: residual ${worst.value === null ? "not finite" : quantity(worst.value, "m/s", 3)}${between}.`;
    root.append(element("p", {}, text));
    root.append(button("show it", "show the worst step", () => this.jump(replay, run)));
    root.append(...explanation(words));
    if (words.note) root.append(element("p", { class: "hint" }, words.note));
    return root;
  }

  private jump(replay: Replay, run: number): void {
    const { worst } = replay.table;
    this.clock.pause();
    this.clock.seek(worst.time ?? 0);
    // frames are fewer than steps: the step itself is told, whichever frame is nearest
    this.asked = { run, row: replay.stepAt(worst.time ?? 0), frame: this.clock.frame };
    this.show();
    this.root.scrollTop = 0;
    const bodies = (worst.between ?? [])
      .map((name) => replay.names.indexOf(name))
      .filter((body) => body >= 0);
    this.selection.hover(bodies, [], run);
  }
}

/** Findings with their remedies, then the certificate. */
function explanation(told: Explained): HTMLElement[] {
  const found = told.findings.map(([, finding, remedy]) =>
    element("p", { class: "finding" }, finding, remedy ? element("em", {}, ` → ${remedy}`) : ""),
  );
  if (!told.certificate.length) return found;
  const lines = told.certificate.map(([name, value, unit]): [string, string] => [
    name,
    quantity(value, unit, 3),
  ]);
  return [...found, facts(lines)];
}

function runFacts(replay: Replay): HTMLElement {
  const { table } = replay;
  const deepest = table.deepest.value ?? 0;
  return facts([
    ["scene", table.title],
    ["bodies", replay.bodies.toLocaleString("en")],
    ["steps", `${table.kept.steps.toLocaleString("en")} of ${quantity(table.dt, "s")}`],
    ["scheme", String(table.settings.scheme ?? "fixed_step")],
    ["solver", solverOf(table)],
    ["impact law", impactOf(table)],
    [
      "tolerance",
      Number(table.settings.tolerance) > 0 ? quantity(Number(table.settings.tolerance), "m/s") : "–",
    ],
    ["status", table.status],
    ["worst residual", table.worst.value === null ? "not finite" : quantity(table.worst.value, "m/s", 3)],
    ["energy closure", quantity(table.energy_closure, "J", 3)],
    ["deepest overlap", quantity(deepest, "m", 3)],
    ["time per step", table.ms_per_step === null ? "–" : quantity(table.ms_per_step, "ms", 3)],
    ["made by", `carom ${table.carom}`],
  ]);
}

function keptFacts(replay: Replay): HTMLElement {
  const { table } = replay;
  const { kept } = table;
  return facts([
    ["frames", `${kept.frames.toLocaleString("en")} of ${kept.of_frames.toLocaleString("en")}`],
    ["contacts, velocities", `at ${kept.details.toLocaleString("en")} frames`],
    ["plots", kept.steps_per_point > 1 ? `a point per ${kept.steps_per_point} steps` : "every step"],
    ["positions", `rounded by at most ${quantity(table.error.position, "m", 2)}`],
    ["rotations", `rounded by at most ${quantity(table.error.rotation, "rad", 2)}`],
    ["velocities, impulses", "rounded to 11 bits (5·10⁻⁴)"],
    ["size", bytes(replay.payload.packed)],
  ]);
}
