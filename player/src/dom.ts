/** Elements of the page, made from text only: names of bodies are never read as HTML. */

type Attributes = Record<string, string>;
type Child = Node | string;

/** An element with attributes and children. */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** A button that says what it does, also to those who hear the page. */
export function button(text: string, title: string, act: () => void): HTMLButtonElement {
  const made = element("button", { type: "button", title, "aria-label": title }, text);
  made.addEventListener("click", act);
  return made;
}

/** A choice among texts; `act` is told the chosen value. */
export function choice(
  title: string,
  options: readonly (readonly [value: string, text: string])[],
  value: string,
  act: (value: string) => void,
): HTMLSelectElement {
  const made = element("select", { title, "aria-label": title });
  for (const [each, text] of options) {
    const option = element("option", { value: each }, text);
    option.selected = each === value;
    made.append(option);
  }
  made.addEventListener("change", () => act(made.value));
  return made;
}

/** A switch with its words. */
export function toggle(
  text: string,
  title: string,
  on: boolean,
  act: (on: boolean) => void,
): HTMLLabelElement {
  const box = element("input", { type: "checkbox" });
  box.checked = on;
  box.addEventListener("change", () => act(box.checked));
  return element("label", { class: "toggle", title }, box, text);
}

/** A table of two columns: what, and how much. */
export function facts(rows: readonly (readonly [string, Child])[]): HTMLTableElement {
  const body = element("tbody");
  for (const [name, value] of rows) {
    body.append(element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, value)));
  }
  return element("table", { class: "facts" }, body);
}
