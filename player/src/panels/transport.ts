/** Play, pause, step, speed and the scrubber. */

import { type Clock, SPEEDS } from "../clock";
import { button, choice, element } from "../dom";

/** See the file's head. */
export class Transport {
  readonly root: HTMLElement;
  private readonly play: HTMLButtonElement;
  private readonly scrubber: HTMLInputElement;
  private readonly time = element("output", { class: "time", "aria-label": "time" });
  private readonly speed: HTMLSelectElement;
  private readonly decimals: number;

  constructor(
    private readonly clock: Clock,
    end: number,
  ) {
    this.decimals = end < 1 ? 4 : end < 100 ? 3 : 2;
    this.play = button("▶", "play or pause (space)", () => clock.toggle());
    this.play.className = "play";
    this.scrubber = element("input", {
      type: "range",
      min: "0",
      max: String(clock.frames - 1),
      value: "0",
      step: "1",
      "aria-label": "frame",
      class: "scrubber",
    });
    this.scrubber.addEventListener("input", () => {
      clock.pause();
      clock.show(Number(this.scrubber.value));
    });
    const speeds = SPEEDS.map((speed) => [String(speed), `${speed}×`] as const);
    this.speed = choice("speed (+ and −)", speeds, "1", (value) => clock.setSpeed(Number(value)));
    this.root = element(
      "div",
      { class: "transport" },
      button("|‹", "first frame (Home)", () => clock.show(0)),
      button("‹", "one frame back (←)", () => clock.stepBy(-1)),
      this.play,
      button("›", "one frame on (→)", () => clock.stepBy(1)),
      this.scrubber,
      this.time,
      this.speed,
    );
    clock.onMove(() => this.showTime());
    clock.onChange(() => this.showState());
    this.showTime();
  }

  private showTime(): void {
    const { clock } = this;
    this.scrubber.value = String(clock.frame);
    this.scrubber.style.setProperty("--done", `${(100 * clock.frame) / Math.max(1, clock.frames - 1)}%`);
    this.time.value = `${clock.time.toFixed(this.decimals)} s`;
    this.time.title = `frame ${clock.frame + 1} of ${clock.frames}`;
  }

  private showState(): void {
    this.play.textContent = this.clock.playing ? "❚❚" : "▶";
    this.speed.value = String(this.clock.speed);
  }
}
