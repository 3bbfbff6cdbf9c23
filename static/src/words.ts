/** The viewer's own words, and which of the tour's languages a visitor gets. */

import type { Texts } from "./tour.ts";

const ENGLISH = {
  loading: "Loading",
  rooms: "Rooms",
  about: "About this room",
  language: "Language",
  close: "Close",
  doors: "Doors",
  retry: "Try again",
  back: "Back to the start",
  view: "View of the room: drag to look around, arrow keys to walk",
  hintMouse: "Drag to look around · click the floor or use the arrow keys to walk",
  hintTouch: "Drag to look around · tap the floor to walk · two fingers to move",
  noWebgl: "This browser cannot show the room in three dimensions. Its pictures and texts are below.",
  noTour: "The tour could not be loaded.",
  noRoom: "This room could not be loaded.",
  partMissing: "A part of this room could not be loaded.",
  contextLost: "The graphics of this device paused. The room comes back by itself.",
};

export type Words = typeof ENGLISH;

const FRENCH: Words = {
  loading: "Chargement",
  rooms: "Salles",
  about: "À propos de cette salle",
  language: "Langue",
  close: "Fermer",
  doors: "Portes",
  retry: "Réessayer",
  back: "Revenir au début",
  view: "Vue de la salle : glisser pour regarder, flèches pour marcher",
  hintMouse: "Glisser pour regarder · cliquer le sol ou utiliser les flèches pour marcher",
  hintTouch: "Glisser pour regarder · toucher le sol pour marcher · deux doigts pour avancer",
  noWebgl:
    "Ce navigateur ne peut pas montrer la salle en trois dimensions. Ses images et ses textes sont ci-dessous.",
  noTour: "La visite n’a pas pu être chargée.",
  noRoom: "Cette salle n’a pas pu être chargée.",
  partMissing: "Une partie de cette salle n’a pas pu être chargée.",
  contextLost: "L’affichage de cet appareil s’est interrompu. La salle revient d’elle-même.",
};

/** The viewer's words in `language`; English where it knows no better. */
export function wordsIn(language: string): Words {
  return primary(language) === "fr" ? FRENCH : ENGLISH;
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
