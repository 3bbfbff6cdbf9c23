/** The viewer's entry: reads what the page says, opens its room, or shows the plain page. */

import { element } from "./dom.ts";
import { fetchTour, roomOf } from "./tour.ts";
import { Visit } from "./visit.ts";
import { chooseLanguage, wordsIn } from "./words.ts";

/** The decoder's folder beside this script; the bundler fills it in. */
declare const DRACO_FOLDER: string;

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
  keepIcon();
  const decoder = new URL(DRACO_FOLDER, import.meta.url);
  new Visit(host, site, decoder, tour, roomOf(tour, host.dataset["room"] ?? null)).start();
}

/** The page's address will change with the rooms; what it names relatively must not. */
function keepIcon(): void {
  const icon = document.querySelector<HTMLLinkElement>("link[rel=icon]");
  if (icon) icon.href = new URL(icon.href).href;
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
