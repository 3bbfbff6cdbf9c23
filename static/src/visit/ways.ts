/** The ways to see: on foot, from outside, on the plan; one at a time, each back to walking. */

import type { Way } from "../address.ts";
import type { Overview } from "../modes/overview.ts";
import type { Frontend } from "../page/frontend.ts";
import { PlanSheet } from "../page/plan-sheet.ts";
import type { Rooms } from "../rooms.ts";
import type { Stage } from "../scene/stage.ts";
import type { Room, Tour, Triple, View } from "../tour.ts";
import type { Wish } from "../walk/keyboard.ts";
import { EYE_M } from "../walk/walker.ts";
import type { Walking } from "./walking.ts";

export interface WaysHost {
  readonly tour: Tour;
  readonly stage: Stage;
  readonly front: Frontend;
  readonly rooms: Rooms;
  readonly walking: Walking;
  /** What keys or sticks ask for. */
  wish(): Wish;
  /** Whatever moves by itself leaves off. */
  takeOver(): void;
  /** To another room. */
  go(room: Room, view: View): void;
  /** One sees in another way than before. */
  changed(): void;
  /** Whatever belonged to a way is to be gone. */
  left(): void;
}

export class Ways {
  readonly #host: WaysHost;
  #way: Way = "walk";
  #overview: Overview | null = null;
  #sheet: PlanSheet | null = null;
  /** Counts what was asked for, so that what comes late for an earlier wish is known. */
  #asked = 0;

  constructor(host: WaysHost) {
    this.#host = host;
  }

  get way(): Way {
    return this.#way;
  }

  /** What shows the room, or all rooms, from outside while one sees so. */
  get overview(): Overview | null {
    return this.#overview;
  }

  /**
   * Asks for what may be a while on its way, instead of whatever else is.
   *
   * @returns Whether that is wanted still.
   */
  ask(): () => boolean {
    const asked = ++this.#asked;
    return () => asked === this.#asked;
  }

  /** Sees in another way. */
  async see(way: Way): Promise<void> {
    const { front, rooms, stage, walking } = this.#host;
    if (way === "walk" && this.#way === "walk") this.ask();
    if (way === this.#way || !rooms.isOpen) return;
    this.#host.takeOver();
    const before = this.#overview;
    if (way === "walk" && before) {
      const isWanted = this.ask();
      await before.land(rooms.room, walking.visitor.view);
      if (!isWanted()) return;
    }
    this.leave();
    if (way === "walk") return walking.aim();
    if (way === "plan") this.#showPlan();
    else {
      const isWanted = this.ask();
      const script = await front.brought(import("../modes/overview.ts"));
      if (!script || !isWanted()) return;
      this.#overview = new script.Overview(
        {
          tour: this.#host.tour,
          stage,
          rooms,
          titleOf: (each) => front.text(each.title),
          wish: () => this.#host.wish(),
          enter: (into, view) => void this.#descend(into, view),
        },
        way === "dollhouse",
      );
      front.showSigns(this.#overview.signs());
    }
    this.#way = way;
    front.mark(way);
    front.hideHint();
    stage.draw();
    this.#host.changed();
  }

  /** Takes away whatever stands between the visitor and walking. */
  leave(): void {
    const { front } = this.#host;
    this.ask();
    this.#sheet?.element.remove();
    this.#sheet = null;
    if (this.#overview) {
      this.#overview.leave();
      this.#overview = null;
      front.showSigns();
    }
    this.#way = "walk";
    front.mark("walk");
    this.#host.left();
  }

  /** One step of time. Returns whether anything moved. */
  frame(dt: number): boolean {
    if (!this.#overview) return this.#sheet === null && this.#host.walking.frame(dt);
    const moved = this.#overview.frame(dt);
    if (moved) {
      this.#overview.moved();
      this.#host.stage.draw();
    }
    return moved;
  }

  /** Speaks the language of the page. */
  say(): void {
    const { front } = this.#host;
    this.#sheet?.say(front.words);
    if (this.#overview) front.showSigns(this.#overview.signs());
  }

  /** From outside down into a room. */
  async #descend(room: Room, view: View): Promise<void> {
    const overview = this.#overview;
    await overview?.land(room, view);
    if (overview === this.#overview) this.#goTo(room, view);
  }

  #showPlan(): void {
    const { tour, front, rooms, walking } = this.#host;
    const titleOf = (room: Room): string => front.text(room.title);
    this.#sheet = new PlanSheet(tour, front.words, titleOf, {
      chosen: (room, at) => this.#goOnPlan(room, at),
    });
    front.overlay.append(this.#sheet.element);
    this.#sheet.stand(rooms.room, walking.visitor.eye, walking.visitor.look.yaw);
  }

  #goOnPlan(room: Room, [x, y, z]: Triple): void {
    const ahead = this.#host.walking.visitor.look.direction();
    const position: Triple = [x, y, z + EYE_M];
    this.#goTo(room, { position, look_at: [x + ahead.x, y + ahead.y, z + EYE_M] });
  }

  /** To a place that was chosen, to walk on from there. */
  #goTo(room: Room, view: View): void {
    if (room !== this.#host.rooms.room) return this.#host.go(room, view);
    this.leave();
    this.#host.walking.jump(view);
  }
}
