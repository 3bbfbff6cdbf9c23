/** Being led: the guided tour goes through the rooms, on the visitor's own feet. */

import type { Guide } from "../modes/guide.ts";
import type { Frontend } from "../page/frontend.ts";
import type { Rooms } from "../rooms.ts";
import type { Stage } from "../scene/stage.ts";
import { roomCalled, type Room, type Stop, type Tour, type View } from "../tour.ts";
import type { Walking } from "./walking.ts";
import type { Ways } from "./ways.ts";

/** Part of the usual speed at which a tour shows itself. */
const UNHURRIED = 0.6;

export interface GuidanceHost {
  readonly tour: Tour;
  readonly stage: Stage;
  readonly front: Frontend;
  readonly rooms: Rooms;
  readonly walking: Walking;
  readonly ways: Ways;
  /** To another room. */
  go(room: Room, view: View): void;
}

export class Guidance {
  readonly #host: GuidanceHost;
  #guide: Guide | null = null;

  constructor(host: GuidanceHost) {
    this.#host = host;
  }

  /** The guided tour, while there is one. */
  get guide(): Guide | null {
    return this.#guide;
  }

  /**
   * Begins the guided tour; pauses it, or goes on, where there is one.
   *
   * @param attracts By itself, until somebody comes.
   */
  async lead(attracts = false): Promise<void> {
    if (this.#guide) return this.#guide.toggle();
    const { front, rooms, stage, tour, walking, ways } = this.#host;
    const isWanted = ways.ask();
    const script = await front.brought(import("../modes/guide.ts"));
    if (!script || !isWanted()) return;
    if (ways.way !== "walk") ways.leave();
    this.#guide = new script.Guide(
      {
        attracts,
        stops: tour.stops,
        leadTo: (stop) => this.#leadTo(stop),
        hasArrived: () => rooms.isOpen && !walking.visitor.isUnderWay,
        woken: () => stage.wake(),
        closed: () => this.end(),
      },
      front.words,
      (stop) => front.text(stop.text),
    );
    if (!attracts) this.#seat(this.#guide);
    front.panel.close();
    front.hideHint();
    const here = tour.stops.findIndex(({ room }) => room === rooms.room.id);
    this.#guide.go(attracts ? 0 : Math.max(0, here));
  }

  end(): void {
    const guide = this.#guide;
    this.#guide = null;
    const hadFocus = guide?.hasFocus ?? false;
    guide?.element.remove();
    if (hadFocus) this.#host.front.dock.focus();
  }

  /** Speaks the language of the page. */
  say(): void {
    const { front } = this.#host;
    this.#guide?.say(front.words, (stop) => front.text(stop.text));
  }

  /** In the place of the dock, with the focus that it had. */
  #seat(guide: Guide): void {
    const { dock, overlay } = this.#host.front;
    const { hasFocus } = dock;
    overlay.append(guide.element);
    if (hasFocus) guide.focus();
  }

  #leadTo(stop: Stop): void {
    const { rooms, stage, tour, walking, ways } = this.#host;
    const room = roomCalled(tour, stop.room);
    if (!room) return;
    if (room !== rooms.room || rooms.hasFailed) this.#host.go(room, stop);
    else if (rooms.isOpen) {
      ways.leave();
      walking.glide(stop, this.#guide?.attracts ? UNHURRIED : 1);
    }
    stage.wake();
  }
}
