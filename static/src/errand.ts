/** A walk that goes on by itself: to a place on the floor that was clicked, or to a door. */

import { Vector3 } from "three";

const SPEED_M_S = 2;
/** Slows down over the last metre or so. */
const EASE_PER_S = 3;
const ARRIVED_M = 0.06;
/** Gives up when it gets no nearer for so long. */
const PATIENCE_S = 0.6;
const PROGRESS_M = 0.02;

export type ErrandState = "walking" | "arrived" | "stuck";

export class Errand {
  readonly target: Vector3;
  readonly #within: number;
  #nearest = Infinity;
  #waited = 0;

  /**
   * @param target A place on the floor, metres.
   * @param within Near enough, metres.
   */
  constructor(target: Vector3, within = ARRIVED_M) {
    this.target = target;
    this.#within = Math.max(within, ARRIVED_M);
  }

  /** Velocity that leads to the target, metres a second. */
  velocity(feet: Vector3): [number, number] {
    const dx = this.target.x - feet.x;
    const dy = this.target.y - feet.y;
    const distance = Math.hypot(dx, dy);
    if (distance < 1e-6) return [0, 0];
    const speed = Math.min(SPEED_M_S, distance * EASE_PER_S + 0.15);
    return [(dx / distance) * speed, (dy / distance) * speed];
  }

  /** What became of it after a step of `dt` seconds. */
  judge(feet: Vector3, dt: number): ErrandState {
    const distance = Math.hypot(this.target.x - feet.x, this.target.y - feet.y);
    if (distance <= this.#within) return "arrived";
    if (distance < this.#nearest - PROGRESS_M) {
      this.#nearest = distance;
      this.#waited = 0;
      return "walking";
    }
    this.#waited += dt;
    return this.#waited > PATIENCE_S ? "stuck" : "walking";
  }
}
