/** How long one stays at a stop of the guided tour: as it says, else as long as reading takes. */

import type { Stop } from "../tour.ts";

/** Letters that are read in a second, and how long one stays at least and at most. */
const LETTERS_S = 14;
const STAY_S = [5, 30] as const;

/** Seconds that reading a text takes. */
export function readingS(text: string): number {
  return Math.min(STAY_S[1], Math.max(STAY_S[0], text.length / LETTERS_S + 2));
}

/** Seconds at a stop that tells `text`. */
export function stayS(stop: Stop, text: string): number {
  return stop.seconds ?? readingS(text);
}
