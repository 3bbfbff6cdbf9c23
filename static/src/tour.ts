/** What tour.json says. Coordinates are metres in the room's frame, z up. */

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
  readonly title: Texts;
  readonly text: Texts;
  readonly image: string | null;
}

export interface Room {
  readonly id: string;
  readonly title: Texts;
  readonly text: Texts;
  readonly tileset: string;
  readonly poster: string;
  readonly bounds: { readonly min: Triple; readonly max: Triple };
  readonly entry: View;
  readonly links: readonly Link[];
  readonly notes: readonly Note[];
}

export interface Tour {
  readonly format: number;
  readonly title: Texts;
  readonly languages: readonly string[];
  readonly start: string;
  readonly rooms: readonly Room[];
}

const FORMAT = 1;

/** Reads tour.json at `url`. Throws an Error that says in one line what is wrong. */
export async function fetchTour(url: URL): Promise<Tour> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`tour.json: the server answered ${response.status}`);
  const tour = (await response.json()) as Tour;
  if (tour.format !== FORMAT) {
    throw new Error(`tour.json: expected format ${FORMAT}, found ${tour.format}`);
  }
  return tour;
}

/** The room called `id`, or the one that the tour starts in. */
export function roomOf(tour: Tour, id: string | null): Room {
  const room =
    tour.rooms.find((r) => r.id === id) ??
    tour.rooms.find((r) => r.id === tour.start) ??
    tour.rooms[0];
  if (!room) throw new Error("tour.json: expected at least one room, found none");
  return room;
}
