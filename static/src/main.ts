/** The viewer's entry: reads what the page says, opens its room, or shows the plain page. */

import { element } from "./dom.ts";
import { fetchTour, roomCalled, startOf } from "./tour.ts";
import { chooseLanguage, wordsIn } from "./words.ts";

/** The decoder's folder beside this script; the bundler fills it in. */
declare const DRACO_FOLDER: string;

const PATIENCE_MS = 500;

async function main(): Promise<void> {
  const host = document.getElementById("tour");
  if (!host) throw new Error("page: expected an element with id `tour`, found none");
  const site = new URL(host.dataset["site"] ?? "./", location.href);
  const words = wordsIn(chooseLanguage(["en", "fr"], navigator.languages));
  if (!canDraw()) return showPlain(host, words.noWebgl);
  let tour;
  try {
    tour = await fetchTour(new URL("tour.json", site));
  } catch (error) {
    console.warn(error);
    showPlain(host, words.noTour, words.retry);
    return;
  }
  const decoder = new URL(DRACO_FOLDER, import.meta.url);
  if (new URLSearchParams(location.search).has("film")) {
    const { Film } = await import("./film/film.ts");
    new Film(host, site, decoder, tour);
    return;
  }
  keepIcon();
  await quiet(host);
  const asked = roomCalled(tour, host.dataset["room"] ?? null);
  const { Visit } = await import("./visit.ts");
  new Visit(host, site, decoder, tour, asked ?? startOf(tour)).start(asked === null);
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

await main();
