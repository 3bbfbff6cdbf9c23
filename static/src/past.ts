/** What the browser keeps of a visit: where rooms were left, which language was chosen. */

import type { Triple, View } from "./tour.ts";

/** A room that was left, and how one stood in it. */
export interface Left extends View {
  readonly room: string;
}

/** What the present entry of the history says, if it is of ours. */
export function leftAt(state: unknown): Left | null {
  const left = state as Left | null;
  return left && typeof left.room === "string" && isTriple(left.position) && isTriple(left.look_at)
    ? left
    : null;
}

function isTriple(value: unknown): value is Triple {
  return Array.isArray(value) && value.length === 3 && value.every(Number.isFinite);
}

const LANGUAGE = "tourgen.language";

/** The language chosen before, or null. Storage is refused where cookies are. */
export function chosenLanguage(): string | null {
  try {
    return localStorage.getItem(LANGUAGE);
  } catch {
    return null;
  }
}

/** Remembers a language; where storage is refused, for as long as the page stands. */
export function chooseLanguageForGood(language: string): void {
  try {
    localStorage.setItem(LANGUAGE, language);
  } catch {
    return;
  }
}
