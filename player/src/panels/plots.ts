/** The panel of all charts. Charts are drawn when the panel is first seen. */

import { Calm } from "../calm";
import type { Clock } from "../clock";
import { element } from "../dom";
import type { Chart } from "../plots/charts";
import { Plot } from "../plots/plot";
import { onTheme } from "../theme";

/** Charts out of sight are built after this long, one by one [ms]. */
const LATER = 30;

/** See the file's head. */
export class PlotsPanel {
  readonly root = element("div", { class: "plots" });
  readonly plots: Plot[];
  private width = 0;
  private building: ReturnType<typeof setTimeout> | undefined;
  private readonly calm = new Calm(() => this.showTime());

  constructor(charts: Chart[], clock: Clock) {
    this.plots = charts.map((chart) => new Plot(chart, clock));
    this.root.append(...this.plots.map((plot) => plot.root));
    if (!charts.length) this.root.append(element("p", { class: "hint" }, "No steps were recorded."));
    clock.onMove(this.calm.ask);
    onTheme(() => this.build());
    this.root.addEventListener("scroll", this.calm.ask);
    window.addEventListener("scroll", this.calm.ask);
    new ResizeObserver(() => this.fit()).observe(this.root);
  }

  /** Width for a chart [px]; charts stand a little into the panel's left margin. */
  private get room(): number {
    const { paddingLeft, paddingRight } = getComputedStyle(this.root);
    return this.root.clientWidth - Number.parseFloat(paddingLeft) - Number.parseFloat(paddingRight) + 8;
  }

  private get visible(): boolean {
    return this.width > 0 && !this.root.hidden; // asking for its size would have the page laid out
  }

  /** Moves the cursors of what is seen to the time shown. */
  showTime(): void {
    if (!this.visible) return;
    const { top, bottom } = this.root.getBoundingClientRect();
    const end = Math.min(bottom, innerHeight);
    // all are measured before the first is changed, so that the page is laid out once
    const within = this.plots.filter((plot) => plot.isWithin(top, end));
    for (const plot of within) plot.showTime();
  }

  private fit(): void {
    const width = this.room;
    if (width <= 0 || width === this.width) return;
    if (this.width === 0) {
      this.build();
      return;
    }
    this.width = width;
    for (const plot of this.plots) plot.resize(width);
  }

  private build(): void {
    const width = this.room;
    if (width <= 0) return;
    this.width = width;
    const { bottom } = this.root.getBoundingClientRect();
    const seen = this.plots.filter((plot) => plot.isWithin(0, Math.min(bottom, innerHeight)));
    for (const plot of seen) plot.build(width);
    this.buildNext(this.plots.filter((plot) => !seen.includes(plot)));
  }

  /** Builds charts that are not seen yet, one at a time, so that the page stays responsive. */
  private buildNext(left: Plot[]): void {
    clearTimeout(this.building);
    const [next, ...others] = left;
    if (!next) return;
    this.building = setTimeout(() => {
      if (this.room > 0) next.build(this.room);
      this.buildNext(others);
    }, LATER);
  }
}
