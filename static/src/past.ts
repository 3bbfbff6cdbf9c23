/** Which language was chosen before. */

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
