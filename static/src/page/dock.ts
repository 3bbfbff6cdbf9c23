/** The line at the bottom: the guided tour, and the ways to see. */

import type { Way } from "../address.ts";
import { button, element, ICONS, labelled } from "../dom.ts";
import type { Words } from "../words.ts";

export interface DockEvents {
  guide(): void;
  see(way: Way): void;
}

const WAYS: readonly Way[] = ["walk", "orbit", "dollhouse", "plan"];

export class Dock {
  readonly element: HTMLElement;
  readonly #hint = element("p", { class: "hint" });
  readonly #guide: HTMLButtonElement;
  readonly #ways = new Map<Way, HTMLButtonElement>();
  readonly #group = element("div", { class: "ways", role: "group" });

  constructor(events: DockEvents) {
    this.#guide = button("tool guide-start", () => events.guide());
    for (const way of WAYS) {
      const made = button("tool way", () => events.see(way));
      this.#ways.set(way, made);
      this.#group.append(made);
    }
    this.element = element("section", { class: "dock" }, this.#hint, this.#guide, this.#group);
  }

  get hasFocus(): boolean {
    return this.element.contains(document.activeElement);
  }

  /** Hands the focus to where the guided tour begins. */
  focus(): void {
    this.#guide.focus({ preventScroll: true });
  }

  say(words: Words): void {
    this.element.setAttribute("aria-label", words.see);
    this.#group.setAttribute("aria-label", words.see);
    labelled(this.#guide, ICONS.play, words.guide);
    for (const [way, made] of this.#ways) labelled(made, ICONS[way], words[way]);
  }

  /** Says what to do with mouse or fingers, until that was done once. */
  hint(words: string): void {
    this.#hint.textContent = words;
  }

  hideHint(): void {
    this.#hint.classList.add("gone");
  }

  /** Marks the way one sees now. */
  mark(way: Way): void {
    for (const [each, made] of this.#ways) made.setAttribute("aria-pressed", String(each === way));
  }
}
