/** What the reader points at and has chosen, shared by scene, matrix and panels. Knows no drawing. */

type Listener = () => void;

/** See the file's head. Bodies and contacts by their rows; contacts are those of the frame shown. */
export class Selection {
  /** Body that is chosen, or -1. */
  body = -1;
  /** Body that follows the camera, or -1. */
  followed = -1;
  /** Bodies pointed at. */
  hoveredBodies: readonly number[] = [];
  /** Contacts pointed at. */
  hoveredContacts: readonly number[] = [];
  private readonly listeners: Listener[] = [];

  /** Calls `listener` after each change. */
  onChange(listener: Listener): void {
    this.listeners.push(listener);
  }

  choose(body: number): void {
    if (body === this.body) return;
    this.body = body;
    this.tell();
  }

  follow(body: number): void {
    this.followed = body;
    this.tell();
  }

  hover(bodies: readonly number[], contacts: readonly number[]): void {
    if (same(bodies, this.hoveredBodies) && same(contacts, this.hoveredContacts)) return;
    this.hoveredBodies = bodies;
    this.hoveredContacts = contacts;
    this.tell();
  }

  private tell(): void {
    for (const listener of this.listeners) listener();
  }
}

function same(one: readonly number[], other: readonly number[]): boolean {
  return one.length === other.length && one.every((value, i) => value === other[i]);
}
