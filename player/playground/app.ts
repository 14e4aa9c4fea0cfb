/** The playground: a scene that is computed while it is looked at, in the parts of the replay page. */

import { SPEEDS } from "../src/clock";
import { button, choice, element } from "../src/dom";
import { counted, quantity } from "../src/format";
import { takes } from "../src/keyboard";
import { BodyPanel } from "../src/panels/body";
import { DrawingControls } from "../src/panels/drawing";
import { MatrixPanel } from "../src/panels/matrix";
import { Tabs } from "../src/panels/tabs";
import { SceneView } from "../src/scene/view";
import { Selection } from "../src/selection";
import { apply, switchTheme } from "../src/theme";
import { Controls } from "./controls";
import { letDrag } from "./drag";
import { type Engine, Restarted } from "./engine";
import { Framing } from "./framing";
import { type About, LiveClock, LiveReplay } from "./live";
import { isMesh, readMesh, SUFFIXES, type Triangles } from "./meshes";
import { LivePlots } from "./plots";
import { TEXTS } from "./scenes";
import { packed, type Shared } from "./share";

/** Time that steps may take of a frame of the page [ms]. */
const BUDGET = 12;
/** Panels other than the scene are brought up to date this often [ms]. */
const OFTEN = 200;

/** What belongs to one loaded scene. */
interface Session {
  live: LiveReplay;
  clock: LiveClock;
  view: SceneView;
  plots: LivePlots;
  matrix: MatrixPanel;
  controls: Controls;
  told: HTMLElement;
  framing: Framing;
}

/** See the file's head. */
export class Playground {
  session: Session | undefined;
  /** What was loaded, and what was changed since. */
  state: Shared = {};
  private readonly header = element("header");
  private readonly main = element("div", { class: "session" });
  private readonly complaint = element("p", { class: "complaint", role: "alert" });
  private readonly text = element("textarea", {
    class: "scene-text",
    spellcheck: "false",
    "aria-label": "scene file, TOML or JSON",
  });
  private readonly editor: HTMLElement;
  private readonly scenes: HTMLSelectElement;
  /** Mesh files that were opened or dropped, by name. */
  private readonly given: Record<string, Triangles> = {};
  private last = 0;
  private owed = 0;
  private shown = 0;
  /** Whether steps were taken that the panels do not show yet. */
  private stale = false;
  /** What a step takes [ms]. */
  private perStep = 1;

  constructor(
    host: HTMLElement,
    private readonly engine: Engine,
  ) {
    this.scenes = this.sceneChoice();
    this.editor = this.sceneEditor();
    this.complaint.hidden = true;
    this.header.append(
      element("h1", {}, "carom playground"),
      this.scenes,
      element("p", { class: "told" }),
      element(
        "div",
        { class: "end" },
        button("share", "a link that holds this state", () => void this.share()),
        button("◐", "light or dark", () => switchTheme()),
      ),
    );
    host.append(this.header, this.complaint, this.main);
    host.addEventListener("dragover", (event) => event.preventDefault());
    host.addEventListener("drop", (event) => void this.dropped(event));
    window.addEventListener("keydown", (event) => this.key(event));
    requestAnimationFrame(this.tick);
  }

  /** Opens what a link holds, or the first scene. */
  async open(read: () => Promise<Shared | undefined>): Promise<void> {
    let wrong: unknown;
    try {
      const shared = await read();
      if (shared && !this.load(shared)) wrong = new Error(this.complaint.textContent ?? "");
    } catch (error) {
      wrong = error;
    }
    if (!this.session) this.load({ name: TEXTS[0].name, text: TEXTS[0].text! });
    if (wrong) this.complain(wrong);
  }

  /** Loads a scene; what is refused leaves the one that is there. Whether it was loaded. */
  load(state: Shared): boolean {
    const { name, text, snapshot, settings, own } = state;
    const meshes = text === undefined ? {} : { ...this.namedIn(text), ...state.meshes };
    const known = name !== undefined && text === undefined && snapshot === undefined;
    try {
      const about = this.engine.ask({
        op: "load",
        ...(known ? { name } : text !== undefined ? { text, meshes } : { snapshot }),
        settings: settings ?? {},
        ...(own ? { own } : {}),
      }) as About;
      this.state = { ...state, settings: { ...settings } };
      if (Object.keys(meshes).length > 0) this.state.meshes = meshes;
      this.show(about);
      if (state.friction !== undefined || state.restitution !== undefined) {
        this.coefficients(state.friction ?? null, state.restitution ?? null);
      }
      this.complain(undefined);
      // none is chosen where the scene is a user's own: the list must not name another, and any can be chosen then
      this.scenes.value = name ?? "";
      if (text !== undefined) this.text.value = text;
      else this.text.value = `# ${about.name || "a run from a link"}: made by the engine, it has no text.`;
      return true;
    } catch (error) {
      this.complain(error);
      this.scenes.value = this.state.name ?? "";
      return false;
    }
  }

  /** Begins the scene again. */
  reset(): void {
    this.load(this.state);
  }

  /** Takes steps at once and shows where they lead; for programs and single steps. */
  run(count: number): void {
    const { session } = this;
    if (!session) return;
    try {
      const begun = performance.now();
      const refused = this.engine.steps(count);
      if (count > 0) this.perStep += 0.2 * ((performance.now() - begun) / count - this.perStep);
      if (refused) {
        session.clock.pause();
        this.complain(new Error(refused));
      }
      session.live.show(this.engine.frame(), count > 0 && !refused);
      session.clock.advance();
      this.stale = true;
    } catch (error) {
      this.lost(error);
    }
  }

  /** Changes settings while the scene runs. */
  set(settings: Record<string, unknown>): void {
    const { session } = this;
    if (!session) return;
    try {
      const told = this.engine.ask({ op: "set", settings }) as Pick<About, "settings" | "solver" | "impact">;
      this.state.settings = { ...this.state.settings, ...settings };
      Object.assign(session.live.about, told);
      Object.assign(session.live.table.settings, told.settings);
      this.complain(undefined);
    } catch (error) {
      this.complain(error);
    }
    session.controls.show(session.live.about);
    this.tell();
  }

  /** Gives all bodies coefficients; null is the scene's own. */
  coefficients(friction: number | null, restitution: number | null): void {
    try {
      this.engine.ask({ op: "coefficients", friction, restitution });
      const { friction: _, restitution: __, ...state } = this.state;
      this.state = {
        ...state,
        ...(friction === null ? {} : { friction }),
        ...(restitution === null ? {} : { restitution }),
      };
    } catch (error) {
      this.complain(error);
    }
  }

  /** One number for the bits of the motion; for programs. */
  fingerprint(): string {
    return this.engine.ask({ op: "fingerprint" }) as string;
  }

  /** The address that holds this state: the scene at its beginning, later the whole state. */
  async link(): Promise<string> {
    const { live } = this.session!;
    const state = live.taken === 0 ? this.state : this.snapshot(live);
    return location.href.split("#")[0] + (await packed(state));
  }

  /** The whole state, with what the sliders of coefficients show. */
  private snapshot(live: LiveReplay): Shared {
    const { friction, restitution } = this.state;
    const changed = friction !== undefined || restitution !== undefined;
    return {
      snapshot: this.engine.ask({ op: "snapshot" }) as string,
      ...(changed ? { friction, restitution, own: live.about.own } : {}),
    };
  }

  /** What a pointer does with the hand; for programs too. */
  readonly hand = {
    hold: (body: number, place: number[]): boolean => {
      const held = this.engine.ask({ op: "hold", body, place }) as boolean;
      if (held && !this.session?.clock.playing) this.session?.clock.play();
      return held;
    },
    pull: (place: number[]): void => void this.engine.ask({ op: "pull", place }),
    release: (): void => void this.engine.ask({ op: "release" }),
  };

  private show(about: About): void {
    const playing = this.session?.clock.playing === true;
    // a page may have only so many drawings
    this.session?.view.stage.canvas.getContext("webgl2")?.getExtension("WEBGL_lose_context")?.loseContext();
    const live = new LiveReplay(about);
    const clock = new LiveClock(live.time);
    this.engine.steps(0);
    live.show(this.engine.frame(), false);
    const selection = new Selection();
    const place = element("div", { class: "scene" });
    const plots = new LivePlots(live);
    const matrix = new MatrixPanel([live.asReplay], clock.asClock, selection);
    const body = new BodyPanel([live.asReplay], clock.asClock, selection);
    const controls = new Controls(about, {
      set: (settings) => this.set(settings),
      coefficients: (friction, restitution) => this.coefficients(friction, restitution),
    });
    controls.showCoefficients(this.state.friction ?? null, this.state.restitution ?? null);
    const tabs = new Tabs([
      { name: "Controls", root: controls.root },
      { name: "Plots", root: plots.root, shown: () => plots.show() },
      { name: "Matrix", root: matrix.root, shown: () => matrix.show(true) },
      { name: "Body", root: body.root, shown: () => body.show() },
      { name: "Scene file", root: this.editor },
    ]);
    const told = element("output", { class: "figures" });
    this.main.replaceChildren(place, this.transport(clock, told), tabs.root);
    const view = new SceneView(place, live.asReplay, undefined, clock.asClock, selection);
    place.append(new DrawingControls(view).root);
    letDrag(place, view, live, this.hand);
    const framing = new Framing(live, view, selection);
    this.session = { live, clock, view, plots, matrix, controls, told, framing };
    this.owed = 0;
    apply();
    if (playing) clock.play();
    this.tell();
  }

  private transport(clock: LiveClock, told: HTMLElement): HTMLElement {
    const play = button("▶", "run or pause (space)", () => clock.toggle());
    play.className = "play";
    clock.onChange(() => {
      play.textContent = clock.playing ? "❚❚" : "▶";
    });
    const speeds = SPEEDS.map((speed) => [String(speed), `${speed}×`] as const);
    return element(
      "div",
      { class: "transport" },
      button("⟲", "begin the scene again (r)", () => this.reset()),
      play,
      button("›", "one step (→)", () => clock.stepBy(1)),
      told,
      choice("speed", speeds, "1", (value) => clock.setSpeed(Number(value))),
    );
  }

  private sceneChoice(): HTMLSelectElement {
    const own = this.engine.ask({ op: "scenes" }) as { name: string; space: string; description: string }[];
    const select = element("select", { "aria-label": "scene", title: "scene" });
    const texts = element("optgroup", { label: "with a text" });
    for (const { name, label } of TEXTS) texts.append(element("option", { value: name }, label));
    select.append(texts);
    for (const space of ["planar", "spatial"]) {
      const group = element("optgroup", { label: space === "planar" ? "of the plane" : "of space" });
      for (const { name, description } of own.filter((scene) => scene.space === space))
        group.append(element("option", { value: name, title: description }, name.replaceAll("_", " ")));
      select.append(group);
    }
    select.addEventListener("change", () => {
      const known = TEXTS.find(({ name }) => name === select.value);
      this.load(known ? { name: known.name, text: known.text! } : { name: select.value });
    });
    return select;
  }

  private sceneEditor(): HTMLElement {
    const file = element("input", {
      type: "file",
      accept: `.toml,.json,${SUFFIXES}`,
      multiple: "",
      "aria-label": "scene file and its mesh files",
    });
    file.addEventListener("change", () => {
      void this.opened([...(file.files ?? [])]);
      file.value = ""; // the same file, changed on the disk, can be opened again
    });
    return element(
      "div",
      { class: "editor" },
      element(
        "p",
        { class: "hint" },
        "A scene file, TOML or JSON: write, paste, open or drop one, and the mesh files that it names.",
      ),
      this.text,
      element(
        "div",
        { class: "row" },
        button("run this scene", "load the text", () => this.load({ text: this.text.value })),
        file,
      ),
    );
  }

  /** Takes a scene file, mesh files, or both; meshes alone complete the text that is there. */
  async opened(files: readonly File[]): Promise<void> {
    if (files.length === 0) return;
    try {
      for (const file of files.filter(({ name }) => isMesh(name)))
        this.given[file.name] = await readMesh(file);
      const scene = files.find(({ name }) => !isMesh(name));
      if (scene) this.text.value = await textOf(scene);
    } catch (error) {
      this.complain(error);
      return;
    }
    const text = this.text.value;
    const unused = files.find(({ name }) => isMesh(name) && !text.includes(name));
    if (this.load({ text }) && unused) this.note(`The scene names no mesh '${unused.name}'.`);
  }

  /** Those of the mesh files given that a scene's text may mean. */
  private namedIn(text: string): Record<string, Triangles> {
    return Object.fromEntries(Object.entries(this.given).filter(([name]) => text.includes(name)));
  }

  private async dropped(event: DragEvent): Promise<void> {
    event.preventDefault();
    await this.opened([...(event.dataTransfer?.files ?? [])]);
  }

  private async share(): Promise<void> {
    const link = await this.link();
    history.replaceState(null, "", link);
    const kilobytes = (link.length / 1000).toFixed(1);
    const copied = await navigator.clipboard?.writeText(link).then(
      () => true,
      () => false,
    );
    const where = copied ? "copied, and in the address bar" : "in the address bar";
    this.note(`Link of ${kilobytes} kB: ${where}. It holds the state; nothing was sent.`);
  }

  private key(event: KeyboardEvent): void {
    const { target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || takes(target, event.key)) return;
    const clock = this.session?.clock;
    const acts: Record<string, () => void> = {
      " ": () => clock?.toggle(),
      ArrowRight: () => clock?.stepBy(event.shiftKey ? 10 : 1),
      r: () => this.reset(),
      d: () => switchTheme(),
    };
    const act = acts[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  private readonly tick = (now: number): void => {
    requestAnimationFrame(this.tick);
    const { session } = this;
    const passed = Math.min(now - this.last, 100);
    this.last = now;
    if (!session) return;
    const { clock, live } = session;
    let steps = clock.pending;
    clock.pending = 0;
    if (clock.playing) {
      const { dt } = live.about.settings;
      const most = Math.max(1, Math.floor(BUDGET / Math.max(this.perStep, 1e-3)));
      this.owed = Math.min(this.owed + (clock.speed * passed) / 1000 / dt, 2 * most + 1);
      steps = Math.min(Math.floor(this.owed), most);
      this.owed -= steps;
    }
    if (steps > 0) this.run(steps);
    if (now - this.shown < OFTEN || !this.stale) return;
    this.shown = now;
    this.stale = false;
    session.framing.keep();
    session.plots.show();
    session.matrix.show(true);
    this.tell();
  };

  /** Figures of the present moment. */
  private tell(): void {
    const { session } = this;
    if (!session) return;
    const { live } = session;
    const { settings, solver } = live.about;
    const scheme = settings.scheme === "soft_step" ? "soft_step" : `${settings.scheme}, ${solver}`;
    this.header.querySelector(".told")!.textContent =
      `${counted(live.bodies, "body", "bodies")}  ·  ${scheme}  ·  dt ${quantity(settings.dt, "s", 3)}`;
    const asleep = live.asleep;
    session.told.textContent = [
      `${live.time[0].toFixed(3)} s`,
      `${quantity(this.perStep, "ms", 2)} per step`,
      `residual ${quantity(live.residual, "m/s", 2)}`,
      `books close to ${quantity(live.books.closure, "J", 2)}`,
      ...(asleep > 0 ? [`${asleep} asleep`] : []),
    ].join("  ·  ");
  }

  private note(text: string): void {
    this.complaint.textContent = text;
    this.complaint.hidden = text === "";
    this.complaint.classList.remove("wrong");
  }

  private complain(error: unknown): void {
    this.note(error === undefined ? "" : error instanceof Error ? error.message : String(error));
    this.complaint.classList.toggle("wrong", error !== undefined);
    if (error instanceof Restarted) this.lost(error);
  }

  /** An engine that was started again runs the scene from its beginning. */
  private lost(error: unknown): void {
    const { state } = this;
    this.session?.clock.pause();
    try {
      this.load(state);
    } finally {
      this.note(error instanceof Error ? error.message : String(error));
      this.complaint.classList.add("wrong");
    }
  }
}

async function textOf(file: File): Promise<string> {
  try {
    return await file.text();
  } catch {
    throw new Error(`'${file.name}' cannot be read; open or drop files, not their folder`);
  }
}
