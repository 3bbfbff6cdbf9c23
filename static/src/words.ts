/** The viewer's own words, and which of the tour's languages a visitor gets. */

import type { Texts } from "./tour.ts";
import { ENGLISH, type Words } from "./words/en.ts";
import { FRENCH } from "./words/fr.ts";

export type { Words } from "./words/en.ts";

const RIGHT_TO_LEFT = new Set(["ar", "dv", "fa", "he", "ps", "sd", "ug", "ur", "yi"]);

/** Which way a language is written, as the attribute `dir` says it. */
export function directionOf(language: string): "ltr" | "rtl" {
  return RIGHT_TO_LEFT.has(primary(language)) ? "rtl" : "ltr";
}

/** The viewer's words in `language`; English where it knows no better. */
export function wordsIn(language: string): Words {
  return primary(language) === "fr" ? FRENCH : ENGLISH;
}

/** The visitor's own manner of a language, "en-GB" of "en", for numbers and dates. */
export function mannerOf(language: string): string {
  return navigator.languages.find((each) => primary(each) === primary(language)) ?? language;
}

/** The text in `language`, else in any language there is. */
export function textIn(texts: Texts, language: string): string {
  return texts[language] ?? Object.values(texts)[0] ?? "";
}

/** The first of the visitor's wishes that the tour speaks, by full tag, then by primary subtag. */
export function chooseLanguage(
  spoken: readonly string[],
  wishes: readonly (string | null)[],
): string {
  for (const wish of wishes) {
    if (wish === null) continue;
    const found =
      spoken.find((tag) => tag.toLowerCase() === wish.toLowerCase()) ??
      spoken.find((tag) => primary(tag) === primary(wish));
    if (found !== undefined) return found;
  }
  return spoken[0] ?? "en";
}

function primary(tag: string): string {
  return tag.toLowerCase().split("-")[0] ?? tag;
}
