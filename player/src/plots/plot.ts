/** One chart on the page: uPlot with the page's time cursor, values to read and a click that jumps. */

import uPlot from "uplot";
import type { Clock } from "../clock";
import { element } from "../dom";
import { figure, powerOfTen, quantity } from "../format";
import { theme } from "../theme";
import type { Chart } from "./charts";

const HEIGHT = 118;
const FONT = "11px ui-sans-serif, system-ui, sans-serif";
/** All charts show the same moment under the pointer. */
const SYNC = "carom";

/** See the file's head. */
export class Plot {
  readonly root: HTMLElement;
  private readonly readout = element("div", { class: "readout" });
  private readonly cursor = element("div", { class: "now" });
  private readonly place = element("div", { class: "chart" });
  private readonly values: HTMLElement[] = [];
  private plot: uPlot | undefined;
  private hovered: number | null = null;

  constructor(
    readonly chart: Chart,
    private readonly clock: Clock,
  ) {
    this.root = element(
      "section",
      { class: "plot", "data-chart": chart.name },
      element("h3", {}, chart.name, element("span", {}, chart.unit === "1" ? "" : ` ${chart.unit}`)),
      this.readout,
      this.place,
    );
  }

  /** Draws the chart for a width and the theme in force. */
  build(width: number): void {
    this.plot?.destroy();
    this.legend();
    const data = [this.chart.time, ...this.chart.lines.map(({ values }) => values)] as uPlot.AlignedData;
    this.plot = new uPlot(this.options(width), data, this.place);
    this.plot.over.append(this.cursor);
    this.followClicks(this.plot);
    this.showTime();
  }

  resize(width: number): void {
    this.plot?.setSize({ width, height: HEIGHT });
    this.showTime();
  }

  /** Whether some of it stands between two heights of the page [px]. */
  isWithin(top: number, bottom: number): boolean {
    const box = this.root.getBoundingClientRect();
    return box.bottom > top && box.top < bottom;
  }

  /** Moves the cursor to the time shown. */
  showTime(): void {
    if (!this.plot) return;
    const left = this.plot.valToPos(this.clock.time, "x");
    this.cursor.style.transform = `translateX(${left}px)`;
    this.cursor.hidden = !(left >= -0.5 && left <= this.plot.bbox.width / devicePixelRatio + 0.5);
    if (this.hovered === null) this.read();
  }

  /** Where the cursor is, in pixels from the left of the chart's area; for tests. */
  get cursorLeft(): number {
    return this.plot?.valToPos(this.clock.time, "x") ?? Number.NaN;
  }

  private options(width: number): uPlot.Options {
    const { lines, faint, text } = theme();
    const axis = { stroke: text, font: FONT, grid: { stroke: faint, width: 1 }, ticks: { show: false } };
    const logarithmic = this.chart.logarithmic === true;
    return {
      width,
      height: HEIGHT,
      padding: [6, 10, 0, 0],
      legend: { show: false },
      cursor: {
        sync: { key: SYNC, setSeries: false },
        points: { size: 6 },
        drag: { x: true, y: false, dist: 6 },
      },
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
        ...this.chart.lines.map(({ name, dashed, colour }, i) => ({
          label: name,
          stroke: lines[(colour ?? i) % lines.length],
          width: 1.5,
          points: { show: false },
          ...(dashed ? { dash: [5, 4] } : {}),
        })),
      ],
      hooks: {
        setCursor: [(u: uPlot) => this.point(u.cursor.idx ?? null)],
        setScale: [() => this.showTime()],
      },
    };
  }

  /** Names of the lines in their colours, with room for values. */
  private legend(): void {
    const { lines } = theme();
    this.readout.replaceChildren();
    this.values.length = 0;
    this.chart.lines.forEach(({ name, dashed, colour }, i) => {
      const mark = element("i", { class: dashed ? "mark dashed" : "mark" });
      mark.style.color = lines[(colour ?? i) % lines.length];
      const value = element("b");
      this.values.push(value);
      this.readout.append(element("span", {}, mark, `${name} `, value));
    });
  }

  private point(index: number | null): void {
    this.hovered = index;
    this.read();
  }

  /** Tells the values under the pointer, or at the time shown. */
  private read(): void {
    const row = this.hovered ?? (this.plot ? nearest(this.chart.time, this.clock.time) : 0);
    this.chart.lines.forEach(({ values, unit }, i) => {
      const value = values[row];
      const text = value === null || value === undefined ? "–" : quantity(value, unit);
      if (this.values[i].textContent !== text) this.values[i].textContent = text;
    });
    this.readout.classList.toggle("hovered", this.hovered !== null);
  }

  /** A click that is no drag shows the moment under it. */
  private followClicks(plot: uPlot): void {
    let pressed = 0;
    plot.over.addEventListener("pointerdown", (event) => {
      pressed = event.clientX;
    });
    plot.over.addEventListener("click", (event) => {
      if (Math.abs(event.clientX - pressed) > 5) return;
      const left = event.clientX - plot.over.getBoundingClientRect().left;
      this.clock.pause();
      this.clock.seek(plot.posToVal(left, "x"));
    });
  }
}

/** At most six whole powers of ten between two values. */
function decades(low: number, high: number): number[] {
  const [first, last] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  const every = Math.max(1, Math.ceil((last - first + 1) / 6));
  const found: number[] = [];
  for (let exponent = first; exponent <= last; exponent += every) found.push(10 ** exponent);
  return found;
}

/** A tick of an axis; of a logarithmic one only whole powers of ten are written. */
function tickText(tick: number | null, logarithmic: boolean): string {
  if (tick === null) return "";
  if (!logarithmic) return figure(tick, 4);
  const exponent = Math.round(Math.log10(tick));
  return Math.abs(tick / 10 ** exponent - 1) < 1e-6 ? powerOfTen(exponent) : "";
}

function nearest(times: Float64Array, time: number): number {
  let low = 0;
  let high = times.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  return Math.abs(times[high] - time) < Math.abs(times[low] - time) ? high : low;
}
