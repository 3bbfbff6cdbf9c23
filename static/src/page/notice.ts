/**
 * Messages: a line that passes, or one that stays with ways on from it. Of those that hold one shows:
 * a grave one, or else what was told last.
 */

import { element } from "../dom.ts";
import type { Words } from "../words.ts";

export interface Action {
  readonly label: keyof Words;
  act(): void;
}

export interface Message {
  /** Told again, it takes its own place. */
  readonly says: keyof Words;
  /** What stands in its gap. */
  readonly of?: string;
  readonly ways?: readonly Action[];
  /** Nothing can be shown: told at once to screen readers, in the middle, over all others. */
  readonly grave?: boolean;
  /** It is of no room, and stays when one goes to another. */
  readonly lasts?: boolean;
}

export class Notice {
  readonly element = element("div", { class: "notice", hidden: true });
  readonly #messages = new Map<keyof Words, Message>();
  #words: Words;
  #shown: Message | null = null;

  constructor(words: Words) {
    this.#words = words;
  }

  tell(message: Message): void {
    this.#messages.set(message.says, message);
    this.#show();
  }

  /** A line that stays until it is closed. */
  tellUntilClosed(says: keyof Words, lasts = false): void {
    this.tell({ says, lasts, ways: [{ label: "close", act: () => undefined }] });
  }

  /** What was told holds no more. */
  withdraw(says: keyof Words): void {
    this.#messages.delete(says);
    this.#show();
  }

  /** The room is left. */
  leave(): void {
    for (const { says, lasts } of this.#messages.values()) if (!lasts) this.#messages.delete(says);
    this.#show();
  }

  clear(): void {
    this.#messages.clear();
    this.#show();
  }

  /** Speaks another language. */
  say(words: Words): void {
    if (words === this.#words) return; // or what is read already would be read out again
    this.#words = words;
    this.#shown = null;
    this.#show();
  }

  #show(): void {
    const messages = [...this.#messages.values()];
    const message = messages.find(({ grave }) => grave) ?? messages.at(-1) ?? null;
    if (message === this.#shown) return;
    this.#shown = message;
    this.element.hidden = message === null;
    if (message) this.#draw(message);
  }

  #draw({ says, of = "", ways = [], grave = false }: Message): void {
    this.element.classList.toggle("grave", grave);
    this.element.setAttribute("role", grave ? "alert" : "status");
    const buttons = ways.map(({ label, act }) => {
      const button = element("button", { type: "button", class: "plain-button" }, this.#words[label]);
      button.addEventListener("click", () => {
        this.withdraw(says);
        act();
      });
      return button;
    });
    const line = this.#words[says].replace("{}", of);
    this.element.replaceChildren(element("p", {}, line), ...buttons);
  }
}
