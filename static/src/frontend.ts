/** All that stands over the picture: header, cover, panel, messages, doors and notes. */

import { roomAddress } from "./address.ts";
import { Cover } from "./cover.ts";
import { element, isTouch } from "./dom.ts";
import { Header } from "./header.ts";
import { Hotspots } from "./hotspots.ts";
import { Notice } from "./notice.ts";
import { Panel, prose } from "./panel.ts";
import { doorSpot, noteSpot, type SignEvents } from "./signs.ts";
import type { Note, Room, Tour } from "./tour.ts";
import { textIn, wordsIn, type Words } from "./words.ts";

export interface FrontendEvents extends SignEvents {
  /** A room was chosen from the list. */
  chosen(room: Room): void;
  /** Another language was chosen; everything here speaks it already. */
  language(tag: string): void;
}

export class Frontend {
  readonly canvas = element("canvas", { tabindex: "0", role: "application" });
  readonly spots = new Hotspots();
  readonly notice = new Notice();
  readonly cover: Cover;
  readonly #panel = new Panel();
  readonly #header: Header;
  readonly #hint = element("p", { class: "hint" });
  readonly #site: URL;
  readonly #tour: Tour;
  readonly #events: FrontendEvents;
  #room: Room;
  #language: string;
  #words: Words;
  #revealed = false;

  constructor(
    host: HTMLElement,
    site: URL,
    tour: Tour,
    room: Room,
    language: string,
    events: FrontendEvents,
  ) {
    this.#site = site;
    this.#tour = tour;
    this.#room = room;
    this.#events = events;
    this.#language = language;
    this.#words = wordsIn(language);
    this.cover = new Cover(host.querySelector("img") ?? element("img", { alt: "" }));
    this.#header = new Header(tour.languages, {
      rooms: () => this.#listRooms(),
      about: () => this.#panel.open(this.text(this.#room.title), prose(this.text(this.#room.text))),
      language: (tag) => this.#speak(tag),
    });
    host.replaceChildren(
      this.canvas,
      this.spots.element,
      this.cover.element,
      this.#hint,
      this.#header.element,
      this.#panel.element,
      this.notice.element,
    );
  }

  get words(): Words {
    return this.#words;
  }

  text(texts: Readonly<Record<string, string>>): string {
    return textIn(texts, this.#language);
  }

  /** Announces a room that is on its way. */
  expect(room: Room, passing: boolean): void {
    this.#room = room;
    this.#revealed = false;
    this.#panel.close();
    this.notice.clear();
    this.spots.show([]);
    this.#say();
    const poster = new URL(room.poster, this.#site).href;
    this.cover.show(poster, this.text(room.title), this.#words.loading, passing);
  }

  /** Shows the room's doors and notes, and takes the cover away. */
  reveal(): void {
    this.cover.progress(1);
    this.cover.hide();
    this.#revealed = true;
    this.#showSpots();
  }

  hideHint(): void {
    this.#hint.classList.add("gone");
  }

  #showSpots(): void {
    this.spots.show([
      ...this.#room.links.map((link) => doorSpot(link, this.text(link.title), this.#events)),
      ...this.#room.notes.map((note) =>
        noteSpot(note, this.text(note.title), () => this.#openNote(note), this.#events),
      ),
    ]);
  }

  #openNote(note: Note): void {
    const title = this.text(note.title);
    const content: Node[] = [prose(this.text(note.text))];
    if (note.image) {
      content.unshift(element("img", { src: new URL(note.image, this.#site).href, alt: title }));
    }
    this.#panel.open(title, ...content);
  }

  #listRooms(): void {
    const items = this.#tour.rooms.map((room) => {
      const current = room === this.#room;
      const link = element(
        "a",
        {
          href: roomAddress(this.#site, room.id, location.search),
          ...(current ? { "aria-current": "page" } : {}),
        },
        element("img", { src: new URL(room.poster, this.#site).href, alt: "", loading: "lazy" }),
        element("span", {}, this.text(room.title)),
      );
      link.addEventListener("click", (event) => {
        if (event.ctrlKey || event.metaKey || event.shiftKey) return;
        event.preventDefault();
        this.#panel.close();
        if (!current) this.#events.chosen(room);
      });
      return element("li", {}, link);
    });
    this.#panel.open(this.#words.rooms, element("ul", { class: "rooms" }, ...items));
  }

  #speak(language: string): void {
    this.#language = language;
    this.#words = wordsIn(language);
    this.#panel.close();
    this.notice.clear();
    this.#say();
    if (this.#revealed) this.#showSpots();
    this.#events.language(language);
  }

  #say(): void {
    const room = this.text(this.#room.title);
    const tour = this.text(this.#tour.title);
    document.documentElement.lang = this.#language;
    document.title = room === tour ? tour : `${room} – ${tour}`;
    const hasText = this.text(this.#room.text) !== "";
    this.#header.say(this.#words, this.#language, tour, room, hasText);
    this.#panel.setWords(this.#words.close);
    this.canvas.setAttribute("aria-label", this.#words.view);
    this.spots.element.setAttribute("aria-label", this.#words.doors);
    this.#hint.textContent = isTouch() ? this.#words.hintTouch : this.#words.hintMouse;
  }
}
