/** What the reader points at and has chosen, shared by scene, matrix and panels. Knows no drawing. */

type Listener = () => void;

/** See the file's head. Bodies and contacts by their rows in a run; contacts are those of the frame shown. */
export class Selection {
  /** The run that panels tell of, of two that are compared. */
  run = 0;
  /** Body of that run that is chosen, or -1. */
  body = -1;
  /** Body that follows the camera, or -1, and its run. */
  followed = -1;
  followedRun = 0;
  /** Bodies pointed at, and their run. */
  hoveredBodies: readonly number[] = [];
  /** Contacts pointed at. */
  hoveredContacts: readonly number[] = [];
  hoveredRun = 0;
  private readonly listeners: Listener[] = [];

  /** Calls `listener` after each change. */
  onChange(listener: Listener): void {
    this.listeners.push(listener);
  }

  choose(body: number, run = this.run): void {
    if (body === this.body && run === this.run) return;
    this.body = body;
    this.run = run;
    this.tell();
  }

  follow(body: number): void {
    this.followed = body;
    this.followedRun = this.run;
    this.tell();
  }

  /** Whether the chosen body is the one that the camera follows. */
  get isFollowed(): boolean {
    return this.followed >= 0 && this.followed === this.body && this.followedRun === this.run;
  }

  hover(bodies: readonly number[], contacts: readonly number[], run = this.run): void {
    const known = run === this.hoveredRun || (!bodies.length && !contacts.length);
    if (known && same(bodies, this.hoveredBodies) && same(contacts, this.hoveredContacts)) return;
    this.hoveredBodies = bodies;
    this.hoveredContacts = contacts;
    this.hoveredRun = run;
    this.tell();
  }

  /** Contacts of a run that are pointed at. */
  contactsOf(run: number): readonly number[] {
    return run === this.hoveredRun ? this.hoveredContacts : [];
  }

  private tell(): void {
    for (const listener of this.listeners) listener();
  }
}

function same(one: readonly number[], other: readonly number[]): boolean {
  return one.length === other.length && one.every((value, i) => value === other[i]);
}
