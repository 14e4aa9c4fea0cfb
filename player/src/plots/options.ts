/** What a chart looks like: axes, ticks, lines and the names of its lines. Knows no time and no pointer. */

import uPlot from "uplot";
import { element } from "../dom";
import { figure, powerOfTen, quantity } from "../format";
import { theme } from "../theme";
import type { Chart, Line } from "./charts";

const FONT = "11px ui-sans-serif, system-ui, sans-serif";
/** The legend's, as the page's style has it. */
const LEGEND_FONT = "11.5px ui-sans-serif, system-ui, sans-serif";
/** Room beside the last label of the time axis, half of which stands beyond the axis [px]. */
const LAST_LABEL = 20;
/** Width of a mark with its gap, and of the gap before a value [px]. */
const MARK = 21;
const GAP = 5;
/** As wide as values get. */
const WIDEST = "−0.0000000";
/** Most labels of a logarithmic axis. */
const MOST_DECADES = 6;
/** Patterns of strokes and gaps [px]. */
const STROKES = { dashes: [5, 4], dots: [1.5, 3] } as const;

/** Colour of a line of a chart. */
function colourOf({ lines }: Chart, line: number): string {
  const colours = theme().lines;
  return colours[(lines[line].colour ?? line) % colours.length];
}

/** uPlot's options for a chart; pointer and hooks are the caller's. */
export function optionsOf(chart: Chart, width: number, height: number): uPlot.Options {
  const { faint, text } = theme();
  const axis = { stroke: text, font: FONT, grid: { stroke: faint, width: 1 }, ticks: { show: false } };
  return {
    width,
    height,
    padding: [6, LAST_LABEL, 0, 0],
    legend: { show: false },
    scales: { x: { time: false }, y: chart.logarithmic ? { distr: 3, log: 10 } : { range: linearRange } },
    axes: [
      { ...axis, size: 22, values: (_, ticks) => ticks.map((tick) => figure(tick)) },
      {
        ...axis,
        size: 58,
        space: 20, // less than a quarter of the height: there are two labels at least
        // all of `decades` are labelled: there are few enough of them
        ...(chart.logarithmic
          ? { splits: (_: uPlot, __: number, low: number, high: number) => decades(low, high), filter: all }
          : { filter: meaningful }),
        values: (_, ticks) => ticks.map((tick) => tickText(tick, chart.logarithmic === true)),
      },
    ],
    series: [{}, ...chart.lines.map((line, i) => series(line, colourOf(chart, i)))],
  };
}

function series(line: Line, colour: string): uPlot.Series {
  return {
    label: line.name,
    stroke: colour,
    width: 1.5,
    points: {
      show: false, // but for those that no line passes through
      filter: (u, number) => lonely(u.data[number]),
      size: 4,
      fill: colour,
    },
    ...(line.stroke ? { dash: [...STROKES[line.stroke]] } : {}),
  };
}

/** Names of a chart's lines in their colours, each with a place for its value; as high whatever the values are. */
export function legendOf(chart: Chart): { root: HTMLElement; values: HTMLElement[] } {
  const values = chart.lines.map(() => element("b"));
  const spans = chart.lines.map(({ name, unit, stroke }, i) => {
    const mark = element("i", { class: stroke ? `mark ${stroke}` : "mark" });
    mark.style.color = colourOf(chart, i);
    const span = element("span", { title: name }, mark, element("span", {}, name), values[i]);
    const widest = unit === "1" ? WIDEST : `${WIDEST} ${unit}`;
    span.style.width = `${Math.ceil(MARK + widthOf(name) + GAP + widthOf(widest)) + 1}px`;
    return span;
  });
  return { root: element("div", { class: "readout" }, ...spans), values };
}

/** Width of a text of the legend [px]. */
function widthOf(text: string): number {
  measure ??= new OffscreenCanvas(1, 1).getContext("2d")!;
  measure.font = LEGEND_FONT;
  return measure.measureText(text).width;
}
let measure: OffscreenCanvasRenderingContext2D | undefined;

/** A value of a line in words: also those that its axis cannot show. */
export function told(line: Line, row: number): string {
  const value = (line.told ?? line.values)[row];
  return value === null || value === undefined ? "–" : quantity(value, line.unit);
}

/** Where values stand with none beside them: a line shows nothing of them. */
export function lonely(values: ArrayLike<number | null | undefined>): number[] | null {
  const found: number[] = [];
  const missing = (i: number): boolean => values[i] === null || values[i] === undefined;
  for (let i = 0; i < values.length; i++) if (!missing(i) && missing(i - 1) && missing(i + 1)) found.push(i);
  return found.length ? found : null;
}

/** The usual range; of nothing but zeros one around them, whose other labels are left out. */
function linearRange(_: uPlot, low: number | null, high: number | null): uPlot.Range.MinMax {
  if (low === null || high === null) return [null, null];
  return low === 0 && high === 0 ? [-1, 1] : uPlot.rangeNum(low, high, 0.1, true);
}

/** Labels of a linear axis: where all values are zero only that one means something. */
function meaningful(u: uPlot, splits: number[]): (number | null)[] {
  const zero = u.data.slice(1).every((values) => Array.prototype.every.call(values, (value) => !value));
  return zero ? splits.map((split) => (split === 0 ? 0 : null)) : splits;
}

function all(_: uPlot, splits: number[]): number[] {
  return splits;
}

/** Whole powers of ten between two values, few enough to be written. */
export function decades(low: number, high: number): number[] {
  const [first, last] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  const every = Math.max(1, Math.ceil((last - first + 1) / MOST_DECADES));
  const count = Math.max(0, Math.floor((last - first) / every) + 1);
  return Array.from({ length: count }, (_, i) => 10 ** (first + i * every));
}

/** A tick of an axis; of a logarithmic one only whole powers of ten are written. */
function tickText(tick: number | null, logarithmic: boolean): string {
  if (tick === null) return "";
  if (!logarithmic) return figure(tick, 4);
  const exponent = Math.round(Math.log10(tick));
  return Math.abs(tick / 10 ** exponent - 1) < 1e-6 ? powerOfTen(exponent) : "";
}
