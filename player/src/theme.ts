/** Colours of drawings, light and dark, told apart by colour-blind readers (after Okabe and Ito, 2008). */

export interface Theme {
  dark: boolean;
  background: number;
  grid: number;
  obstacle: number;
  edge: number;
  /** Fills of movable bodies, one after another. */
  bodies: readonly number[];
  hovered: number;
  chosen: number;
  ghost: number;
  /** By status: apart, sticks, slips, strikes. */
  status: readonly number[];
  /** Lines of plots, one after another. */
  lines: readonly string[];
  text: string;
  faint: string;
  ruler: string;
}

const LIGHT: Theme = {
  dark: false,
  background: 0xf6f7f8,
  grid: 0xc9ced4,
  obstacle: 0xd5d9de,
  edge: 0x39424c,
  bodies: [0x9db8d2, 0xb9c9d9, 0x86a7c5, 0xaac0c4, 0xc3cbd6],
  hovered: 0xf0c05a,
  chosen: 0xe69f00,
  ghost: 0xcc79a7,
  status: [0x8a939c, 0x0072b2, 0xe07b00, 0xc2185b],
  lines: ["#1f2933", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b58900", "#56b4e9", "#882255"],
  text: "#4a5560",
  faint: "#e6e9ec",
  ruler: "#0072b2",
};

const DARK: Theme = {
  dark: true,
  background: 0x14181c,
  grid: 0x39424c,
  obstacle: 0x39424c,
  edge: 0x0c0f12,
  bodies: [0x6f93b5, 0x8ba6bf, 0x587c9f, 0x7d9ca0, 0x95a1b3],
  hovered: 0xf5cf7a,
  chosen: 0xf0ad2e,
  ghost: 0xd98fb8,
  status: [0x8a939c, 0x56b4e9, 0xf5a03c, 0xff6f91],
  lines: ["#e8ecef", "#56b4e9", "#f08a4b", "#2fc49b", "#e79cc4", "#e0c050", "#8ec9f0", "#c78bb0"],
  text: "#9aa6b2",
  faint: "#262d34",
  ruler: "#56b4e9",
};

const asked = matchMedia("(prefers-color-scheme: dark)");
let forced: "light" | "dark" | undefined;
const listeners: (() => void)[] = [];

/** The theme in force. */
export function theme(): Theme {
  return (forced ? forced === "dark" : asked.matches) ? DARK : LIGHT;
}

/** Changes between light and dark, whatever the system asks for. */
export function switchTheme(to: "light" | "dark" = theme().dark ? "light" : "dark"): void {
  forced = to;
  apply();
}

/** Calls `listener` after each change. */
export function onTheme(listener: () => void): void {
  listeners.push(listener);
}

/** Tells the stylesheet and all listeners. */
export function apply(): void {
  document.documentElement.dataset.theme = theme().dark ? "dark" : "light";
  for (const listener of listeners) listener();
}

asked.addEventListener("change", apply);

/** A colour of the drawing for the stylesheet. */
export function css(colour: number): string {
  return `#${colour.toString(16).padStart(6, "0")}`;
}
