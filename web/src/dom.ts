/** Elements of the page. Text goes in as text: nothing that a run says is ever read as HTML. */

type Attributes = Record<string, string | number | boolean | ((event: Event) => void)>;

/** Make an element; attributes that are functions listen to the event of that name. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false) element.setAttribute(name, String(value));
  }
  element.append(...children);
  return element;
}

/** Make a button. */
export function button(text: string, label: string, click: () => void): HTMLButtonElement {
  return make("button", { type: "button", "aria-label": label, title: label, click }, text);
}

/** Make a choice among values, each with what it is called. */
export function choice(label: string, options: [string, string][], chosen: (value: string) => void): HTMLLabelElement {
  const change = (event: Event) => chosen((event.target as HTMLSelectElement).value);
  const items = options.map(([value, text]) => make("option", { value }, text));
  return make("label", { class: "choice" }, make("span", {}, label), make("select", { change }, ...items));
}

/** Make a section under a heading. */
export function section(name: string, title: string, ...children: (Node | string)[]): HTMLElement {
  return make("section", { class: name, "aria-label": title }, make("h2", {}, title), ...children);
}

/** Make a table of two columns. */
export function pairs(rows: [string, string][]): HTMLTableElement {
  const lines = rows.map(([name, value]) =>
    make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, value)),
  );
  return make("table", { class: "pairs" }, make("tbody", {}, ...lines));
}

export const isDark = (): boolean => matchMedia("(prefers-color-scheme: dark)").matches;
export const wantsStillness = (): boolean => matchMedia("(prefers-reduced-motion: reduce)").matches;
