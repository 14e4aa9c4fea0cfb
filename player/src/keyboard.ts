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
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || target.matches("select, input[type=text]")) return;
    if (event.key === " " && target.matches("button, input[type=checkbox]")) return;
    const wanted = act[event.key];
    if (!wanted) return;
    event.preventDefault();
    wanted(event);
  });
}
