/** A sheet beside the room: what it tells, or the list of rooms. One at a time. */

import { element, icon, ICONS } from "../dom.ts";

export class Panel {
  readonly element: HTMLElement;
  readonly #title = element("h2", { id: "panel-title" });
  readonly #body = element("div", { class: "panel-body", tabindex: "0" });
  readonly #close: HTMLButtonElement;
  readonly #closed: () => void;
  #opener: Element | null = null;

  /** @param closed Told when it is closed or shows something else. */
  constructor(closed: () => void) {
    this.#closed = closed;
    this.#close = element("button", { class: "round", type: "button" });
    this.#close.append(icon(ICONS.close));
    this.#close.addEventListener("click", () => this.close());
    this.element = element(
      "section",
      { class: "panel", role: "dialog", "aria-labelledby": "panel-title", hidden: true },
      element("div", { class: "panel-head" }, this.#title, this.#close),
      this.#body,
    );
    this.element.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.close();
    });
  }

  get isOpen(): boolean {
    return !this.element.hidden;
  }

  /** Whether a sound plays in it. */
  get isSounding(): boolean {
    return [...this.#body.querySelectorAll("audio")].some((sound) => !sound.paused);
  }

  setWords(close: string): void {
    this.#close.setAttribute("aria-label", close);
  }

  open(title: string, ...content: readonly Node[]): void {
    if (this.isOpen) this.#closed();
    else this.#opener = document.activeElement;
    this.#silence();
    this.#title.textContent = title;
    this.#body.replaceChildren(...content);
    this.#body.scrollTop = 0;
    this.element.hidden = false;
    this.#close.focus({ preventScroll: true });
  }

  close(): void {
    if (!this.isOpen) return;
    const hadFocus = this.element.contains(document.activeElement);
    this.element.hidden = true;
    this.#silence();
    this.#closed();
    if (hadFocus && this.#opener instanceof HTMLElement) {
      this.#opener.focus({ preventScroll: true });
    }
  }

  /** Ends a sound that plays in it. */
  #silence(): void {
    for (const sound of this.#body.querySelectorAll("audio")) sound.pause();
  }
}

/** Text of the tour that the generator made of Markdown, without any HTML of the author's. */
export function prose(html: string): HTMLElement {
  const made = element("div", { class: "prose" });
  made.innerHTML = html;
  return made;
}
