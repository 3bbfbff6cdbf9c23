/** The journey: from room to room and to their notes, and the address that each place of it has. */

import { placeIn, type Addresses, type Place } from "../address.ts";
import type { Frontend } from "../page/frontend.ts";
import type { Rooms } from "../rooms.ts";
import {
  roomCalled,
  startOf,
  type Link,
  type Note,
  type Room,
  type Tour,
  type Triple,
  type View,
} from "../tour.ts";
import type { Walking } from "./walking.ts";
import type { Ways } from "./ways.ts";

/** The address follows the view when it has rested for so long. */
const REST_MS = 400;
/** An address may name a place so far outside of a room. */
const OUTSIDE_M = 3;

export interface JourneyHost {
  readonly addresses: Addresses;
  readonly tour: Tour;
  readonly front: Frontend;
  readonly rooms: Rooms;
  readonly walking: Walking;
  readonly ways: Ways;
  /** Whether it leaves a trace: addresses and steps of the history. */
  readonly isTraced: boolean;
}

export class Journey {
  readonly #host: JourneyHost;
  #note: Note | null = null;
  /** What shall be done once the room on the way is open. */
  #then: (() => void) | null = null;
  #rest: ReturnType<typeof setTimeout> | undefined;

  constructor(host: JourneyHost) {
    this.#host = host;
    window.addEventListener("popstate", () => this.#follow());
  }

  /** Begins where the address says. */
  start(isMissing: boolean): void {
    const { front, rooms } = this.#host;
    const place = placeIn(location.hash);
    this.#then = () => {
      if (isMissing || location.hash === "#missing") front.notice.tellUntilClosed("noPage");
    };
    this.#enter(rooms.room, place, false);
  }

  /** The room on the way is open. */
  opened(): void {
    const then = this.#then;
    this.#then = null;
    then?.();
  }

  /** To another room's page, by its address. */
  go(room: Room, view: View, then: (() => void) | null = null): void {
    const { addresses, isTraced, rooms, ways } = this.#host;
    this.record();
    if (isTraced) history.pushState(null, "", addresses.ofRoom(new URL(location.href), room.id));
    ways.leave();
    this.#then = then;
    void rooms.enter(room, view, true);
  }

  /** To a room that was chosen from a list, if one is not in it. */
  choose(room: Room): void {
    if (room !== this.#host.rooms.room) this.go(room, room.entry);
  }

  /** Through a door. */
  pass(link: Link): void {
    const { rooms, tour } = this.#host;
    const next = roomCalled(tour, link.to);
    if (next && rooms.isOpen) this.go(next, link.arrive);
  }

  /**
   * To a note.
   *
   * @param lead Whether one is brought before it.
   */
  open(room: Room, note: Note, lead: boolean): void {
    const { front, rooms, walking, ways } = this.#host;
    if (room !== rooms.room) return this.go(room, note.view, () => this.open(room, note, false));
    if (ways.way !== "walk") ways.leave();
    if (lead) walking.act(() => walking.glide(note.view));
    front.openNote(note);
    this.#note = note;
    this.record();
  }

  /** The note that was open is no more. */
  closed(): void {
    if (!this.#note) return;
    this.#note = null;
    this.record();
  }

  /** Writes into the address how one sees, and from where. */
  record(): void {
    const { addresses, isTraced, rooms } = this.#host;
    clearTimeout(this.#rest);
    if (!rooms.isOpen || !isTraced) return;
    const address = addresses.ofPlace(new URL(location.href), this.#place());
    if (address !== location.href) history.replaceState(history.state, "", address);
  }

  /** The same when the view has rested for a while. */
  recordAtRest(): void {
    clearTimeout(this.#rest);
    this.#rest = setTimeout(() => this.record(), REST_MS);
  }

  /** Of the present view, for others; null where it has none that they could use. */
  address(): string | null {
    const { addresses, rooms, tour } = this.#host;
    const here = new URL(location.href);
    return addresses.forOthers(here, tour.address, rooms.room.id, this.#place());
  }

  /** Enters a room at a place of an address. */
  #enter(room: Room, place: Place, passing: boolean): void {
    const { front, rooms, ways } = this.#host;
    ways.leave();
    const wrong = place.view !== null && !isInside(room, place.view.position);
    const view = (wrong ? null : place.view) ?? room.entry;
    const before = this.#then;
    this.#then = () => {
      before?.();
      if (wrong) front.notice.tellUntilClosed("noView");
      const note = place.note === null ? undefined : room.notes[place.note - 1];
      if (note) this.open(room, note, place.view === null);
      if (place.way !== "walk") void ways.see(place.way);
    };
    void rooms.enter(room, view, passing);
  }

  /** Goes where the address says, after a step through the history or by hand. */
  #follow(): void {
    const { addresses, rooms, tour, walking, ways } = this.#host;
    const named = addresses.roomAt(new URL(location.href));
    const room = roomCalled(tour, named) ?? startOf(tour);
    const place = placeIn(location.hash);
    if (room !== rooms.room || !rooms.isOpen) return this.#enter(room, place, true);
    if (place.way !== ways.way) void ways.see(place.way);
    if (place.view && isInside(room, place.view.position)) walking.jump(place.view);
    walking.aim();
    const note = place.note === null ? undefined : room.notes[place.note - 1];
    if (note && note !== this.#note) this.open(room, note, place.view === null);
  }

  #place(): Place {
    const { rooms, walking, ways } = this.#host;
    const note = this.#note ? rooms.room.notes.indexOf(this.#note) + 1 : 0;
    return { view: walking.visitor.view, way: ways.way, note: note > 0 ? note : null };
  }
}

function isInside({ bounds: { min, max } }: Room, position: Triple): boolean {
  return position.every(
    (value, i) => value > (min[i] ?? 0) - OUTSIDE_M && value < (max[i] ?? 0) + OUTSIDE_M,
  );
}
