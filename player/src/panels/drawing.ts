/** What is drawn of contacts, and what their colours mean. */

import { choice, element, toggle } from "../dom";
import { quantity } from "../format";
import type { ColourOf } from "../scene/arrows";
import type { SceneView } from "../scene/view";
import { css, onTheme, theme } from "../theme";

const COLOURS: readonly (readonly [ColourOf, string])[] = [
  ["status", "stick, slip, take-off"],
  ["island", "island"],
  ["residual", "residual"],
];
const MEANINGS: Record<ColourOf, (tolerance: number) => [string, string][]> = {
  status: () => {
    const [apart, sticks, slips, strikes] = theme().status.map(css);
    return [
      [sticks, "sticks"],
      [slips, "slips"],
      [strikes, "strikes"],
      [apart, "takes off, apart"],
    ];
  },
  island: () => [["", "one colour per island of bodies that contacts join"]],
  residual: (tolerance) => {
    const [unknown, within, above, bad] = theme().status.map(css);
    return [
      [within, `within ${quantity(tolerance, "m/s", 2)}`],
      [above, "above"],
      [bad, "10⁴ times that, or the worst"],
      [unknown, "not known"],
    ];
  },
};

/** See the file's head. */
export class DrawingControls {
  readonly root: HTMLElement;
  private readonly legend = element("div", { class: "legend" });
  private readonly through: HTMLLabelElement;
  private colour: ColourOf = "status";

  constructor(private readonly view: SceneView) {
    this.through = toggle("see through", "let contacts show through bodies (x)", false, (on) =>
      view.setTransparent(on),
    );
    this.root = element(
      "details",
      { class: "drawing" },
      element("summary", { title: "what is drawn of contacts" }, "Contacts"),
      element(
        "div",
        { class: "drawing-list" },
        toggle("points", "draw points of contact", view.arrows.settings.points, (points) =>
          view.setArrows({ points }),
        ),
        toggle("normals", "draw normals", view.arrows.settings.normals, (normals) =>
          view.setArrows({ normals }),
        ),
        toggle("impulses", "draw impulses as arrows", true, (impulses) => view.setArrows({ impulses })),
        this.through,
        element(
          "label",
          { class: "toggle" },
          "colour ",
          choice("colour of contacts", COLOURS, "status", (to) => {
            this.colour = to as ColourOf;
            view.setArrows({ colour: this.colour });
            this.explain();
          }),
        ),
        element("label", { class: "toggle" }, "arrows ", this.lengths()),
      ),
      this.legend,
    );
    onTheme(() => this.explain());
    this.explain();
  }

  /** Turns seeing through on or off. */
  toggleThrough(): void {
    this.through.querySelector("input")?.click();
  }

  private lengths(): HTMLInputElement {
    const slider = element("input", {
      type: "range",
      min: "-1",
      max: "1.2",
      step: "0.1",
      value: "0",
      "aria-label": "length of arrows",
    });
    slider.addEventListener("input", () => this.view.setArrows({ length: 10 ** Number(slider.value) }));
    return slider;
  }

  private explain(): void {
    this.legend.replaceChildren(
      ...MEANINGS[this.colour](this.view.tolerance).map(([colour, text]) => {
        const mark = element("i", { class: "dot" });
        mark.style.background = colour;
        return colour ? element("span", {}, mark, text) : element("span", {}, text);
      }),
    );
  }
}
