/** Messages: a line that passes, or one that stays with ways on from it. */

import { element } from "../dom.ts";

export interface Action {
  readonly label: string;
  act(): void;
}

export class Notice {
  readonly element = element("div", { class: "notice", hidden: true });

  /** @param grave Nothing can be shown: told at once to screen readers, in the middle. */
  tell(message: string, actions: readonly Action[], grave = false): void {
    this.element.classList.toggle("grave", grave);
    this.element.setAttribute("role", grave ? "alert" : "status");
    const buttons = actions.map(({ label, act }) => {
      const button = element("button", { type: "button", class: "plain-button" }, label);
      button.addEventListener("click", () => {
        this.clear();
        act();
      });
      return button;
    });
    this.element.replaceChildren(element("p", {}, message), ...buttons);
    this.element.hidden = false;
  }

  /** A line that stays until it is closed. */
  tellUntilClosed(message: string, close: string): void {
    this.tell(message, [{ label: close, act: () => undefined }]);
  }

  clear(): void {
    this.element.hidden = true;
  }
}
