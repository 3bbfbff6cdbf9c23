/** An address as a QR code, for a telephone of one's own: the kiosk itself opens none. */

import { element } from "../dom.ts";
import type { Words } from "../words.ts";

export function codeSheet(address: string, picture: string | null, words: Words): Node[] {
  const shown = address.replace(/^(https?:\/\/|mailto:)/, "").replace(/\/$/, "");
  const told = element("p", { class: "code-address" }, shown);
  if (picture === null) return [told];
  return [
    element("img", { class: "code", src: picture, alt: address }),
    element("p", {}, words.kioskCodeHint),
    told,
  ];
}
