/** What stands before the room until it can be shown: its poster, its name, how far it is. */

import { element } from "../dom.ts";

export class Cover {
  readonly element: HTMLElement;
  readonly #poster: HTMLImageElement;
  readonly #name = element("p", { class: "cover-name" });
  readonly #bar = element("div", { class: "bar" });
  readonly #track: HTMLElement;

  /** @param poster The page's own image, on screen since before this script ran. */
  constructor(poster: HTMLImageElement) {
    this.#poster = poster;
    this.#track = element(
      "div",
      { class: "track", role: "progressbar", "aria-valuemin": "0", "aria-valuemax": "100" },
      this.#bar,
    );
    this.element = element("div", { class: "cover" });
    this.element.append(poster, element("div", { class: "cover-foot" }, this.#name, this.#track));
  }

  /** @param passing From another room: the poster shows another view and stays in the back. */
  show(poster: string, name: string, loading: string, passing: boolean): void {
    if (this.#poster.src !== poster) this.#poster.src = poster;
    this.#name.textContent = name;
    this.#track.setAttribute("aria-label", `${loading}: ${name}`);
    this.progress(0);
    this.element.classList.toggle("passing", passing);
    this.element.classList.remove("gone");
  }

  /** @param part 0 to 1. */
  progress(part: number): void {
    this.#bar.style.transform = `scaleX(${part.toFixed(3)})`;
    this.#track.setAttribute("aria-valuenow", String(Math.round(part * 100)));
  }

  hide(): void {
    this.element.classList.add("gone");
  }
}
