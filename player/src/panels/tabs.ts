/** Panels that share a place; one is seen at a time. */

import { element } from "../dom";

/** A panel with its name. */
export interface Tab {
  name: string;
  root: HTMLElement;
  /** Called when the panel comes to be seen. */
  shown?: () => void;
}

/** See the file's head. */
export class Tabs {
  readonly root: HTMLElement;
  private readonly buttons: HTMLButtonElement[];

  constructor(private readonly tabs: readonly Tab[]) {
    this.buttons = tabs.map(({ name }, i) => {
      const made = element("button", { type: "button", role: "tab" }, name);
      made.addEventListener("click", () => this.show(i));
      return made;
    });
    const list = element("div", { class: "tabs", role: "tablist" }, ...this.buttons);
    this.root = element("aside", { class: "side" }, list, ...tabs.map(({ root }) => root));
    for (const { root } of tabs) root.setAttribute("role", "tabpanel");
    this.show(0);
  }

  /** Shows a panel by number. */
  show(number: number): void {
    this.tabs.forEach(({ root }, i) => {
      root.hidden = i !== number;
      this.buttons[i].setAttribute("aria-selected", String(i === number));
    });
    this.tabs[number].shown?.();
  }

  /** Brings the panel that is seen to the frame shown, at once. */
  refresh(): void {
    for (const { root, shown } of this.tabs) if (!root.hidden) shown?.();
  }

  /** Shows a panel by name. */
  showNamed(name: string): void {
    this.show(this.tabs.findIndex((tab) => tab.name === name));
  }
}
