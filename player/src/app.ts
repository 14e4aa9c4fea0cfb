/** The page: puts scene, time, plots and panels together, and is what programs outside talk to. */

import { Clock } from "./clock";
import type { Payload } from "./data/payload";
import { Replay } from "./data/replay";
import { namesOf, wayOf } from "./data/settings";
import { button, choice, element, facts } from "./dom";
import { type FilmSettings, film } from "./film";
import { counted, quantity } from "./format";
import { KEYS, listenToKeys } from "./keyboard";
import { BodyPanel } from "./panels/body";
import { CertificatePanel } from "./panels/certificate";
import { DrawingControls } from "./panels/drawing";
import { MatrixPanel } from "./panels/matrix";
import { PlotsPanel } from "./panels/plots";
import { Tabs } from "./panels/tabs";
import { Transport } from "./panels/transport";
import { chartsOf } from "./plots/charts";
import { type Compare, SceneView } from "./scene/view";
import { Selection } from "./selection";
import { apply, switchTheme } from "./theme";

/** See the file's head. */
export class App {
  readonly replays: Replay[];
  readonly clock: Clock;
  readonly selection = new Selection();
  readonly view: SceneView;
  readonly plots: PlotsPanel;
  readonly matrix: MatrixPanel;
  readonly tabs: Tabs;
  private readonly drawing: DrawingControls;

  constructor(host: HTMLElement, payloads: Payload[]) {
    this.replays = payloads.map((payload) => new Replay(payload));
    const [replay, second] = this.replays;
    this.clock = new Clock(replay.time);
    const place = element("div", { class: "scene" });
    const transport = new Transport(this.clock, replay.end);
    this.plots = new PlotsPanel(chartsOf(replay, second), this.clock);
    this.matrix = new MatrixPanel(this.replays, this.clock, this.selection);
    const body = new BodyPanel(this.replays, this.clock, this.selection);
    const certificate = new CertificatePanel(this.replays, this.clock, this.selection);
    this.tabs = new Tabs([
      { name: "Plots", root: this.plots.root, shown: () => this.plots.showTime() },
      { name: "Body", root: body.root, shown: () => body.show() },
      { name: "Matrix", root: this.matrix.root, shown: () => this.matrix.show() },
      { name: "Certificate", root: certificate.root, shown: () => certificate.show() },
    ]);
    const header = element("header");
    host.append(header, place, transport.root, this.tabs.root);
    this.view = new SceneView(place, replay, second, this.clock, this.selection);
    this.drawing = new DrawingControls(this.view);
    place.append(this.drawing.root);
    if (replay.table.note) place.append(element("p", { class: "note" }, replay.table.note));
    header.append(...this.headerParts(replay, second));
    this.showChosenBody();
    listenToKeys(this.clock, {
      follow: () => this.selection.follow(this.selection.isFollowed ? -1 : this.selection.body),
      reset: () => this.view.stage.reset(),
      seeThrough: () => this.drawing.toggleThrough(),
      theme: () => switchTheme(),
      unchoose: () => this.selection.choose(-1),
    });
    apply();
  }

  /** Shows the frame nearest to a moment [s]; for programs. */
  seek(time: number): void {
    this.clock.pause();
    this.clock.seek(time);
    this.tabs.refresh();
    this.view.stage.drawFull();
  }

  /** A film as base64 of MP4; for programs. */
  film(settings: FilmSettings): Promise<string> {
    return film(this, settings);
  }

  /** Nothing but the scene, for pictures; for programs. */
  showSceneOnly(on: boolean, theme?: "light" | "dark"): void {
    document.documentElement.classList.toggle("scene-only", on);
    if (theme) switchTheme(theme);
    this.view.stage.resize();
    this.view.stage.reset();
    this.view.stage.drawFull();
  }

  private headerParts(replay: Replay, second: Replay | undefined): HTMLElement[] {
    const { table } = replay;
    const told = [
      counted(replay.bodies, "body", "bodies"),
      `${counted(table.kept.steps, "step")} of ${quantity(table.dt, "s")}`,
      wayOf(table),
      `worst residual ${table.worst.value === null ? "not finite" : quantity(table.worst.value, "m/s", 2)}`,
      `books close to ${quantity(table.energy_closure, "J", 2)}`,
    ].filter(Boolean);
    const parts: HTMLElement[] = [element("h1", { title: table.title }, baseName(table.title))];
    if (second) parts.push(this.compared(replay, second));
    parts.push(element("p", { class: "told" }, told.join("  ·  ")));
    const end = element("div", { class: "end" });
    end.append(
      button("⟲", "camera back to where it began (0)", () => this.view.stage.reset()),
      button("◐", "light or dark (d)", () => switchTheme()),
      help(),
    );
    parts.push(end);
    return parts;
  }

  private compared(replay: Replay, second: Replay): HTMLElement {
    const names = namesOf(replay.table, second.table);
    return choice(
      "how the two runs are shown",
      [
        ["ghosts", `${names[0]}, ${names[1]} as ghosts`],
        ["beside", `${names[0]} beside ${names[1]}`],
        ["first", names[0]],
        ["second", names[1]],
      ],
      "ghosts",
      (how) => this.view.setCompare(how as Compare),
    );
  }

  /** A click on a body opens its panel. */
  private showChosenBody(): void {
    let before = "";
    this.selection.onChange(() => {
      const { body, run } = this.selection;
      const now = `${run} ${body}`;
      if (now !== before && body >= 0) this.tabs.showNamed("Body");
      before = now;
    });
  }
}

/** The last part of a path. */
function baseName(title: string): string {
  return title.split(/[\\/]/).pop() || title;
}

function help(): HTMLElement {
  return element(
    "details",
    { class: "help" },
    element("summary", { title: "keys" }, "?"),
    element(
      "div",
      {},
      facts(KEYS),
      element(
        "p",
        { class: "hint" },
        "Drag turns or moves the scene, the wheel zooms. Click a plot to jump.",
      ),
    ),
  );
}
