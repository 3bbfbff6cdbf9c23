/** Passes a view on: its address, a frame for one's own page, the system's own way of sharing. */

import { button, element, icon, ICONS } from "../dom.ts";
import type { Words } from "../words.ts";

const FRAME = { width: 960, height: 540 };
const TOLD_MS = 2500;

/** What the panel about sharing holds. */
export function shareSheet(title: string, address: string, words: Words): HTMLElement {
  const sheet = element(
    "div",
    { class: "share" },
    copied(words.shareLink, address, words),
    copied(words.shareFrame, frameOf(title, address), words),
  );
  if (typeof navigator.share === "function") {
    const send = button("plain-button", () => {
      void navigator.share({ title, url: address }).catch(() => undefined); // closed by the visitor
    });
    send.append(icon(ICONS.share), words.shareSend);
    sheet.append(send);
  }
  return sheet;
}

/** The element that shows a view in another page. */
export function frameOf(title: string, address: string): string {
  const frame = element("iframe", {
    src: address,
    title,
    width: String(FRAME.width),
    height: String(FRAME.height),
    allow: "fullscreen; xr-spatial-tracking",
    loading: "lazy",
  });
  return frame.outerHTML;
}

/** Copies a text. Returns whether that is allowed here: over plain http there is no clipboard. */
async function copy(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}

/** A text that one click copies. */
function copied(label: string, text: string, words: Words): HTMLElement {
  const field = element("textarea", { readonly: true, rows: "3", spellcheck: "false" }, text);
  field.addEventListener("focus", () => field.select());
  const told = element("span", { role: "status" });
  const act = button("plain-button", () => {
    void copy(text).then((done) => {
      if (!done) return field.focus(); // selected, to be copied by hand
      told.textContent = words.copied;
      setTimeout(() => (told.textContent = ""), TOLD_MS);
    });
  });
  act.append(icon(ICONS.copy), words.copy);
  return element("div", {}, element("label", {}, element("span", {}, label), field), act, told);
}
