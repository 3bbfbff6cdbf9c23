/** Doors that are passed by walking up to them. */

import type { Vector3 } from "three";
import type { Triple } from "../tour.ts";

export const PASS_M = 0.6;
/** A door passes only someone who has been so far from it: who arrives beside one stays. */
export const ARM_M = 1;
/** The door's point may hang anywhere between the floor and the lintel. */
const BELOW_M = 0.2;
const ABOVE_M = 2;

export class Thresholds<T extends { readonly at: Triple }> {
  readonly #doors: readonly T[];
  readonly #armed: Set<T>;

  constructor(doors: readonly T[]) {
    this.#doors = doors;
    this.#armed = new Set();
  }

  /** Someone was brought to wherever they are: it counts as their arrival. */
  disarm(): void {
    this.#armed.clear();
  }

  /** The door that someone standing at `feet` passes, or null. */
  passed(feet: Vector3): T | null {
    for (const door of this.#doors) {
      const flat = Math.hypot(door.at[0] - feet.x, door.at[1] - feet.y);
      const rise = door.at[2] - feet.z;
      const level = rise > -BELOW_M && rise < ABOVE_M;
      if (!level || flat > ARM_M) this.#armed.add(door);
      else if (flat < PASS_M && this.#armed.has(door)) return door;
    }
    return null;
  }
}
