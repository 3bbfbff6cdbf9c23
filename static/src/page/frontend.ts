/** All that stands over the picture: header, dock, cover, panel, messages, doors and notes. */

import type { Addresses, Way } from "../address.ts";
import { element, isTouch } from "../dom.ts";
import type { Files } from "../files.ts";
import type { Note, Room, Texts, Tour } from "../tour.ts";
import { bringWords, directionOf, textIn, wordsIn, type Words } from "../words.ts";
import { Cover } from "./cover.ts";
import { Dock } from "./dock.ts";
import { Header } from "./header.ts";
import { Hotspots, type Spot } from "./hotspots.ts";
import { MiniMap } from "./mini-map.ts";
import { Notice } from "./notice.ts";
import { Panel, prose } from "./panel.ts";
import { creditsSheet, helpSheet, noteSheet, roomsSheet, toolsSheet, type Tool } from "./sheets.ts";
import { doorSpot, noteSpot, type SignEvents } from "./signs.ts";

export interface FrontendEvents extends SignEvents {
  /** A room was chosen from the list. */
  chosen(room: Room): void;
  /** A note was chosen; `lead`: from a list, so that one is brought before it. */
  noted(room: Room, note: Note, lead: boolean): void;
  /** The panel shows no note any more. */
  closed(): void;
  see(way: Way): void;
  guide(): void;
  search(): void;
  /** What there is to do, beside what the frontend does itself. */
  tools(): readonly Tool[];
  /** Another language was chosen; everything here speaks it already. */
  language(tag: string): void;
  /** Back to the start, at a kiosk. */
  home(): void;
}

export class Frontend {
  readonly canvas: HTMLCanvasElement;
  readonly spots = new Hotspots();
  readonly notice: Notice;
  readonly cover: Cover;
  readonly map: MiniMap;
  readonly panel: Panel;
  readonly dock: Dock;
  /** Where modes put what they show over the picture. */
  readonly overlay = element("div", { class: "overlay" });
  readonly #header: Header;
  readonly #told = element("p", { class: "unseen", role: "status" });
  readonly #host: HTMLElement;
  readonly #files: Files;
  readonly #addresses: Addresses;
  readonly #tour: Tour;
  readonly #events: FrontendEvents;
  #room: Room;
  #language: string;
  #words: Words;
  /** The language that was chosen last, whose words may be on their way. */
  #chosen: string;
  #revealed = false;

  constructor(
    host: HTMLElement,
    canvas: HTMLCanvasElement,
    files: Files,
    addresses: Addresses,
    tour: Tour,
    room: Room,
    language: string,
    kiosk: boolean,
    events: FrontendEvents,
  ) {
    this.#host = host;
    this.canvas = canvas;
    this.#files = files;
    this.#addresses = addresses;
    this.#tour = tour;
    this.#room = room;
    this.#events = events;
    this.#language = language;
    this.#chosen = language;
    this.#words = wordsIn(language);
    this.notice = new Notice(this.#words);
    this.cover = new Cover(host.querySelector("img") ?? element("img", { alt: "" }));
    this.panel = new Panel(() => events.closed());
    this.map = new MiniMap(tour, () => events.see("plan"));
    const logo = tour.logo === null ? null : files.source(tour.logo);
    this.#header = new Header(logo, tour.languages, kiosk, {
      search: () => events.search(),
      rooms: () => this.#listRooms(),
      about: () => this.#tellAbout(),
      tools: () => this.openTools(),
      language: (tag) => void this.#choose(tag),
      home: () => events.home(),
    });
    this.dock = new Dock({ guide: () => events.guide(), see: (way) => events.see(way) });
    host.replaceChildren(
      this.canvas,
      this.spots.element,
      this.cover.element,
      this.overlay,
      this.#header.element,
      this.dock.element,
      this.map.element,
      this.panel.element,
      this.notice.element,
      this.#told,
    );
    this.#say();
  }

  get words(): Words {
    return this.#words;
  }

  get language(): string {
    return this.#language;
  }

  text(texts: Texts): string {
    return textIn(texts, this.#language);
  }

  /** The title of the view: that of the room and of the tour. */
  get title(): string {
    const room = this.text(this.#room.title);
    const tour = this.text(this.#tour.title);
    return room === tour ? tour : `${room} – ${tour}`;
  }

  /** Announces a room that is on its way. */
  expect(room: Room, passing: boolean): void {
    this.#room = room;
    this.#revealed = false;
    this.panel.close();
    this.notice.leave();
    this.spots.show([]);
    this.#say();
    const poster = this.#files.source(room.poster);
    this.cover.show(poster, this.text(room.title), this.#words.loading, passing);
  }

  /** Shows the room's doors and notes, takes the cover away, and says where one is. */
  reveal(): void {
    this.cover.progress(1);
    this.cover.hide();
    this.#revealed = true;
    this.showSigns();
    this.#told.textContent = this.#words.entered.replace("{}", this.text(this.#room.title));
  }

  /** What a script brings; null where it does not come, which is told. */
  async brought<T>(script: Promise<T>): Promise<T | null> {
    try {
      return await script;
    } catch (error) {
      reportError(error); // a kiosk keeps it
      const reload = { label: "reload", act: () => location.reload() } as const;
      const close = { label: "close", act: () => undefined } as const;
      this.notice.tell({ says: "pageMissing", ways: [reload, close] });
      return null;
    }
  }

  /** Marks the way one sees. */
  mark(way: Way): void {
    this.dock.mark(way);
    this.#host.dataset["see"] = way;
    this.#sayHint();
  }

  hideHint(): void {
    this.dock.hideHint();
  }

  /** @param signs Those of the room, if left out. */
  showSigns(signs?: readonly Spot[]): void {
    this.spots.show(
      signs ?? [
        ...this.#room.links.map((link) => doorSpot(link, this.text(link.title), this.#events)),
        ...this.#room.notes.map((note) =>
          noteSpot(
            note,
            this.text(note.title),
            () => this.#events.noted(this.#room, note, false),
            this.#events,
          ),
        ),
      ],
    );
  }

  openNote(note: Note): void {
    const content = noteSheet(note, this.#files, this.#language, this.#words);
    this.panel.open(this.text(note.title), ...content);
  }

  openTools(): void {
    const { words } = this;
    const more: Tool[] = [
      { name: words.help, drawing: "keys", act: () => this.panel.open(words.help, helpSheet(words)) },
      { name: words.credits, drawing: "about", act: () => this.#tellCredits() },
    ];
    this.panel.open(words.tools, toolsSheet([...this.#events.tools(), ...more]));
  }

  #tellAbout(): void {
    const text = this.text(this.#room.text);
    if (text === "") this.#tellCredits();
    else this.panel.open(this.text(this.#room.title), prose(text));
  }

  #tellCredits(): void {
    const content = creditsSheet(this.#tour, this.#room, this.#language, this.#words);
    this.panel.open(this.#words.credits, ...content);
  }

  #listRooms(): void {
    const items = this.#tour.rooms.map((room) => ({
      title: this.text(room.title),
      href: this.#addresses.ofRoom(new URL(location.href), room.id),
      poster: this.#files.source(room.poster),
      isHere: room === this.#room,
      notes: room.notes.map((note) => ({
        title: this.text(note.title),
        open: () => {
          this.panel.close();
          this.#events.noted(room, note, true);
        },
      })),
      choose: () => {
        this.panel.close();
        this.#events.chosen(room);
      },
    }));
    this.panel.open(this.#words.rooms, roomsSheet(items));
  }

  async #choose(language: string): Promise<void> {
    this.#chosen = language;
    await bringWords(language);
    if (language === this.#chosen) this.speak(language);
  }

  /** Speaks another language, whose words were brought. */
  speak(language: string): void {
    this.#language = language;
    this.#words = wordsIn(language);
    this.panel.close();
    this.#say();
    if (this.#revealed) this.showSigns();
    this.#events.language(language);
  }

  #say(): void {
    const { words } = this;
    const root = document.documentElement;
    root.lang = this.#language;
    root.dir = directionOf(this.#language);
    document.title = this.title;
    const tour = this.text(this.#tour.title);
    this.#host.setAttribute("aria-label", tour);
    this.#header.say(words, this.#language, tour, this.text(this.#room.title));
    this.dock.say(words);
    this.map.say(words);
    this.panel.setWords(words.close);
    this.notice.say(words);
    this.canvas.setAttribute("aria-label", words.view);
    this.spots.element.setAttribute("aria-label", words.doors);
    this.#sayHint();
  }

  #sayHint(): void {
    const { words } = this;
    const outside = this.#host.dataset["see"] === "orbit" || this.#host.dataset["see"] === "dollhouse";
    const onFoot = isTouch() ? words.hintTouch : words.hintMouse;
    this.dock.hint(outside ? words.hintOutside : onFoot);
  }
}
