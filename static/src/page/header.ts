/** The line at the top: where one is, and the buttons. */

import { button, element, ICONS, labelled } from "../dom.ts";
import type { Words } from "../words.ts";

/** Each language's name for itself. Browsers know most, but take 15 ms before they tell the first. */
const NAMES: Readonly<Record<string, string>> = {
  ar: "العربية",
  br: "brezhoneg",
  de: "Deutsch",
  en: "English",
  es: "español",
  fr: "français",
  it: "italiano",
  nl: "Nederlands",
  pt: "português",
};

export interface HeaderEvents {
  search(): void;
  rooms(): void;
  about(): void;
  tools(): void;
  language(tag: string): void;
  /** Back to the start, at a kiosk. */
  home(): void;
}

export class Header {
  readonly element: HTMLElement;
  readonly #tour = element("p", { class: "tour-title" });
  readonly #room = element("h1", {});
  readonly #search: HTMLButtonElement;
  readonly #rooms: HTMLButtonElement;
  readonly #about: HTMLButtonElement;
  readonly #tools: HTMLButtonElement;
  readonly #home: HTMLButtonElement;
  readonly #speech: HTMLButtonElement;
  readonly #nav = element("nav", { class: "tools" });
  readonly #languages = element("select", { class: "tool" });

  /**
   * @param logo Address of the publisher's logo, if there is one.
   * @param kiosk There is no keyboard to search by, and no window for a list to open in.
   */
  constructor(
    logo: string | null,
    languages: readonly string[],
    kiosk: boolean,
    events: HeaderEvents,
  ) {
    this.#search = button("tool", () => events.search());
    this.#rooms = button("tool", () => events.rooms());
    this.#about = button("tool", () => events.about());
    this.#tools = button("tool", () => events.tools());
    this.#home = button("tool", () => events.home());
    this.#speech = button("tool speech", () => {
      const next = languages.indexOf(this.#languages.value) + 1;
      events.language(languages[next % languages.length] ?? this.#languages.value);
    });
    for (const tag of languages) {
      this.#languages.append(element("option", { value: tag, lang: tag }, nameOf(tag)));
    }
    this.#languages.hidden = languages.length < 2;
    this.#languages.addEventListener("change", () => events.language(this.#languages.value));
    const always = [this.#about, this.#rooms, this.#tools];
    if (kiosk) this.#nav.append(this.#home, ...always, ...(languages.length > 1 ? [this.#speech] : []));
    else this.#nav.append(this.#search, ...always, this.#languages);
    const titles = element("div", { class: "titles" }, this.#tour, this.#room);
    this.element = element("header", { class: "top" }, titles, this.#nav);
    if (logo) this.element.prepend(element("img", { class: "logo", src: logo, alt: "" }));
  }

  say(words: Words, language: string, tour: string, room: string): void {
    this.#tour.textContent = tour === room ? "" : tour;
    this.#room.textContent = room;
    this.#nav.setAttribute("aria-label", words.tools);
    labelled(this.#search, ICONS.search, words.search);
    labelled(this.#about, ICONS.about, words.about);
    labelled(this.#rooms, ICONS.rooms, words.rooms);
    labelled(this.#tools, ICONS.more, words.tools);
    labelled(this.#home, ICONS.home, words.kioskHome);
    labelled(this.#speech, ICONS.speech, words.language);
    this.#speech.append(language.toUpperCase());
    this.#languages.setAttribute("aria-label", words.language);
    this.#languages.value = language;
  }
}

/** A language's own name for itself, "français". */
function nameOf(tag: string): string {
  return NAMES[tag] ?? new Intl.DisplayNames([tag], { type: "language" }).of(tag) ?? tag;
}
