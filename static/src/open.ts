/** Opens the room that page and address say, or shows the plain page. */

import { takeAlongInTime } from "./along/along.ts";
import type { Addresses } from "./address.ts";
import { element } from "./dom.ts";
import type { Files } from "./files.ts";
import { kioskSettings } from "./kiosk/settings.ts";
import { fetchTour, roomCalled, startOf } from "./tour.ts";
import { chooseLanguage, wordsIn } from "./words.ts";

const PATIENCE_MS = 500;

/** The page's element that the tour goes into. */
export function hostIn(page: Document): HTMLElement {
  const host = page.getElementById("tour");
  if (!host) throw new Error("page: expected an element with id `tour`, found none");
  return host;
}

/**
 * @param files The tour's.
 * @param addresses How its rooms are named in the address.
 * @param plain Called before the plain page is shown.
 */
export async function open(
  host: HTMLElement,
  files: Files,
  addresses: Addresses,
  plain?: () => void,
): Promise<void> {
  const words = wordsIn(chooseLanguage(["en", "fr"], navigator.languages));
  const give = (message: string, retry?: string): void => {
    plain?.();
    showPlain(host, message, retry);
  };
  if (!canDraw()) return give(words.noWebgl);
  let tour;
  try {
    tour = await fetchTour(files);
  } catch (error) {
    console.warn(error);
    return give(words.noTour, words.retry);
  }
  if (new URLSearchParams(location.search).has("film")) {
    const { Film } = await import("./film/film.ts");
    new Film(host, files, tour);
    return;
  }
  keepIcon();
  await quiet(host);
  const named = addresses.roomAt(new URL(location.href)) ?? host.dataset["room"] ?? null;
  const asked = roomCalled(tour, named);
  const room = asked ?? startOf(tour);
  const told = host.dataset["kiosk"];
  if (told !== undefined) {
    const { openKiosk } = await import("./kiosk/open.ts");
    return openKiosk(host, files, addresses, tour, room, kioskSettings(told));
  }
  const { Visit } = await import("./visit.ts");
  const manner = { kiosk: false, opened: () => undefined, home: () => undefined };
  new Visit(host, files, addresses, tour, room, manner).start(asked === null);
  if (files.home) takeAlongInTime(files.home, tour);
}

/** The page's address will change with the rooms; what it names relatively must not. */
function keepIcon(): void {
  const icon = document.querySelector<HTMLLinkElement>("link[rel=icon]");
  if (icon) icon.href = new URL(icon.href).href;
}

/** Waits until the page stands and nothing else is to be done, or the visitor asks for the room. */
function quiet(host: HTMLElement): Promise<void> {
  return new Promise((done) => {
    const start = (): void => done();
    for (const asked of ["pointerdown", "keydown", "focusin"]) {
      host.ownerDocument.addEventListener(asked, start, { once: true, passive: true });
    }
    const idle = (): void => {
      if ("requestIdleCallback" in window) requestIdleCallback(start, { timeout: PATIENCE_MS });
      else setTimeout(start, 0); // Safari
    };
    if (document.readyState === "complete") idle();
    else window.addEventListener("load", idle, { once: true });
  });
}

function canDraw(): boolean {
  return document.createElement("canvas").getContext("webgl2") !== null;
}

/** Shows the page's own pictures and texts under a line that says why. */
function showPlain(host: HTMLElement, message: string, retry?: string): void {
  document.documentElement.classList.add("without-room");
  const notice = element("div", { class: "notice grave", role: "alert" }, element("p", {}, message));
  if (retry !== undefined) {
    const button = element("button", { type: "button", class: "plain-button" }, retry);
    button.addEventListener("click", () => location.reload());
    notice.append(button);
  }
  host.append(notice);
}
