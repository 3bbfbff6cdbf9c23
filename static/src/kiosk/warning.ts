/** Asks whether somebody is still there, before the tour returns to its start. */

import { button, element } from "../dom.ts";
import type { Words } from "../words.ts";

export class Warning {
  readonly element: HTMLElement;
  readonly #question = element("h2", { id: "warning-question" });
  readonly #left = element("p", {});
  readonly #bar = element("div", { class: "bar" });
  readonly #stay: HTMLButtonElement;

  /** @param stay Told that somebody is. */
  constructor(stay: () => void) {
    this.#stay = button("plain-button", () => undefined);
    this.element = element(
      "div",
      { class: "warning", role: "alertdialog", "aria-labelledby": "warning-question", hidden: true },
      element(
        "div",
        { class: "warning-sheet" },
        this.#question,
        this.#left,
        element("div", { class: "track" }, this.#bar),
        this.#stay,
      ),
    );
    this.element.addEventListener("click", stay);
  }

  show(words: Words): void {
    this.#question.textContent = words.kioskStill;
    this.#stay.textContent = words.kioskStay;
    this.element.hidden = false;
    this.#stay.focus({ preventScroll: true });
  }

  /** @param seconds That are left, of so many. */
  tell(seconds: number, of: number, words: Words): void {
    this.#left.textContent = words.kioskReturns.replace("{}", String(Math.ceil(seconds)));
    this.#bar.style.transform = `scaleX(${(seconds / of).toFixed(3)})`;
  }

  hide(): void {
    this.element.hidden = true;
  }
}
