/** One chart on the page: uPlot with the page's time cursor, values to read and a click that jumps. */

import uPlot from "uplot";
import type { Clock } from "../clock";
import { element } from "../dom";
import type { Chart } from "./charts";
import { legendOf, optionsOf, told } from "./options";

const HEIGHT = 118;
/** All charts show the same moment under the pointer. */
const SYNC = "carom";

/** See the file's head. */
export class Plot {
  readonly root: HTMLElement;
  private readout: HTMLElement = element("div", { class: "readout" });
  private readonly cursor = element("div", { class: "now" });
  private readonly place = element("div", { class: "chart" });
  private values: HTMLElement[] = [];
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
    return {
      ...optionsOf(this.chart, width, HEIGHT),
      cursor: {
        sync: { key: SYNC, setSeries: false },
        points: { size: 6 },
        drag: { x: true, y: false, dist: 6 },
      },
      hooks: {
        setCursor: [(u: uPlot) => this.point(u.cursor.idx ?? null)],
        setScale: [() => this.showTime()],
      },
    };
  }

  /** Names of the lines in their colours, with room for values. */
  private legend(): void {
    const { root, values } = legendOf(this.chart);
    this.readout.replaceWith(root);
    this.readout = root;
    this.values = values;
  }

  private point(index: number | null): void {
    this.hovered = index;
    this.read();
  }

  /** Tells the values under the pointer, or at the time shown. */
  private read(): void {
    const row = this.hovered ?? (this.plot ? nearest(this.chart.time, this.clock.time) : 0);
    this.chart.lines.forEach((line, i) => {
      const text = told(line, row);
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
