/** Fetches rooms ahead: the first while its page stands, those next door so that they open at once. */

import type { Files } from "../files.ts";
import type { Room, Tour } from "../tour.ts";

interface TilesetRoot {
  readonly root: { readonly content?: { readonly uri: string } };
}

/** Asks for what a room is opened with, to be handed over; a failure is told when it is opened. */
export async function askForRoom(files: Files, room: Room): Promise<void> {
  const tileset = files.locate(room.tileset);
  try {
    const response = await files.ask(tileset);
    const { root } = (await response.json()) as TilesetRoot;
    if (root.content) await (await files.ask(new URL(root.content.uri, tileset))).body?.cancel();
  } catch {
    return;
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
      const tileset = this.#files.locate(room.tileset);
      const response = await this.#files.fetch(tileset, { priority: "low" });
      const { root } = (await response.json()) as TilesetRoot;
      if (root.content) {
        const at = new URL(root.content.uri, tileset);
        const tile = await this.#files.fetch(at, { priority: "low" });
        await tile.arrayBuffer();
      }
    } catch {
      this.#done.delete(room.id);
    }
  }
}
