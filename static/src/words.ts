/** The viewer's own words, and which of the tour's languages a visitor gets. */

import type { Texts } from "./tour.ts";
import { ENGLISH, type Words } from "./words/en.ts";

export type { Words } from "./words/en.ts";

/** Scripts of their own: a visitor waits for the words of one language, not of all. */
const FETCHED: Readonly<Record<string, () => Promise<Words>>> = {
  ar: async () => (await import("./words/ar.ts")).ARABIC,
  br: async () => (await import("./words/br.ts")).BRETON,
  de: async () => (await import("./words/de.ts")).GERMAN,
  es: async () => (await import("./words/es.ts")).SPANISH,
  fr: async () => (await import("./words/fr.ts")).FRENCH,
  it: async () => (await import("./words/it.ts")).ITALIAN,
  nl: async () => (await import("./words/nl.ts")).DUTCH,
  pt: async () => (await import("./words/pt.ts")).PORTUGUESE,
};

/** The languages that the viewer speaks. English is always here, for when others do not come. */
export const SPOKEN: readonly string[] = ["en", ...Object.keys(FETCHED)];

const brought = new Map<string, Words>([["en", ENGLISH]]);

const RIGHT_TO_LEFT = new Set(["ar", "dv", "fa", "he", "ps", "sd", "ug", "ur", "yi"]);

/** Which way a language is written, as the attribute `dir` says it. */
export function directionOf(language: string): "ltr" | "rtl" {
  return RIGHT_TO_LEFT.has(primary(language)) ? "rtl" : "ltr";
}

/** Brings the viewer's words in some languages; what does not come is said in English. */
export async function bringWords(...languages: readonly string[]): Promise<void> {
  await Promise.all(languages.map(primary).map(bring));
}

async function bring(language: string): Promise<void> {
  if (brought.has(language)) return;
  try {
    const words = await FETCHED[language]?.();
    if (words) brought.set(language, words);
  } catch (error) {
    console.warn(error);
  }
}

/** The viewer's words in `language`, of those that were brought; else English. */
export function wordsIn(language: string): Words {
  return brought.get(primary(language)) ?? ENGLISH;
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
