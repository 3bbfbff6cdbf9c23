/**
 * A visitor on foot: an upright capsule that slides along walls and always stands on a floor.
 *
 * The capsule hangs a step's height above the floor, so that risers pass under it; rays from
 * that height find the floor, and the feet are set on it at once while the eye follows smoothly.
 * There is no free fall: a step off an edge deeper than `DROP_M` is refused like a wall, and over
 * a hole in the scan, where there is nothing below at all, the visitor keeps the height.
 */

import { Vector3 } from "three";
import type { Collider } from "./collider.ts";
import type { Triple } from "./tour.ts";

export const EYE_M = 1.6;
/** The highest riser that is climbed. */
export const STEP_M = 0.3;
/** The deepest edge that is stepped down. */
export const DROP_M = 0.6;
const RADIUS_M = 0.22;
const CROWN_M = 0.1;
const CROUCH_MIN_M = 0.7;
const STRIDE_M = 0.04;
/** Feet are felt for around the middle too, so that a gap or a grating does not swallow them. */
const FOOT_RING_M = 0.12;
const FOOT_RING = [0, 1, 2, 3, 4, 5].map((i) => (i * Math.PI) / 3);
/** Ways round an obstacle, tried in turn when straight ahead is an edge. */
const DETOURS = [0, 0.7, -0.7, 1.3, -1.3];
const EYE_RATE = 11;

export interface Bounds {
  readonly min: Triple;
  readonly max: Triple;
}

export class Walker {
  readonly feet = new Vector3();
  readonly eye = new Vector3();
  readonly #collider: Collider;
  readonly #bounds: Bounds;
  readonly #strideM: number;
  #height = EYE_M;

  /** @param strideM What is walked without looking, less than a body's radius. */
  constructor(collider: Collider, bounds: Bounds, strideM = STRIDE_M) {
    this.#collider = collider;
    this.#bounds = bounds;
    this.#strideM = strideM;
  }

  /** Puts the eye at a point, standing on the floor that belongs to it. */
  place(eye: Vector3): void {
    this.feet.set(eye.x, eye.y, eye.z - EYE_M);
    const near = this.#floorNear(this.feet);
    const floor =
      near ?? this.#collider.heightBelow(eye.x, eye.y, eye.z, eye.z - this.#bounds.min[2] + 1);
    if (floor !== null) this.feet.z = floor;
    this.#clamp(this.feet);
    this.#measureHeadroom();
    this.eye.set(this.feet.x, this.feet.y, this.feet.z + this.#height);
  }

  /** Puts the eye at a point in mid-air, until the next stride. */
  hover(eye: Vector3): void {
    this.#height = EYE_M;
    this.eye.copy(eye);
    this.feet.set(eye.x, eye.y, eye.z - EYE_M);
  }

  /**
   * Walks for `dt` seconds.
   *
   * @param vx @param vy Wished velocity, metres a second, room frame.
   * @returns Metres gone sideways.
   */
  walk(vx: number, vy: number, dt: number): number {
    const x = this.feet.x;
    const y = this.feet.y;
    const way = Math.hypot(vx, vy) * dt;
    if (way > 0) {
      const strides = Math.ceil(way / this.#strideM);
      const dx = (vx * dt) / strides;
      const dy = (vy * dt) / strides;
      for (let i = 0; i < strides; i++) if (!this.#stride(dx, dy)) break;
      this.#measureHeadroom();
    }
    return Math.hypot(this.feet.x - x, this.feet.y - y);
  }

  /** Lets the eye follow the feet. Returns whether it still moves. */
  settle(dt: number, smooth: boolean): boolean {
    this.eye.x = this.feet.x;
    this.eye.y = this.feet.y;
    const goal = this.feet.z + this.#height;
    const gap = goal - this.eye.z;
    if (!smooth || Math.abs(gap) < 1e-3) {
      this.eye.z = goal;
      return false;
    }
    this.eye.z += gap * (1 - Math.exp(-EYE_RATE * dt));
    return true;
  }

  /** One stride, or a detour round an edge. Returns whether the visitor moved. */
  #stride(dx: number, dy: number): boolean {
    const from = this.feet;
    for (const turn of DETOURS) {
      const reach = Math.cos(turn);
      const c = Math.cos(turn) * reach;
      const s = Math.sin(turn) * reach;
      const low = from.z + STEP_M + RADIUS_M;
      const high = from.z + this.#height + CROWN_M - RADIUS_M;
      const [x, y] = this.#collider.pushOut(
        from.x + c * dx - s * dy,
        from.y + s * dx + c * dy,
        low,
        high,
        RADIUS_M,
      );
      const to = new Vector3(x, y, from.z);
      this.#clamp(to);
      const floor = this.#floorNear(to);
      if (floor === null && this.#isEdge(to)) continue;
      if (floor !== null) to.z = floor;
      const gone = Math.hypot(to.x - from.x, to.y - from.y);
      from.copy(to);
      return gone > 1e-5;
    }
    return false;
  }

  /** The highest floor within a step of the feet, or null. */
  #floorNear(feet: Vector3): number | null {
    const top = feet.z + STEP_M;
    const reach = STEP_M + DROP_M;
    let floor = this.#collider.heightBelow(feet.x, feet.y, top, reach);
    for (const angle of FOOT_RING) {
      const x = feet.x + FOOT_RING_M * Math.cos(angle);
      const y = feet.y + FOOT_RING_M * Math.sin(angle);
      const height = this.#collider.heightBelow(x, y, top, reach);
      if (height !== null && (floor === null || height > floor)) floor = height;
    }
    return floor;
  }

  /** Whether there is a floor below, only too far down. */
  #isEdge(feet: Vector3): boolean {
    return this.#collider.heightBelow(feet.x, feet.y, feet.z) !== null;
  }

  /** Ducks under what is low. */
  #measureHeadroom(): void {
    const { x, y, z } = this.feet;
    const knee = z + STEP_M + 0.1;
    const ceiling = this.#collider.heightAbove(x, y, knee, EYE_M + CROWN_M - STEP_M);
    const room = ceiling === null ? EYE_M : ceiling - z - CROWN_M;
    this.#height = Math.min(EYE_M, Math.max(CROUCH_MIN_M, room));
  }

  #clamp(point: Vector3): void {
    const { min, max } = this.#bounds;
    point.x = Math.min(max[0], Math.max(min[0], point.x));
    point.y = Math.min(max[1], Math.max(min[1], point.y));
    point.z = Math.min(max[2], Math.max(min[2], point.z));
  }
}
