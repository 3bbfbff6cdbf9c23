/** A walk that goes on by itself: to a place on the floor that was clicked, or to a door. */

import type { Vector3 } from "three";

const SPEED_M_S = 2;
/** Slows down over the last metre or so. */
const EASE_PER_S = 3;
const ARRIVED_M = 0.06;
const TURNED_M = 0.12;
/** Gives up when it gets no nearer for so long. */
const PATIENCE_S = 0.6;
const PROGRESS_M = 0.02;

export type ErrandState = "walking" | "arrived" | "stuck";

export class Errand {
  readonly #route: readonly Vector3[];
  readonly #within: number;
  #next = 0;
  #nearest = Infinity;
  #waited = 0;

  /**
   * @param route Places on the floor, one after the other, metres.
   * @param within Near enough to the last one, metres.
   */
  constructor(route: readonly Vector3[], within = ARRIVED_M) {
    this.#route = route;
    this.#within = Math.max(within, ARRIVED_M);
  }

  /** Velocity that leads to the next place, metres a second. */
  velocity(feet: Vector3): [number, number] {
    const place = this.#route[this.#next];
    if (!place) return [0, 0];
    const dx = place.x - feet.x;
    const dy = place.y - feet.y;
    const distance = Math.hypot(dx, dy);
    if (distance < 1e-6) return [0, 0];
    const speed = this.#isLast ? Math.min(SPEED_M_S, distance * EASE_PER_S + 0.15) : SPEED_M_S;
    return [(dx / distance) * speed, (dy / distance) * speed];
  }

  /** What became of it after a step of `dt` seconds. */
  judge(feet: Vector3, dt: number): ErrandState {
    const place = this.#route[this.#next];
    if (!place) return "arrived";
    const distance = Math.hypot(place.x - feet.x, place.y - feet.y);
    if (distance <= (this.#isLast ? this.#within : TURNED_M)) {
      this.#next++;
      this.#nearest = Infinity;
      this.#waited = 0;
      return this.#next < this.#route.length ? "walking" : "arrived";
    }
    if (distance < this.#nearest - PROGRESS_M) {
      this.#nearest = distance;
      this.#waited = 0;
      return "walking";
    }
    this.#waited += dt;
    return this.#waited > PATIENCE_S ? "stuck" : "walking";
  }

  get #isLast(): boolean {
    return this.#next >= this.#route.length - 1;
  }
}
