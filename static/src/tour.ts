/** What tour.json says. Coordinates are metres in the room's frame, z up. */

import type { Files } from "./files.ts";

export type Triple = readonly [number, number, number];
export type Texts = Readonly<Record<string, string>>;

export interface View {
  readonly position: Triple;
  readonly look_at: Triple;
}

export interface Link {
  readonly to: string;
  readonly title: Texts;
  readonly at: Triple;
  /** In the frame of the room that the link leads to. */
  readonly arrive: View;
}

export interface Note {
  readonly at: Triple;
  /** Where one stands before it. */
  readonly view: View;
  readonly title: Texts;
  /** HTML without any of the author's. */
  readonly text: Texts;
  readonly image: string | null;
  readonly image_text: Texts;
  readonly sound: string | null;
  /** WebVTT files by language. */
  readonly captions: Texts;
}

/** From a room's frame into the building's: a turn about the vertical, then a shift. */
export interface Place {
  readonly at: Triple;
  readonly turn_deg: number;
}

export interface Storey {
  /** Which storey of the building it is; the tour starts in 0. */
  readonly level: number;
  readonly floor_m: number;
  /** Data of SVG paths, metres, y up. */
  readonly floor: string;
  readonly walls: string;
  readonly low: string;
}

/** How a room was made. */
export interface Made {
  /** A date, or a date with a time. */
  readonly captured: string | null;
  readonly points: number;
  readonly stations: number;
  readonly faces: number;
  /** How far points lie from the surface: half of them, and 95 %, at most. */
  readonly deviation_mm: readonly [number, number];
  readonly inferred_ratio: number;
  /** Of all its files. */
  readonly bytes: number;
}

export interface Room {
  readonly id: string;
  readonly title: Texts;
  readonly text: Texts;
  readonly tileset: string;
  /** The tile that it is opened with. */
  readonly root: string;
  readonly poster: string;
  readonly bounds: { readonly min: Triple; readonly max: Triple };
  readonly place: Place;
  readonly storeys: readonly Storey[];
  readonly entry: View;
  readonly links: readonly Link[];
  readonly notes: readonly Note[];
  readonly made: Made;
}

/** A stop of the guided tour. */
export interface Stop extends View {
  readonly room: string;
  readonly text: Texts;
  /** How long one stays; null for as long as reading takes. */
  readonly seconds: number | null;
}

export interface Tour {
  readonly format: number;
  readonly title: Texts;
  readonly languages: readonly string[];
  readonly start: string;
  /** Where it is published, if that is known. */
  readonly address: string | null;
  /** Counter-clockwise from the building's x axis; null where it is not known. */
  readonly north_deg: number | null;
  /** HTML. */
  readonly credits: Texts;
  readonly license: Texts;
  readonly logo: string | null;
  readonly rooms: readonly Room[];
  readonly stops: readonly Stop[];
}

const FORMAT = 2;

/** Reads tour.json. Throws an Error that says in one line what is wrong. */
export async function fetchTour(files: Files): Promise<Tour> {
  const response = await files.fetch(files.locate("tour.json"));
  if (!response.ok) throw new Error(`tour.json: the server answered ${response.status}`);
  const tour = (await response.json()) as Tour;
  if (tour.format !== FORMAT) {
    throw new Error(`tour.json: expected format ${FORMAT}, found ${tour.format}`);
  }
  if (!Array.isArray(tour.rooms) || tour.rooms.length === 0) {
    throw new Error("tour.json: expected at least one room, found none");
  }
  return tour;
}

/** The room called `id`, or null. */
export function roomCalled(tour: Tour, id: string | null): Room | null {
  return tour.rooms.find((room) => room.id === id) ?? null;
}

/** The room that the tour starts in. */
export function startOf(tour: Tour): Room {
  const room = roomCalled(tour, tour.start) ?? tour.rooms[0];
  if (!room) throw new Error("tour.json: expected at least one room, found none");
  return room;
}
