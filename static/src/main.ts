/**
 * The viewer's entry: lets the page stand, then opens its room, or shows the plain page.
 *
 * The poster is all that a visitor waits for: whatever the room needs is asked for after it.
 */

import { element, isTouch, pause } from "./dom.ts";
import { DECODER } from "./scene/decoder.ts";
import { askForRoom } from "./scene/prefetch.ts";
import { fetchTour, roomCalled, startOf } from "./tour.ts";
import { chooseLanguage, wordsIn } from "./words.ts";

/** The decoder's folder beside this script; the bundler fills it in. */
declare const DRACO_FOLDER: string;

const PATIENCE_MS = 500;
/** A phone that begins a room hears no finger for seconds: so long its page can be read before. */
const READING_MS = 2500;

async function main(): Promise<void> {
  const host = document.getElementById("tour");
  if (!host) throw new Error("page: expected an element with id `tour`, found none");
  const site = new URL(host.dataset["site"] ?? "./", location.href);
  const words = wordsIn(chooseLanguage(["en", "fr"], navigator.languages));
  keepIcon();
  const touched = touch();
  await Promise.race([touched, quiet(host)]);
  const decoder = new URL(DRACO_FOLDER, import.meta.url);
  askAhead(host, site, decoder);
  let tour;
  try {
    tour = await fetchTour(new URL("tour.json", site));
  } catch (error) {
    console.warn(error);
    showPlain(host, words.noTour, words.retry);
    return;
  }
  const asked = roomCalled(tour, host.dataset["room"] ?? null);
  const room = asked ?? startOf(tour);
  void askForRoom(site, room);
  if (isTouch()) await Promise.race([touched, pause(READING_MS)]);
  if (!canDraw()) return showPlain(host, words.noWebgl);
  const { Visit } = await import("./visit.ts");
  new Visit(host, site, decoder, tour, room).start(asked === null);
}

/** The page's address will change with the rooms; what it names relatively must not. */
function keepIcon(): void {
  const icon = document.querySelector<HTMLLinkElement>("link[rel=icon]");
  if (icon) icon.href = new URL(icon.href).href;
}

/** Resolves when the visitor does anything to the page. */
function touch(): Promise<void> {
  return new Promise((done) => {
    for (const kind of ["pointerdown", "keydown", "focusin"]) {
      document.addEventListener(kind, () => done(), { once: true, passive: true });
    }
  });
}

/** Resolves when the page is loaded, its poster shown, and nothing else is to be done. */
async function quiet(host: HTMLElement): Promise<void> {
  if (document.readyState !== "complete") {
    await new Promise((done) => window.addEventListener("load", done, { once: true }));
  }
  await host.querySelector("img")?.decode().catch(() => undefined); // it shows no picture, then
  const painted = new Promise((done) =>
    new PerformanceObserver(done).observe({ type: "paint", buffered: true }),
  );
  await Promise.race([painted, pause(PATIENCE_MS)]);
  // What was decoded is on screen two frames later at the latest.
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  if (!("requestIdleCallback" in window)) return; // Safari
  await new Promise((done) => requestIdleCallback(done, { timeout: PATIENCE_MS }));
}

/** Asks at once for all scripts that the visit consists of, as the page names them, and decoder. */
function askAhead(host: HTMLElement, site: URL, decoder: URL): void {
  for (const name of host.dataset["scripts"]?.split(" ") ?? []) {
    const href = new URL(`viewer/${name}`, site).href;
    document.head.append(element("link", { rel: "modulepreload", href }));
  }
  for (const file of DECODER) {
    void fetch(new URL(file, decoder), { priority: "low" }).catch(() => undefined); // asked again
  }
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
