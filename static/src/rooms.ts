/** The room one is in: how it comes, is left for another, and what happens when it does not come. */

import type { LoadingManager } from "three";
import type { Collider } from "./walk/collider.ts";
import { isTouch, pause, prefersStillness } from "./dom.ts";
import type { Files } from "./files.ts";
import type { Frontend } from "./page/frontend.ts";
import type { Action } from "./page/notice.ts";
import type { Levels } from "./scene/levels.ts";
import { Prefetch } from "./scene/prefetch.ts";
import { CACHE_BYTES, CACHE_BYTES_PHONE, RoomTiles } from "./scene/room-tiles.ts";
import type { Stage } from "./scene/stage.ts";
import { startOf, type Room, type Tour, type View } from "./tour.ts";

const FADE_MS = 280;
/** So long nothing was to be done before what no view asks for yet is fetched. */
const LULL_MS = 300;

type Phase = "opening" | "open" | "failed";

export interface RoomsEvents {
  /** On the way to a room; nothing of it can be seen yet. */
  expected(view: View): void;
  /** The room can be walked. */
  opened(room: Room, view: View, collider: Collider): void;
  /** Another room is wanted after this one failed. */
  wanted(room: Room, view: View): void;
}

export class Rooms {
  readonly #files: Files;
  readonly #tour: Tour;
  readonly #stage: Stage;
  readonly #front: Frontend;
  readonly #decoder: LoadingManager;
  readonly #levels: Levels;
  readonly #events: RoomsEvents;
  readonly #prefetch: Prefetch;
  #room: Room;
  #phase: Phase = "opening";
  #tiles: RoomTiles | null = null;
  #collider: Collider | null = null;
  #lull: ReturnType<typeof setTimeout> | undefined;
  /** Counts the rooms entered, so that what comes late for an earlier one is known. */
  #entered = 0;

  constructor(
    files: Files,
    tour: Tour,
    room: Room,
    stage: Stage,
    front: Frontend,
    decoder: LoadingManager,
    levels: Levels,
    events: RoomsEvents,
  ) {
    this.#files = files;
    this.#tour = tour;
    this.#room = room;
    this.#stage = stage;
    this.#front = front;
    this.#decoder = decoder;
    this.#levels = levels;
    this.#events = events;
    this.#prefetch = new Prefetch(files, tour);
  }

  /** The one that one is in, or on the way to. */
  get room(): Room {
    return this.#room;
  }

  get isOpen(): boolean {
    return this.#phase === "open";
  }

  get hasFailed(): boolean {
    return this.#phase === "failed";
  }

  get tiles(): RoomTiles | null {
    return this.#tiles;
  }

  get collider(): Collider | null {
    return this.#collider;
  }

  /** @param passing From another room: the picture shows another view until then. */
  async enter(room: Room, view: View, passing: boolean): Promise<void> {
    const turn = ++this.#entered;
    this.#room = room;
    this.#phase = "opening";
    this.lookAhead(true);
    this.#front.expect(room, passing);
    if (this.#tiles && !prefersStillness()) await pause(FADE_MS);
    if (turn !== this.#entered) return;
    this.#leave();
    const now = (act: () => void): void => {
      if (turn === this.#entered) act();
    };
    this.#tiles = this.tilesOf(room, this.#levels, {
      changed: () => now(() => this.#stage.draw()),
      progress: (part) => now(() => this.#front.cover.progress(part)),
      root: (collider) => now(() => this.#open(room, view, collider())),
      failed: () => now(() => this.#fail(room, view)),
      partFailed: () => now(() => this.#tellPartMissing()),
    });
    this.#stage.scene.add(this.#tiles.group);
    this.#events.expected(view);
  }

  /** Tiles of any room, for whoever shows more than one. */
  tilesOf(
    room: Room,
    levels: Levels,
    events: ConstructorParameters<typeof RoomTiles>[1],
  ): RoomTiles {
    const options = {
      files: this.#files,
      tileset: room.tileset,
      decoder: this.#decoder,
      camera: this.#stage.camera,
      levels,
      cacheBytes: isTouch() ? CACHE_BYTES_PHONE : CACHE_BYTES,
    };
    return new RoomTiles(options, events);
  }

  /**
   * Fetches the rest of the room about the view when nothing else is to be done, then the rooms next
   * door.
   *
   * @param busy Whether something is.
   */
  lookAhead(busy: boolean): void {
    if (!busy && this.#lull !== undefined) return;
    clearTimeout(this.#lull);
    this.#lull = busy
      ? undefined
      : setTimeout(() => this.#fetchAhead(), LULL_MS);
  }

  /** With the next frame: a slow machine may take longer than the lull to draw what came. */
  #fetchAhead(): void {
    const lull = this.#lull;
    requestAnimationFrame(() => {
      if (lull !== this.#lull) return;
      // The tiles ask for another frame, which begins another lull.
      if (this.#tiles?.lookAround()) this.#lull = undefined;
      else void this.#prefetch.neighbours(this.#room);
    });
  }

  #leave(): void {
    if (!this.#tiles) return;
    this.#stage.scene.remove(this.#tiles.group);
    this.#tiles.dispose();
    this.#tiles = null;
    this.#collider = null;
  }

  #open(room: Room, view: View, collider: Collider): void {
    this.#collider = collider;
    this.#phase = "open";
    this.#events.opened(room, view, collider);
    this.#front.reveal();
  }

  #fail(room: Room, view: View): void {
    this.#phase = "failed";
    const ways: Action[] = [{ label: "retry", act: () => void this.enter(room, view, true) }];
    const start = startOf(this.#tour);
    if (room !== start) {
      ways.push({ label: "back", act: () => this.#events.wanted(start, start.entry) });
    }
    this.#front.notice.tell({ says: "noRoom", ways, grave: true });
  }

  #tellPartMissing(): void {
    const ways: Action[] = [{ label: "retry", act: () => this.#tiles?.retry() }];
    this.#front.notice.tell({ says: "partMissing", ways });
  }
}
