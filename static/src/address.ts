/**
 * Rooms, views and their addresses. On a server a room has a page of its own,
 * `rooms/ID/index.html?lang=fr#at=x,y,z,yaw,pitch` below the site's folder, whatever its path; in a
 * single file all stands behind the `#`, the only part that a page may change which lies on a disk:
 * `#room=ID&lang=fr&at=x,y,z,yaw,pitch`. Metres and degrees; how one sees stands there, too.
 */

import type { Triple, View } from "./tour.ts";

const ROOM_PATH = /^rooms\/([^/]+)\/(?:index\.html)?$/;
const FAR_M = 2;

/** Ways to see; walking is the rule and not named. */
export type Way = "walk" | "orbit" | "dollhouse" | "plan";

/** What an address says beside the room. */
export interface Place {
  readonly view: View | null;
  readonly way: Way;
  /** Number of a note, from 1, that is open. */
  readonly note: number | null;
}

/** How an address names rooms. What `here`, the present one, asks for beside that goes along. */
export interface Addresses {
  /** The room that an address names, or null where it names none. */
  roomAt(here: URL): string | null;
  /** The language that it asks for, or null. */
  languageAt(here: URL): string | null;
  /** Of a room, and of a place in it. */
  ofRoom(here: URL, id: string, place?: Place): string;
  /** Of a place in the room that `here` names. */
  ofPlace(here: URL, place: Place): string;
  inLanguage(here: URL, language: string): string;
  /** What others find a place by; null: nothing. `published`: where the tour says that it lies. */
  forOthers(here: URL, published: string | null, id: string, place: Place): string | null;
}

/** Of rooms that have pages below a site's folder. */
export class PathAddresses implements Addresses {
  readonly #site: URL;

  constructor(site: URL) {
    this.#site = site;
  }

  roomAt({ pathname }: URL): string | null {
    if (!pathname.startsWith(this.#site.pathname)) return null;
    const match = ROOM_PATH.exec(pathname.slice(this.#site.pathname.length));
    return match?.[1] === undefined ? null : decodeURIComponent(match[1]);
  }

  languageAt(here: URL): string | null {
    return here.searchParams.get("lang");
  }

  ofRoom(here: URL, id: string, place?: Place): string {
    const url = new URL(`rooms/${encodeURIComponent(id)}/index.html`, this.#site);
    url.search = here.search;
    if (place) url.hash = hashOf(place);
    return url.href;
  }

  ofPlace(here: URL, place: Place): string {
    const url = new URL(here);
    url.hash = hashOf(place);
    return url.href;
  }

  inLanguage(here: URL, language: string): string {
    const url = new URL(here);
    url.searchParams.set("lang", language);
    return url.href;
  }

  forOthers(here: URL, _published: string | null, id: string, place: Place): string {
    return this.ofRoom(here, id, place);
  }
}

/** Of rooms that one page holds. */
export class FragmentAddresses implements Addresses {
  roomAt(here: URL): string | null {
    return askedBehind(here).get("room");
  }

  languageAt(here: URL): string | null {
    return askedBehind(here).get("lang");
  }

  ofRoom(here: URL, id: string, place?: Place): string {
    return written(here, id, this.languageAt(here), place ? hashOf(place) : "");
  }

  ofPlace(here: URL, place: Place): string {
    return written(here, this.roomAt(here), this.languageAt(here), hashOf(place));
  }

  inLanguage(here: URL, language: string): string {
    return written(here, this.roomAt(here), language, hashOf(placeIn(here.hash)));
  }

  forOthers(here: URL, published: string | null, id: string, place: Place): string | null {
    if (published === null) return null; // nobody else has this disk
    const page = new URL(published);
    const language = this.languageAt(here);
    if (language !== null) page.searchParams.set("lang", language);
    return new PathAddresses(new URL(published)).ofRoom(page, id, place);
  }
}

function written(here: URL, room: string | null, language: string | null, place: string): string {
  const url = new URL(here);
  const parts = [
    room === null ? "" : `room=${encodeURIComponent(room)}`,
    language === null ? "" : `lang=${encodeURIComponent(language)}`,
    place,
  ];
  url.hash = parts.filter((part) => part !== "").join("&");
  return url.href;
}

function askedBehind({ hash }: URL): URLSearchParams {
  return new URLSearchParams(hash.replace(/^#/, ""));
}

/** The part behind `#` that says a place. */
export function hashOf(place: Place): string {
  const parts: string[] = [];
  if (place.view) parts.push(`at=${numbersOf(place.view).join(",")}`);
  if (place.way !== "walk") parts.push(`see=${place.way}`);
  if (place.note !== null) parts.push(`note=${place.note}`);
  return parts.join("&");
}

/** What the part behind `#` says; what it says wrongly is left out. */
export function placeIn(hash: string): Place {
  const asked = new URLSearchParams(hash.replace(/^#/, ""));
  const note = Number(asked.get("note") ?? NaN);
  return {
    view: viewOf((asked.get("at") ?? "").split(",").map(Number)),
    way: wayOf(asked.get("see")),
    note: Number.isInteger(note) && note > 0 ? note : null,
  };
}

function wayOf(word: string | null): Way {
  return word === "orbit" || word === "dollhouse" || word === "plan" ? word : "walk";
}

/** Eye to the centimetre, heading and pitch to the tenth of a degree. */
function numbersOf({ position, look_at }: View): number[] {
  const [x, y, z] = [0, 1, 2].map((i) => (look_at[i] ?? 0) - (position[i] ?? 0));
  const yaw = (Math.atan2(y ?? 0, x ?? 0) * 180) / Math.PI;
  const pitch = (Math.atan2(z ?? 0, Math.hypot(x ?? 0, y ?? 0)) * 180) / Math.PI;
  return [...position.map((v) => rounded(v, 100)), rounded(yaw, 10), rounded(pitch, 10)];
}

function viewOf(numbers: readonly number[]): View | null {
  const [x, y, z, yawDeg, pitchDeg] = numbers;
  if (numbers.length !== 5 || !numbers.every((value) => Math.abs(value) < 1e6)) return null;
  if (x === undefined || y === undefined || z === undefined) return null;
  const yaw = ((yawDeg ?? 0) * Math.PI) / 180;
  const pitch = ((pitchDeg ?? 0) * Math.PI) / 180;
  const flat = Math.cos(pitch) * FAR_M;
  const look_at: Triple = [
    x + flat * Math.cos(yaw),
    y + flat * Math.sin(yaw),
    z + FAR_M * Math.sin(pitch),
  ];
  return { position: [x, y, z], look_at };
}

function rounded(value: number, parts: number): number {
  return Math.round(value * parts) / parts || 0;
}
