/** Keys of the page; `KEYS` tells them. */

import { type Clock, SPEEDS } from "./clock";

/** Keys and what they do, for the help. */
export const KEYS: readonly (readonly [string, string])[] = [
  ["space", "play, pause"],
  ["← →", "a frame back, on (with shift: ten)"],
  ["Home End", "first, last frame"],
  ["+ −", "faster, slower"],
  ["f", "follow the chosen body"],
  ["0", "camera back to where it began"],
  ["x", "see through bodies"],
  ["d", "light, dark"],
  ["Esc", "choose nothing"],
];

/** What keys other than those of time do. */
export interface KeyActions {
  follow(): void;
  reset(): void;
  seeThrough(): void;
  theme(): void;
  unchoose(): void;
}

/** Listens to keys, but not while the reader types or holds a modifier. */
export function listenToKeys(clock: Clock, actions: KeyActions): void {
  const faster = (by: number): void => {
    const at = SPEEDS.indexOf(clock.speed);
    clock.setSpeed(SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at + by))]);
  };
  const act: Record<string, (event: KeyboardEvent) => void> = {
    " ": () => clock.toggle(),
    ArrowLeft: (event) => clock.stepBy(event.shiftKey ? -10 : -1),
    ArrowRight: (event) => clock.stepBy(event.shiftKey ? 10 : 1),
    Home: () => clock.show(0),
    End: () => clock.show(clock.frames - 1),
    "+": () => faster(1),
    "=": () => faster(1),
    "-": () => faster(-1),
    f: () => actions.follow(),
    "0": () => actions.reset(),
    x: () => actions.seeThrough(),
    d: () => actions.theme(),
    Escape: () => actions.unchoose(),
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || takes(event.target, event.key)) return;
    const wanted = act[event.key];
    if (!wanted) return;
    event.preventDefault();
    wanted(event);
  });
}

/** Keys that move a slider. */
const SLIDES = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];
/** Keys that press a button. */
const PRESSES = [" ", "Enter"];

/** Whether what has the focus needs a key itself; the scrubber's are the page's own. */
export function takes(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof Element)) return false;
  if (target.matches("select, textarea, input:not([type=range], [type=checkbox], [type=file])")) return true;
  if (target.matches("input[type=range]:not(.scrubber)")) return SLIDES.includes(key);
  return PRESSES.includes(key) && target.matches("button, summary, input[type=checkbox], input[type=file]");
}
