/** What stands over the tour while nobody is there: its name, and how to begin, in all languages. */

import { button, element } from "../dom.ts";
import type { Tour } from "../tour.ts";
import { directionOf, textIn, wordsIn } from "../words.ts";

export class StartScreen {
  readonly element: HTMLElement;
  readonly #first: HTMLButtonElement;

  /** @param begin Told in which language somebody wants to begin. */
  constructor(tour: Tour, logo: string | null, begin: (language: string) => void) {
    const [first = "en"] = tour.languages;
    const ways = tour.languages.map((language) => {
      const made = button("begin", () => begin(language));
      made.lang = language;
      made.dir = directionOf(language);
      made.append(
        element("span", { class: "begin-title" }, textIn(tour.title, language)),
        element("span", { class: "begin-touch" }, wordsIn(language).kioskTouch),
      );
      return made;
    });
    this.#first = ways[0] ?? button("begin", () => begin(first));
    this.element = element("section", { class: "start-screen" });
    if (logo) this.element.append(element("img", { class: "logo", src: logo, alt: "" }));
    this.element.append(element("div", { class: "begins" }, ...ways));
    this.element.addEventListener("click", (event) => {
      if (event.target === this.element) begin(first);
    });
  }

  show(): void {
    this.element.hidden = false;
    this.#first.focus({ preventScroll: true });
  }

  hide(): void {
    this.element.hidden = true;
  }
}
