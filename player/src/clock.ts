/** The one time cursor of the page: which frame is shown, and how it moves. Knows no drawing. */

type Listener = () => void;

/** Speeds to choose from: simulated seconds per second [1]. */
export const SPEEDS: readonly number[] = [0.05, 0.1, 0.25, 0.5, 1, 2, 4, 10];

/** See the file's head. */
export class Clock {
  /** Frame that is shown. */
  frame = 0;
  /** Simulated seconds per second [1]. */
  speed = 1;
  playing = false;
  private moment: number;
  private last = 0;
  private readonly moved: Listener[] = [];
  private readonly changed: Listener[] = [];

  constructor(private readonly times: Float64Array) {
    this.moment = times[0];
  }

  /** Time of the frame shown [s]. */
  get time(): number {
    return this.times[this.frame];
  }

  get frames(): number {
    return this.times.length;
  }

  /** Calls `listener` whenever another frame is shown. */
  onMove(listener: Listener): void {
    this.moved.push(listener);
  }

  /** Calls `listener` when play, pause or speed change. */
  onChange(listener: Listener): void {
    this.changed.push(listener);
  }

  /** Shows a frame; numbers outside the run stop at its ends. */
  show(frame: number): void {
    const wanted = Math.max(0, Math.min(this.frames - 1, Math.round(frame)));
    this.moment = this.times[wanted];
    this.move(wanted);
  }

  /** Shows the frame nearest to a moment [s]. */
  seek(time: number): void {
    let frame = this.before(time);
    if (frame + 1 < this.frames && this.times[frame + 1] - time < time - this.times[frame]) frame += 1;
    this.show(frame);
  }

  /** Steps by frames, pausing. */
  stepBy(frames: number): void {
    this.pause();
    this.show(this.frame + frames);
  }

  toggle(): void {
    if (this.playing) this.pause();
    else this.play();
  }

  play(): void {
    if (this.frames < 2) return;
    if (this.frame === this.frames - 1) this.show(0);
    this.playing = true;
    this.last = performance.now();
    requestAnimationFrame(this.tick);
    this.tell(this.changed);
  }

  pause(): void {
    if (!this.playing) return;
    this.playing = false;
    this.tell(this.changed);
  }

  setSpeed(speed: number): void {
    this.speed = speed;
    this.tell(this.changed);
  }

  private readonly tick = (now: number): void => {
    if (!this.playing) return;
    this.moment += (this.speed * Math.min(now - this.last, 250)) / 1000;
    this.last = now;
    if (this.moment >= this.times[this.frames - 1]) {
      this.show(this.frames - 1);
      this.pause();
      return;
    }
    this.move(this.before(this.moment));
    requestAnimationFrame(this.tick);
  };

  /** The last frame at or before a moment. */
  private before(time: number): number {
    let low = 0;
    let high = this.frames - 1;
    while (high > low) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  private move(frame: number): void {
    if (frame === this.frame) return;
    this.frame = frame;
    this.tell(this.moved);
  }

  private tell(listeners: Listener[]): void {
    for (const listener of listeners) listener();
  }
}
