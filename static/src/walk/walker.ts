/**
 * A visitor on foot: an upright capsule that slides along walls and always stands on a floor.
 *
 * The capsule hangs a step's height above the floor, so that risers pass under it; rays from
 * that height find the floor, and the feet are set on it at once while the eye follows smoothly.
 * There is no free fall: a step off an edge deeper than `DROP_M` is refused like a wall, and so is
 * a step into the void through a door or a hole in a wall. A hole in the floor, as below a scanner,
 * or a missing tread is told from these by floor on both sides of it, and is crossed as if a board
 * lay over it.
 */

import { Vector3 } from "three";
import type { Collider } from "./collider.ts";
import type { Triple } from "../tour.ts";

export const EYE_M = 1.6;
/** The highest riser that is climbed. */
export const STEP_M = 0.26;
/** The deepest edge that is stepped down. */
export const DROP_M = 0.6;
const RADIUS_M = 0.22;
const CROWN_M = 0.1;
const CROUCH_MIN_M = 0.7;
const STRIDE_M = 0.04;
/** Feet are felt for around the middle too, so that a gap or a grating does not swallow them. */
const FOOT_RING_M = 0.12;
const FOOT_RING = [0, 1, 2, 3, 4, 5].map((i) => (i * Math.PI) / 3);
/** Boards over holes: short ones as steep as a stair, whatever is below; long level ones over the void. */
const SHORT_BOARD = { steepness: 0.9, radiiM: [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8] };
const LONG_BOARD = { steepness: 0, radiiM: [0.2, 0.4, 0.8, 1.2, 1.6, 2] };
/** A floor less deep below than this makes a pit of a hole. */
const PIT_M = 2;
const HALF_RING = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => (i * Math.PI) / 8);
/** Ways round an obstacle, tried in turn when straight ahead is an edge. */
const DETOURS = [0, 0.7, -0.7, 1.3, -1.3];
const EYE_RATE = 11;

type Board = typeof SHORT_BOARD;

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
  /** Whether a floor was ever found; until then, anywhere goes. */
  #grounded = false;

  /** @param strideM What is walked without looking, less than a body's radius. */
  constructor(collider: Collider, bounds: Bounds, strideM = STRIDE_M) {
    this.#collider = collider;
    this.#bounds = bounds;
    this.#strideM = strideM;
  }

  /** Whether there is a floor below. */
  get isGrounded(): boolean {
    return this.#grounded;
  }

  /** Puts the eye at a point, standing on the floor that belongs to it. */
  place(eye: Vector3): void {
    this.feet.set(eye.x, eye.y, eye.z - EYE_M);
    const near = this.#floorNear(this.feet);
    const floor =
      near ?? this.#collider.heightBelow(eye.x, eye.y, eye.z, eye.z - this.#bounds.min[2] + 1);
    if (floor !== null) this.feet.z = floor;
    this.#grounded = floor !== null;
    this.#clamp(this.feet);
    this.#measureHeadroom();
    this.eye.set(this.feet.x, this.feet.y, this.feet.z + this.#height);
  }

  /** Puts the eye at a point in mid-air, until the next stride. */
  hover(eye: Vector3): void {
    this.#height = EYE_M;
    this.#grounded = false;
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
      const board = floor === null && this.#grounded ? this.#boardOver(to) : null;
      if (floor === null && board === null && this.#grounded) continue;
      to.z = floor ?? board ?? to.z;
      this.#grounded ||= floor !== null;
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

  /** Height of a board over the hole that the feet are above, or null where it is no hole. */
  #boardOver(feet: Vector3): number | null {
    const pit = this.#collider.heightBelow(feet.x, feet.y, feet.z, PIT_M) !== null;
    return this.#layBoard(feet, SHORT_BOARD) ?? (pit ? null : this.#layBoard(feet, LONG_BOARD));
  }

  #layBoard(feet: Vector3, board: Board): number | null {
    for (const angle of HALF_RING) {
      const here = this.#floorToward(feet, angle, board);
      const there = here && this.#floorToward(feet, angle + Math.PI, board);
      if (!there) continue;
      const z = (here.z * there.radius + there.z * here.radius) / (here.radius + there.radius);
      if (Math.abs(z - feet.z) <= STEP_M) return z;
    }
    return null;
  }

  /** The nearest floor in a direction that such a board would lie on. */
  #floorToward(
    feet: Vector3,
    angle: number,
    { steepness, radiiM }: Board,
  ): { radius: number; z: number } | null {
    for (const radius of radiiM) {
      const reach = STEP_M + steepness * radius;
      const x = feet.x + radius * Math.cos(angle);
      const y = feet.y + radius * Math.sin(angle);
      const z = this.#collider.heightBelow(x, y, feet.z + reach, 2 * reach);
      if (z !== null) return { radius, z };
    }
    return null;
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
