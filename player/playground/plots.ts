/** Charts of a run that is being computed: the replay page's charts, drawn again a few times a second. */

import uPlot from "uplot";
import { element } from "../src/dom";
import { figure, powerOfTen, quantity } from "../src/format";
import { type Chart, chartsOf } from "../src/plots/charts";
import { onTheme, theme } from "../src/theme";
import type { LiveReplay } from "./live";

const HEIGHT = 112;
const FONT = "11px ui-sans-serif, system-ui, sans-serif";

interface Drawn {
  key: string;
  root: HTMLElement;
  readout: HTMLElement;
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
      const { plot, readout } = this.drawn[i];
      plot.setData([chart.time, ...chart.lines.map(({ values }) => values)] as uPlot.AlignedData);
      chart.lines.forEach(({ values, unit }, line) => {
        const value = values[values.length - 1];
        const told = value === null || value === undefined ? "–" : quantity(value, unit);
        readout.children[line].lastElementChild!.textContent = told;
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
      const readout = legend(chart);
      const place = element("div", { class: "chart" });
      const unit = element("span", {}, chart.unit === "1" ? "" : ` ${chart.unit}`);
      const head = element("h3", {}, chart.name, unit);
      const root = element("section", { class: "plot", "data-chart": chart.name }, head, readout, place);
      this.root.append(root);
      const plot = new uPlot(optionsOf(chart, width), [[0]] as uPlot.AlignedData, place);
      return { key: keys[i], root, readout, plot };
    });
  }
}

function colourOf(chart: Chart, line: number): string {
  const { lines } = theme();
  return lines[(chart.lines[line].colour ?? line) % lines.length];
}

/** Names of the lines in their colours, with room for values. */
function legend(chart: Chart): HTMLElement {
  const spans = chart.lines.map(({ name, dashed }, i) => {
    const mark = element("i", { class: dashed ? "mark dashed" : "mark" });
    mark.style.color = colourOf(chart, i);
    return element("span", {}, mark, `${name} `, element("b"));
  });
  return element("div", { class: "readout" }, ...spans);
}

function optionsOf(chart: Chart, width: number): uPlot.Options {
  const { faint, text } = theme();
  const axis = { stroke: text, font: FONT, grid: { stroke: faint, width: 1 }, ticks: { show: false } };
  const logarithmic = chart.logarithmic === true;
  return {
    width,
    height: HEIGHT,
    padding: [6, 10, 0, 0],
    legend: { show: false },
    cursor: { show: false },
    scales: { x: { time: false }, y: logarithmic ? { distr: 3, log: 10 } : {} },
    axes: [
      { ...axis, size: 22, values: (_, ticks) => ticks.map((tick) => figure(tick)) },
      {
        ...axis,
        size: 58,
        space: 26,
        ...(logarithmic
          ? { splits: (_: uPlot, __: number, low: number, high: number) => decades(low, high) }
          : {}),
        values: (_, ticks) => ticks.map((tick) => tickText(tick, logarithmic)),
      },
    ],
    series: [
      {},
      ...chart.lines.map(({ name, dashed }, i) => ({
        label: name,
        stroke: colourOf(chart, i),
        width: 1.5,
        points: { show: false },
        ...(dashed ? { dash: [5, 4] } : {}),
      })),
    ],
  };
}

/** At most six whole powers of ten between two values. */
function decades(low: number, high: number): number[] {
  const [first, last] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  const every = Math.max(1, Math.ceil((last - first + 1) / 6));
  const count = Math.max(0, Math.floor((last - first) / every) + 1);
  return Array.from({ length: count }, (_, i) => 10 ** (first + i * every));
}

/** A tick of an axis; of a logarithmic one whole powers of ten. */
function tickText(tick: number | null, logarithmic: boolean): string {
  if (tick === null) return "";
  if (!logarithmic) return figure(tick, 4);
  const exponent = Math.round(Math.log10(tick));
  return Math.abs(tick / 10 ** exponent - 1) < 1e-6 ? powerOfTen(exponent) : "";
}
