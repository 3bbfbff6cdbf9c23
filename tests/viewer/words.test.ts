import assert from "node:assert/strict";
import { test } from "node:test";
import { bringWords, directionOf, SPOKEN, wordsIn, type Words } from "../../static/src/words.ts";
import { ENGLISH } from "../../static/src/words/en.ts";

const KEYS = Object.keys(ENGLISH) as (keyof Words)[];
const OTHERS = SPOKEN.filter((language) => language !== "en");

const gaps = (text: string): number => text.split("{}").length - 1;

test("a language's words come when they are asked for; until then, and of others, English", async () => {
  assert.equal(wordsIn("de-AT").close, "Close");
  await bringWords("de-AT", "ja");
  assert.equal(wordsIn("de-AT").close, "Schließen");
  assert.equal(wordsIn("de").close, "Schließen");
  assert.equal(wordsIn("ja").close, "Close");
  assert.equal(wordsIn("fr-CA").close, "Close");
  await bringWords("fr-CA");
  assert.equal(wordsIn("fr-CA").close, "Fermer");
});

test("every language says all there is to be said, with the same gaps", async () => {
  await bringWords(...SPOKEN);
  assert.deepEqual([...SPOKEN].sort(), ["ar", "br", "de", "en", "es", "fr", "it", "nl", "pt"]);
  for (const language of OTHERS) {
    const words = wordsIn(language);
    assert.notEqual(words, ENGLISH, language);
    assert.deepEqual(Object.keys(words), KEYS, language);
    for (const key of KEYS) {
      assert.notEqual(words[key].trim(), "", `${language}: ${key}`);
      assert.equal(gaps(words[key]), gaps(ENGLISH[key]), `${language}: ${key}`);
    }
  }
});

test("no line was left in English", async () => {
  await bringWords(...SPOKEN);
  const sentences = KEYS.filter((key) => ENGLISH[key].includes(" "));
  for (const language of OTHERS) {
    for (const key of sentences) {
      assert.notEqual(wordsIn(language)[key], ENGLISH[key], `${language}: ${key}`);
    }
  }
});

test("of the viewer's languages one is written from right to left", () => {
  assert.deepEqual(SPOKEN.filter((language) => directionOf(language) === "rtl"), ["ar"]);
});
