/** Finds rooms and notes by their words, as they are typed, with a letter wrong or a word begun. */

import MiniSearch from "minisearch";
import { element } from "../dom.ts";
import type { Note, Room, Tour } from "../tour.ts";
import { textIn, type Words } from "../words.ts";

const MOST = 12;
const FUZZY = 0.2;
const TITLE_BOOST = 3;
const EXCERPT = 90;

export interface SearchEvents {
  /** Something was chosen: a room, or a note of it. */
  chosen(room: Room, note: Note | null): void;
}

interface Entry {
  readonly id: number;
  readonly title: string;
  readonly text: string;
}

interface Target {
  readonly room: Room;
  readonly note: Note | null;
}

export class Search {
  readonly element: HTMLElement;
  readonly #index = new MiniSearch<Entry>({
    fields: ["title", "text"],
    storeFields: ["title", "text"],
    processTerm: plainly,
    searchOptions: { prefix: true, fuzzy: FUZZY, boost: { title: TITLE_BOOST }, combineWith: "AND" },
  });
  readonly #targets: Target[] = [];
  readonly #input: HTMLInputElement;
  readonly #found = element("ul", { class: "found" });
  readonly #said = element("p", { class: "found-count", role: "status" });
  readonly #words: Words;
  readonly #events: SearchEvents;
  readonly #language: string;

  constructor(tour: Tour, language: string, words: Words, events: SearchEvents) {
    this.#words = words;
    this.#events = events;
    this.#language = language;
    const entries: Entry[] = [];
    const add = (title: string, html: string, target: Target): void => {
      entries.push({ id: this.#targets.length, title, text: wordsOf(html) });
      this.#targets.push(target);
    };
    for (const room of tour.rooms) {
      add(textIn(room.title, language), textIn(room.text, language), { room, note: null });
      for (const note of room.notes) {
        add(textIn(note.title, language), textIn(note.text, language), { room, note });
      }
    }
    this.#index.addAll(entries);
    this.#input = element("input", {
      type: "search",
      class: "search-input",
      "aria-label": words.search,
      placeholder: words.searchHint,
      autocomplete: "off",
      spellcheck: "false",
    });
    this.#input.addEventListener("input", () => this.#show());
    this.element = element("div", { class: "search" }, this.#input, this.#said, this.#found);
  }

  focus(): void {
    this.#input.focus();
  }

  #show(): void {
    const asked = this.#input.value.trim();
    const results = asked ? this.#index.search(asked).slice(0, MOST) : [];
    this.#said.textContent = asked
      ? this.#words.found.replace("{}", String(results.length))
      : "";
    this.#found.replaceChildren(
      ...results.flatMap((result) => {
        const target = this.#targets[result.id as number];
        return target ? [this.#item(target, result["title"] as string, result["text"] as string)] : [];
      }),
    );
  }

  #item(target: Target, title: string, text: string): HTMLElement {
    const place = target.note ? textIn(target.room.title, this.#language) : this.#words.room;
    const item = element(
      "button",
      { type: "button", class: "found-item" },
      element("strong", {}, title),
      element("small", {}, place),
      element("span", {}, text.length > EXCERPT ? `${text.slice(0, EXCERPT)}…` : text),
    );
    item.addEventListener("click", () => this.#events.chosen(target.room, target.note));
    return element("li", {}, item);
  }
}

/** Words without accents and capitals. */
function plainly(term: string): string {
  return term.normalize("NFD").replace(/\p{M}/gu, "").toLowerCase();
}

function wordsOf(html: string): string {
  return new DOMParser().parseFromString(html, "text/html").body.textContent.replace(/\s+/g, " ").trim();
}
