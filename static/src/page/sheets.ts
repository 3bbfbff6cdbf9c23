/** What the panel shows: a note, the rooms, the tools, the keys, how the tour was made. */

import { button, element, icon, ICONS } from "../dom.ts";
import type { Files } from "../files.ts";
import type { Note, Room, Tour } from "../tour.ts";
import { mannerOf, textIn, type Words } from "../words.ts";
import { prose } from "./panel.ts";

/** A note's picture, text and sound. */
export function noteSheet(note: Note, files: Files, language: string, words: Words): Node[] {
  const content: Node[] = [];
  if (note.image) {
    const src = files.source(note.image);
    content.push(element("img", { src, alt: textIn(note.image_text, language) }));
  }
  content.push(prose(textIn(note.text, language)));
  if (note.sound) content.push(soundOf(note, note.sound, files, language, words));
  return content;
}

/** A sound with its captions below it, as it goes. */
function soundOf(note: Note, sound: string, files: Files, language: string, words: Words): Node {
  const player = element("audio", {
    controls: true,
    preload: "none",
    src: files.source(sound),
    "aria-label": words.sound,
  });
  const said = element("p", { class: "captions", "aria-live": "polite" });
  const file = note.captions[language] ?? Object.values(note.captions)[0];
  if (file) {
    const src = files.source(file);
    const track = element("track", { kind: "captions", srclang: language, src, default: true });
    track.addEventListener("cuechange", () => {
      const cues = [...(track.track.activeCues ?? [])];
      said.textContent = cues.map((cue) => (cue as VTTCue).text).join(" ");
    });
    player.append(track);
    track.track.mode = "hidden"; // it has no picture to be written on
  }
  return element("div", { class: "sound" }, player, said);
}

export interface RoomItem {
  readonly title: string;
  readonly href: string;
  readonly poster: string;
  readonly isHere: boolean;
  readonly notes: readonly { readonly title: string; open(): void }[];
  choose(): void;
}

/** The rooms and their notes, as links. */
export function roomsSheet(items: readonly RoomItem[]): HTMLElement {
  return element(
    "ul",
    { class: "rooms" },
    ...items.map((item) => {
      const link = element(
        "a",
        { href: item.href, ...(item.isHere ? { "aria-current": "page" } : {}) },
        element("img", { src: item.poster, alt: "", width: "160", height: "90", loading: "lazy" }),
        element("span", {}, item.title),
      );
      link.addEventListener("click", (event) => {
        if (event.ctrlKey || event.metaKey || event.shiftKey) return;
        event.preventDefault();
        item.choose();
      });
      const notes = item.notes.map((note) => {
        const open = button("note-link", () => note.open());
        open.textContent = note.title;
        return element("li", {}, open);
      });
      const below = notes.length > 0 ? [element("ul", { class: "room-notes" }, ...notes)] : [];
      return element("li", {}, link, ...below);
    }),
  );
}

export interface Tool {
  readonly name: string;
  readonly drawing: keyof typeof ICONS;
  /** Whether it is on, of those that can be. */
  readonly isOn?: boolean;
  act(): void;
}

export function toolsSheet(tools: readonly Tool[]): HTMLElement {
  return element(
    "ul",
    { class: "tool-list" },
    ...tools.map((tool) => {
      const made = button("tool-item", () => tool.act());
      made.append(icon(ICONS[tool.drawing]), element("span", {}, tool.name));
      if (tool.isOn !== undefined) made.setAttribute("aria-pressed", String(tool.isOn));
      return element("li", {}, made);
    }),
  );
}

/** Which keys and gestures do what. */
export function helpSheet(words: Words): HTMLElement {
  const lines = [
    words.helpWalk,
    words.helpRun,
    words.helpLook,
    words.helpTab,
    words.helpMouse,
    words.helpTouch,
    words.helpPad,
  ];
  return element("ul", { class: "help" }, ...lines.map((line) => element("li", {}, line)));
}

/** Who made the tour and how, for those who must cite it. */
export function creditsSheet(tour: Tour, room: Room, language: string, words: Words): Node[] {
  const { made } = room;
  const manner = mannerOf(language);
  const number = new Intl.NumberFormat(manner);
  const share = new Intl.NumberFormat(manner, { style: "percent", maximumFractionDigits: 1 });
  const millimetres = new Intl.NumberFormat(manner, { maximumFractionDigits: 1 });
  const deviation = made.deviation_mm.reduce(
    (text, value) => text.replace("{}", millimetres.format(value)),
    words.deviationOf,
  );
  const figures: (readonly [string, string])[] = [
    [words.points, number.format(made.points)],
    [words.stations, number.format(made.stations)],
    [words.faces, number.format(made.faces)],
    [words.deviation, deviation],
    [words.inferred, share.format(made.inferred_ratio)],
  ];
  if (made.captured) figures.unshift([words.captured, momentOf(made.captured, manner)]);
  const license = textIn(tour.license, language);
  if (license) figures.push([words.license, license]);
  const list = element("dl", { class: "figures" });
  for (const [name, value] of figures) {
    list.append(element("div", {}, element("dt", {}, name), element("dd", {}, value)));
  }
  return [
    prose(textIn(tour.credits, language)),
    element("h3", {}, textIn(room.title, language)),
    list,
    element("p", { class: "made-with" }, words.madeWith),
  ];
}

/** A date, or a date with a time, as it was written: no zone is known. */
function momentOf(captured: string, manner: string): string {
  const hasTime = captured.includes("T");
  const moment = new Date(hasTime ? `${captured}Z` : captured);
  const form = new Intl.DateTimeFormat(manner, {
    dateStyle: "long",
    ...(hasTime ? { timeStyle: "short" } : {}),
    timeZone: "UTC",
  });
  return form.format(moment);
}
