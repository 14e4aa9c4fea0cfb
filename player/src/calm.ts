/** Work that may wait a little: done at once, then at most every so often while it is asked for, and once at the end. */

/** Texts and charts follow the time at most this often [ms]; people read no faster. */
const OFTEN = 100;

/** See the file's head. */
export class Calm {
  private last = Number.NEGATIVE_INFINITY;
  private waiting: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly act: () => void,
    private readonly interval = OFTEN,
  ) {}

  /** Acts now, or when the interval since the last time is over. */
  readonly ask = (): void => {
    if (this.waiting !== undefined) return;
    const left = this.last + this.interval - performance.now();
    if (left <= 0) this.now();
    else this.waiting = setTimeout(this.now, left);
  };

  /** Acts now. */
  readonly now = (): void => {
    clearTimeout(this.waiting);
    this.waiting = undefined;
    this.last = performance.now();
    this.act();
  };
}
