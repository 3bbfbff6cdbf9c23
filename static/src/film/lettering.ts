/** What is written over the picture: title, names of rooms, captions, credits; and the dark. */

import { element } from "../dom.ts";
import type { Files } from "../files.ts";
import { prose } from "../page/panel.ts";
import type { Room, Tour } from "../tour.ts";
import { textIn, type Words } from "../words.ts";
import { LOOK } from "./look.ts";
import type { Over } from "./timeline.ts";

export class Lettering {
  readonly element: HTMLElement;
  readonly #language: string;
  readonly #dark = element("div", { class: "film-dark" });
  readonly #title: HTMLElement;
  readonly #name = element("p", { class: "film-name" });
  readonly #said = element("span", {});
  readonly #caption = element("p", { class: "film-caption" }, this.#said);
  readonly #credits: HTMLElement;

  constructor(tour: Tour, files: Files, language: string, words: Words) {
    this.#language = language;
    const style = new CSSStyleSheet();
    style.replaceSync(LOOK);
    document.adoptedStyleSheets.push(style);
    const title = textIn(tour.title, language);
    const logo = tour.logo === null ? [] : [element("img", { src: files.source(tour.logo), alt: "" })];
    this.#title = element("div", { class: "film-title" }, ...logo, element("h1", {}, title));
    const license = textIn(tour.license, language);
    this.#credits = element(
      "div",
      { class: "film-credits" },
      element("h2", {}, title),
      prose(textIn(tour.credits, language)),
      ...(license ? [element("p", { class: "small" }, license)] : []),
      element("p", { class: "small" }, words.madeWith),
    );
    this.element = element(
      "div",
      { class: "film-over" },
      this.#name,
      this.#caption,
      this.#dark,
      this.#title,
      this.#credits,
    );
  }

  /** What the credits say. */
  get creditsText(): string {
    return this.#credits.textContent ?? "";
  }

  /** Resolves when letters and logo are there. */
  async ready(): Promise<void> {
    this.#name.textContent = "…"; // or its letters would be asked for with the first name
    this.#said.textContent = "…";
    const logos = [...this.element.querySelectorAll("img")].map((logo) => logo.decode());
    await Promise.all([document.fonts.ready, ...logos]);
  }

  /** @param caption "" for none. */
  show(room: Room, over: Over, caption: string): void {
    this.#name.textContent = textIn(room.title, this.#language);
    this.#said.textContent = caption;
    fade(this.#caption, caption === "" ? 0 : 1);
    fade(this.#name, over.name);
    fade(this.#dark, over.dark);
    fade(this.#title, over.title);
    fade(this.#credits, over.credits);
  }
}

function fade(each: HTMLElement, opacity: number): void {
  each.style.visibility = opacity > 0 ? "visible" : "hidden";
  each.style.opacity = opacity.toFixed(4);
}
