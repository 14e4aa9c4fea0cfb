/** Sliders and choices of the run: what they show is what the engine has. */

import { choice, element } from "../src/dom";
import { figure } from "../src/format";
import type { About } from "./live";

type Settings = About["settings"];

/** What a change asks of the page. */
export interface Changes {
  set(settings: Record<string, unknown>): void;
  coefficients(friction: number | null, restitution: number | null): void;
}

const SCHEMES = ["fixed_step", "events", "soft_step"] as const;
const SOLVERS = [
  "pgs",
  "sequential",
  "pgs_matrix",
  "direct",
  "lemke",
  "nncg",
  "apgd",
  "enumeration",
  "exact",
  "auto",
] as const;
const LAWS = ["newton", "poisson", "moreau", "sequential", "generalized_reflections"] as const;
const OWN = "";

/** See the file's head. */
export class Controls {
  readonly root = element("div", { class: "controls" });
  friction: number | null = null;
  restitution: number | null = null;
  private readonly coefficients: (() => void)[] = [];
  private readonly follow: ((settings: Settings, about: About) => void)[] = [];

  constructor(
    about: About,
    private readonly changes: Changes,
  ) {
    this.root.append(
      this.coefficient("friction", "friction of all bodies [1]", 1.5),
      this.coefficient("restitution", "restitution of all bodies [1]", 1),
      this.power("dt", "length of a step [s]", "s", [-4, -1]),
      this.named("scheme", "time-stepping scheme", SCHEMES, undefined),
      this.named("solver", "contact solver", SOLVERS, "the scheme's own"),
      this.power("iterations", "most iterations of a solve [1]", "", [0, 4], true),
      this.power("tolerance", "residual at which a solve stops [m/s]", "m/s", [-12, -1]),
      this.named("impact", "law of impacts", LAWS, "the scheme's own"),
      this.sleep(),
    );
    this.show(about);
  }

  /** Shows the coefficients that all bodies have; null is the scene's own. */
  showCoefficients(friction: number | null, restitution: number | null): void {
    [this.friction, this.restitution] = [friction, restitution];
    for (const each of this.coefficients) each();
  }

  /** Shows the settings that the engine has. */
  show(about: About): void {
    for (const each of this.follow) each(about.settings, about);
  }

  private row(name: string, title: string, ...parts: HTMLElement[]): HTMLElement {
    return element("label", { class: "control", title }, element("span", {}, name), ...parts);
  }

  /** A coefficient of all bodies, or the scene's own at the far left. */
  private coefficient(name: "friction" | "restitution", title: string, most: number): HTMLElement {
    const slider = element("input", {
      type: "range",
      min: "-0.05",
      max: String(most),
      step: "0.05",
      value: "-0.05",
      "aria-label": title,
      "data-control": name,
    });
    const told = element("output", {}, "scene's");
    const tell = (): void => {
      const value = this[name];
      told.value = value === null ? "scene's" : figure(value, 3);
    };
    slider.addEventListener("input", () => {
      this[name] = Number(slider.value) < 0 ? null : Number(slider.value);
      tell();
      this.changes.coefficients(this.friction, this.restitution);
    });
    this.coefficients.push(() => {
      slider.value = String(this[name] ?? slider.min);
      tell();
    });
    return this.row(name, title, slider, told);
  }

  /** A setting on a logarithmic slider, a tenth of a power of ten per step. */
  private power(
    name: "dt" | "iterations" | "tolerance",
    title: string,
    unit: string,
    [low, high]: [number, number],
    whole = false,
  ): HTMLElement {
    const slider = element("input", {
      type: "range",
      min: String(low),
      max: String(high),
      step: "0.1",
      "aria-label": title,
      "data-control": name,
    });
    const told = element("output");
    slider.addEventListener("input", () => {
      const value = 10 ** Number(slider.value);
      this.changes.set({ [name]: whole ? Math.round(value) : Number(value.toPrecision(3)) });
    });
    this.follow.push((settings) => {
      if (settings[name] > 0) slider.value = String(Math.log10(settings[name]));
      told.value = `${figure(settings[name], 3)} ${unit}`;
    });
    return this.row(name, title, slider, told);
  }

  /** Whether bodies that rest fall asleep, which soft steps alone can do. */
  private sleep(): HTMLElement {
    const box = element("input", { type: "checkbox", "data-control": "sleeping" });
    const told = element("output");
    let soft: Settings["soft"];
    box.addEventListener("change", () => this.changes.set({ soft: { ...soft, sleeping: box.checked } }));
    this.follow.push((settings) => {
      soft = settings.soft;
      box.checked = soft?.sleeping === true;
      box.disabled = settings.scheme !== "soft_step";
      told.value = box.disabled ? "soft_step only" : "";
    });
    return this.row(
      "sleep",
      "bodies that rest fall asleep, and cost nothing until something stirs them",
      box,
      told,
    );
  }

  private named(
    name: "scheme" | "solver" | "impact",
    title: string,
    values: readonly string[],
    own: string | undefined,
  ): HTMLElement {
    const options = values.map((value) => [value, value] as const);
    const listed = own === undefined ? options : [[OWN, own] as const, ...options];
    const select = choice(title, listed, OWN, (value) => {
      const asked: Record<string, unknown> = { [name]: value === OWN ? null : value };
      // soft steps have a solver and a law of their own, and refuse others
      if (value === "soft_step") Object.assign(asked, { solver: null, impact: null });
      this.changes.set(asked);
    });
    select.dataset.control = name;
    this.follow.push((settings, about) => {
      const value = settings[name];
      select.value = value === null || value === undefined ? OWN : String(value);
      select.disabled = settings.scheme === "soft_step" && name !== "scheme";
      if (own !== undefined && name !== "scheme")
        select.options[0].text = select.disabled ? own : `${own}: ${about[name]}`;
    });
    return this.row(name, title, select);
  }
}
