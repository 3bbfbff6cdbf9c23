/** The line at the top: where one is, and the buttons. */

import { element, icon, ICONS } from "./dom.ts";
import type { Words } from "./words.ts";

export interface HeaderEvents {
  rooms(): void;
  about(): void;
  language(tag: string): void;
}

export class Header {
  readonly element: HTMLElement;
  readonly #tour = element("p", { class: "tour-title" });
  readonly #room = element("h1", {});
  readonly #rooms: HTMLButtonElement;
  readonly #about: HTMLButtonElement;
  readonly #languages: HTMLSelectElement;

  constructor(languages: readonly string[], events: HeaderEvents) {
    this.#rooms = element("button", { type: "button", class: "tool" });
    this.#rooms.addEventListener("click", () => events.rooms());
    this.#about = element("button", { type: "button", class: "tool" });
    this.#about.addEventListener("click", () => events.about());
    this.#languages = element("select", { class: "tool" });
    for (const tag of languages) {
      this.#languages.append(element("option", { value: tag, lang: tag }, nameOf(tag)));
    }
    this.#languages.hidden = languages.length < 2;
    this.#languages.addEventListener("change", () => events.language(this.#languages.value));
    this.element = element(
      "header",
      { class: "top" },
      element("div", { class: "titles" }, this.#tour, this.#room),
      element("nav", { class: "tools" }, this.#about, this.#rooms, this.#languages),
    );
  }

  say(words: Words, language: string, tour: string, room: string, hasText: boolean): void {
    this.#tour.textContent = tour;
    this.#room.textContent = room;
    this.#about.hidden = !hasText;
    label(this.#about, ICONS.about, words.about);
    label(this.#rooms, ICONS.rooms, words.rooms);
    this.#languages.setAttribute("aria-label", words.language);
    this.#languages.value = language;
  }
}

function label(button: HTMLButtonElement, drawing: string, text: string): void {
  button.replaceChildren(icon(drawing), element("span", {}, text));
}

/** A language's own name for itself, "français". */
function nameOf(tag: string): string {
  return new Intl.DisplayNames([tag], { type: "language" }).of(tag) ?? tag;
}
