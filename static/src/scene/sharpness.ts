/**
 * How sharp pictures are drawn while something moves: less so where the machine is slow, so that
 * walking stays smooth; what stands still is always drawn in full.
 */

const SLOW_S = 1 / 22;
const QUICK_S = 1 / 45;
const SLOW_FRAMES = 4;
const QUICK_FRAMES = 90;
const STEP = 0.7;
const LEAST = 0.49;

export class Sharpness {
  #moving = 1;
  #slow = 0;
  #quick = 0;

  /**
   * Pixels drawn for each that full sharpness asks for, along an edge.
   *
   * @param dt Seconds since the picture before.
   * @param moving Whether this one is of a movement.
   */
  next(dt: number, moving: boolean): number {
    if (!moving) return 1;
    this.#slow = dt > SLOW_S ? this.#slow + 1 : 0;
    this.#quick = dt < QUICK_S ? this.#quick + 1 : 0;
    if (this.#slow >= SLOW_FRAMES) {
      this.#moving = Math.max(LEAST, this.#moving * STEP);
      this.#slow = 0;
    } else if (this.#quick >= QUICK_FRAMES) {
      this.#moving = Math.min(1, this.#moving / STEP);
      this.#quick = 0;
    }
    return this.#moving;
  }
}
