/** Fetches rooms ahead: the first while its page stands, those next door so that they open at once. */

import type { Files } from "../files.ts";
import type { Room, Tour } from "../tour.ts";

/** Asks for what a room is opened with, to be handed over; a failure is told when it is opened. */
export function askForRoom(files: Files, room: Room): void {
  for (const path of [room.tileset, room.root]) {
    files
      .ask(files.locate(path))
      .then((response) => response.body?.cancel())
      .catch(() => undefined);
  }
}

export class Prefetch {
  readonly #files: Files;
  readonly #tour: Tour;
  readonly #done = new Set<string>();

  constructor(files: Files, tour: Tour) {
    this.#files = files;
    this.#tour = tour;
  }

  /** Marks a room as fetched, and fetches its neighbours one after the other. */
  async neighbours(room: Room): Promise<void> {
    this.#done.add(room.id);
    for (const { to } of room.links) {
      const next = this.#tour.rooms.find(({ id }) => id === to);
      if (!next || this.#done.has(next.id)) continue;
      this.#done.add(next.id);
      await this.#room(next);
    }
  }

  /** Poster, tileset and root tile, into the browser's cache. A failure costs nothing. */
  async #room(room: Room): Promise<void> {
    try {
      new Image().src = this.#files.source(room.poster);
      for (const path of [room.tileset, room.root]) {
        const response = await this.#files.fetch(this.#files.locate(path), { priority: "low" });
        await response.arrayBuffer();
      }
    } catch {
      this.#done.delete(room.id);
    }
  }
}
