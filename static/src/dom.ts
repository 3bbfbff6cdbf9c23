/** Elements in one expression. */

type Attributes = Readonly<Record<string, string | boolean>>;

/** An element with attributes, where true stands for an attribute without a value. */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: readonly (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== false) made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children);
  return made;
}

const SVG = "http://www.w3.org/2000/svg";

/** The same of SVG. */
export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Readonly<Record<string, string>> = {},
): SVGElementTagNameMap[K] {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

/** A line drawing of 24 by 24 units in the colour of the text. */
export function icon(path: string): SVGSVGElement {
  const drawing = svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true", class: "icon" });
  drawing.append(svg("path", { d: path }));
  return drawing;
}

export const ICONS = {
  rooms: "M4 6h16M4 12h16M4 18h16",
  about: "M12 11v6M12 7.5v.01M21 12a9 9 0 1 1-18 0 9 9 0 0 1 18 0Z",
  close: "M6 6l12 12M18 6 6 18",
  door: "M6 21V4.5L15 3v18M6 21h12V5h-3M12 12v.01",
  search: "M10.5 17a6.5 6.5 0 1 0 0-13 6.5 6.5 0 0 0 0 13ZM15.5 15.5 20 20",
  more: "M6 12a.8.8 0 1 1-1.6 0 .8.8 0 0 1 1.6 0ZM12.8 12a.8.8 0 1 1-1.6 0 .8.8 0 0 1 1.6 0ZM19.6 12a.8.8 0 1 1-1.6 0 .8.8 0 0 1 1.6 0Z",
  walk: "M12.5 5.5v.01M12 9l-3 2.5-1 3M12 9l.5 5.5L10 21M12.5 14.5 15 17l.5 4M12 9l2.5 2.5 2.5.5",
  orbit: "M12 3 4 7.5v9L12 21l8-4.5v-9L12 3ZM4 7.5l8 4.5 8-4.5M12 12v9",
  dollhouse: "M4 21V9l8-5.5L20 9v12H4ZM4 14h16M12 14v7M12 9v5",
  plan: "M4 4h16v16H4V4ZM4 11h7M11 4v10M11 17v3M15 11h5",
  play: "M8 5v14l11-7L8 5Z",
  pause: "M8 5v14M16 5v14",
  next: "M6 5v14l9-7-9-7ZM18 5v14",
  previous: "M18 5v14l-9-7 9-7ZM6 5v14",
  measure: "M3 16 16 3l5 5L8 21l-5-5ZM7 12l2 2M10 9l3 3M13 6l2 2",
  section: "M4 7l8-4 8 4v10l-8 4-8-4V7ZM2 14l20-4",
  tint: "M12 3s6.5 6.700 6.5 11.200a6.5 6.5 0 0 1-13 0C5.5 9.700 12 3 12 3Z",
  camera: "M4 8h3.5L9 5.5h6L16.5 8H20v11H4V8ZM12 16.5a3.200 3.200 0 1 0 0-6.400 3.200 3.200 0 0 0 0 6.400Z",
  share: "M12 15V4M8 7.5 12 3.5l4 4M6 12H5v8h14v-8h-1",
  headset: "M3 8h18v9h-5.5L13.5 14h-3L8.5 17H3V8Z",
  keys: "M3 7h18v11H3V7ZM7 11h.01M11 11h.01M15 11h.01M8 14.5h8",
  full: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  home: "M4 11.5 12 4.500l8 7M6.500 10v10h11V10",
  speech: "M4 5h16v11h-8l-4 4v-4H4V5ZM8 9h8M8 12h5",
  along: "M12 4v11M7.500 11 12 15.500l4.500-4.500M5 20h14",
  copy: "M9 9h11v11H9V9ZM5 15H4V4h11v1",
};

/** Whether the visitor asked the system for less motion. */
export function prefersStillness(): boolean {
  return window.matchMedia("(prefers-reduced-motion: reduce)").matches;
}

/** Whether the main pointer is a finger. */
export function isTouch(): boolean {
  return window.matchMedia("(pointer: coarse)").matches;
}

/** Resolves after so long. */
export function pause(ms: number): Promise<void> {
  return new Promise((done) => setTimeout(done, ms));
}

/** A button that does something. */
export function button(kind: string, act: () => void): HTMLButtonElement {
  const made = element("button", { type: "button", class: kind });
  made.addEventListener("click", act);
  return made;
}

/** Gives a button its drawing and its words, which small screens leave to screen readers. */
export function labelled(made: HTMLButtonElement, drawing: string, words: string): void {
  made.replaceChildren(icon(drawing), element("span", {}, words));
  made.title = words;
}
