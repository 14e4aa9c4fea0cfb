/** Charts of a run that is being computed: the replay page's charts, drawn again a few times a second. */

import uPlot from "uplot";
import { element } from "../src/dom";
import { type Chart, chartsOf } from "../src/plots/charts";
import { legendOf, optionsOf, told } from "../src/plots/options";
import { onTheme } from "../src/theme";
import type { LiveReplay } from "./live";

const HEIGHT = 112;

interface Drawn {
  key: string;
  root: HTMLElement;
  values: HTMLElement[];
  plot: uPlot;
}

/** See the file's head. */
export class LivePlots {
  readonly root = element("div", { class: "plots" });
  private drawn: Drawn[] = [];

  constructor(private readonly live: LiveReplay) {
    onTheme(() => this.clear());
    this.root.append(element("p", { class: "hint" }, "Run the scene to see its figures."));
  }

  /** Brings all charts up to now, while they are seen. */
  show(): void {
    const width = this.root.clientWidth - 20;
    if (width <= 0) return;
    const charts = chartsOf(this.live.asReplay);
    const keys = charts.map(
      (chart) => `${width} ${chart.name} ${chart.lines.map(({ name }) => name).join()}`,
    );
    if (keys.join() !== this.drawn.map(({ key }) => key).join()) this.build(charts, keys, width);
    charts.forEach((chart, i) => {
      const { plot, values } = this.drawn[i];
      plot.setData([chart.time, ...chart.lines.map(({ values }) => values)] as uPlot.AlignedData);
      chart.lines.forEach((line, k) => {
        values[k].textContent = told(line, line.values.length - 1);
      });
    });
  }

  private clear(): void {
    for (const { plot } of this.drawn) plot.destroy();
    this.drawn = [];
    this.root.replaceChildren();
  }

  private build(charts: Chart[], keys: string[], width: number): void {
    this.clear();
    this.drawn = charts.map((chart, i) => {
      const { root: readout, values } = legendOf(chart);
      const place = element("div", { class: "chart" });
      const unit = element("span", {}, chart.unit === "1" ? "" : ` ${chart.unit}`);
      const head = element("h3", {}, chart.name, unit);
      const root = element("section", { class: "plot", "data-chart": chart.name }, head, readout, place);
      this.root.append(root);
      const plot = new uPlot(
        { ...optionsOf(chart, width, HEIGHT), cursor: { show: false } },
        [[0]] as uPlot.AlignedData,
        place,
      );
      return { key: keys[i], root, values, plot };
    });
  }
}
