/**
 * Opens the room that page and address say, or shows the plain page. The poster is all that a
 * visitor waits for, and stands first: the room begins when it is drawn. What the room needs is asked
 * for meanwhile, on a phone when the whole page stands, which is read first there.
 */

import { takeAlongInTime } from "./along/along.ts";
import type { Addresses } from "./address.ts";
import { element, isTouch, pause } from "./dom.ts";
import type { Files } from "./files.ts";
import { kioskSettings } from "./kiosk/settings.ts";
import { chosenLanguage } from "./past.ts";
import { BINARY, WRAPPER } from "./scene/decoder.ts";
import { askForRoom } from "./scene/prefetch.ts";
import { fetchTour, roomCalled, startOf } from "./tour.ts";
import { bringWords, chooseLanguage, SPOKEN, wordsIn } from "./words.ts";

const PATIENCE_MS = 500;
/** A phone that begins a room hears no finger for seconds: so long its page can be read before. */
const READING_MS = 2500;

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
  const asked = addresses.languageAt(new URL(location.href));
  const wishes = [asked, chosenLanguage(), ...navigator.languages];
  const own = chooseLanguage(SPOKEN, wishes);
  const give = async (why: "noTour" | "noWebgl"): Promise<void> => {
    plain?.();
    await bringWords(own);
    const words = wordsIn(own);
    showPlain(host, words[why], why === "noTour" ? words.retry : undefined);
  };
  const films = new URLSearchParams(location.search).has("film");
  const kiosk = host.dataset["kiosk"];
  keepIcon();
  const touched = touch();
  const stands = isTouch() ? quiet(host) : painted(host);
  if (!films && isTouch()) await Promise.race([touched, stands]);
  const coming = fetchTour(files);
  if (files.home) askAhead(host, files);
  void bringWords(own); // most likely the tour's, too, which is not known yet
  const tour = await arrived(coming);
  if (!tour) return give("noTour");
  if (films) {
    const language = chooseLanguage(tour.languages, [asked]);
    const [script] = await Promise.all([arrived(import("./film/film.ts")), bringWords(language)]);
    if (!script) return give("noTour");
    new script.Film(host, files, tour, language);
    return;
  }
  const named = addresses.roomAt(new URL(location.href)) ?? host.dataset["room"] ?? null;
  const found = roomCalled(tour, named);
  const room = found ?? startOf(tour);
  if (files.home) askForRoom(files, room);
  const language = chooseLanguage(tour.languages, wishes);
  const spoken = bringWords(language);
  if (!isTouch() && kiosk === undefined) void prepare(files);
  await Promise.race([touched, isTouch() && kiosk === undefined ? pause(READING_MS) : stands]);
  const canvas = drawable();
  if (!canvas) return give("noWebgl");
  if (kiosk !== undefined) {
    const script = await arrived(import("./kiosk/open.ts"));
    if (!script) return give("noTour");
    return script.openKiosk(host, canvas, files, addresses, tour, room, kioskSettings(kiosk));
  }
  const [script] = await Promise.all([arrived(import("./visit.ts")), spoken]);
  if (!script) return give("noTour");
  const nothing = (): void => undefined;
  const manner = { kiosk: false, language, opened: nothing, played: nothing, home: nothing };
  const visit = await script.Visit.of(host, canvas, files, addresses, tour, room, manner);
  visit.start(found === null);
  if (files.home) takeAlongInTime(files.home, tour);
}

/** What was asked for; null where it does not come. */
async function arrived<T>(coming: Promise<T>): Promise<T | null> {
  try {
    return await coming;
  } catch (error) {
    console.warn(error);
    return null;
  }
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

/** Resolves when the page is loaded, its poster on screen, and nothing else is to be done. */
async function quiet(host: HTMLElement): Promise<void> {
  if (document.readyState !== "complete") {
    await new Promise((done) => window.addEventListener("load", done, { once: true }));
  }
  await painted(host);
  if (!("requestIdleCallback" in window)) return; // Safari
  await new Promise((done) => requestIdleCallback(done, { timeout: PATIENCE_MS }));
}

/**
 * Resolves when the poster is drawn. It is decoded with the page's picture (`decoding="sync"`): the
 * first from here on holds it, and by the second it has left the page's hands.
 */
async function painted(host: HTMLElement): Promise<void> {
  await come(host.querySelector("img"));
  const drawn = new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  await Promise.race([drawn, pause(PATIENCE_MS)]); // there are no pictures of a page that is hidden
}

/** Resolves when a picture has come, or never will. */
function come(poster: HTMLImageElement | null): Promise<void> {
  return new Promise((done) => {
    if (!poster || poster.complete) return done();
    for (const how of ["load", "error"]) poster.addEventListener(how, () => done(), { once: true });
  });
}

/** Asks at once for all scripts that the visit consists of, as the page names them, and decoder. */
function askAhead(host: HTMLElement, files: Files): void {
  for (const name of host.dataset["scripts"]?.split(" ") ?? []) {
    const href = files.source(`viewer/${name}`);
    document.head.append(element("link", { rel: "modulepreload", href }));
  }
  for (const path of [WRAPPER, BINARY]) {
    void files.fetch(files.locate(path), { priority: "low" }).catch(() => undefined); // asked again
  }
}

/** Has scripts and decoder ready when the poster stands; whoever needs them tells what fails. */
async function prepare(files: Files): Promise<void> {
  const visit = await import("./visit.ts").catch(() => null);
  visit?.Visit.prepare(files);
}

/** What the room is drawn on, made while its scripts come; null where nothing can be. */
function drawable(): HTMLCanvasElement | null {
  const canvas = element("canvas", { tabindex: "0", role: "application" });
  return canvas.getContext("webgl2") && canvas;
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
