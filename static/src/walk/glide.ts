/** The eye's eased way along a path, looking first ahead and then at what it came for. */

import { CatmullRomCurve3, Vector3 } from "three";

export const SPEED_M_S = 1.15;
const LEAST_S = 1.6;
/** On ways shorter than this nobody looks ahead. */
const STROLL_M = 1.5;
/** Parts of the time: looks ahead from here, turns to the goal from there. */
const AHEAD_BY = 0.3;
const TURNS_FROM = 0.5;

export class Glide {
  readonly eye = new Vector3();
  readonly ahead = new Vector3();
  readonly #path: CatmullRomCurve3 | null;
  readonly #start: Vector3;
  readonly #first: Vector3;
  readonly #goal: Vector3;
  readonly #target: Vector3;
  readonly #seconds: number;
  readonly #strolls: boolean;
  #gone = 0;

  /**
   * @param path Places of the eye, the first where it is, metres.
   * @param ahead Where it looks, unit length.
   * @param target What it shall look at, metres.
   * @param speed_m_s On the way.
   */
  constructor(path: readonly Vector3[], ahead: Vector3, target: Vector3, speed_m_s = SPEED_M_S) {
    const first = path[0] ?? target;
    const goal = path[path.length - 1] ?? first;
    this.#start = first.clone();
    this.#goal = goal.clone();
    this.#first = ahead.clone();
    this.#target = target.clone();
    const apart = path.filter((place, i) => i === 0 || place.distanceTo(path[i - 1] ?? place) > 1e-3);
    this.#path = apart.length > 1 ? new CatmullRomCurve3([...apart], false, "centripetal") : null;
    const length = this.#path?.getLength() ?? 0;
    this.#strolls = length > STROLL_M;
    this.#seconds = Math.max((LEAST_S * SPEED_M_S) / speed_m_s, length / speed_m_s);
    this.#look(0);
  }

  /** How long the whole way takes. */
  get seconds(): number {
    return this.#seconds;
  }

  /** Goes on for `dt` seconds. Returns whether there is more to come. */
  step(dt: number): boolean {
    this.#gone = Math.min(this.#seconds, this.#gone + dt);
    this.at(this.#gone);
    return this.#gone < this.#seconds;
  }

  /** Puts eye and look where they are after so many seconds. */
  at(seconds: number): void {
    this.#look(seconds / this.#seconds);
  }

  #look(part: number): void {
    const along = ease(part);
    if (part >= 1) this.eye.copy(this.#goal);
    else if (this.#path) this.#path.getPointAt(along, this.eye);
    else this.eye.copy(this.#start);
    const wanted = new Vector3().subVectors(this.#target, this.eye);
    if (wanted.lengthSq() > 1e-6) wanted.normalize();
    else wanted.copy(this.#first);
    this.ahead.copy(this.#first);
    if (this.#strolls && this.#path) {
      const way = this.#path.getTangentAt(Math.min(along, 0.999));
      toward(this.ahead, way, ease(part / AHEAD_BY));
      toward(this.ahead, wanted, ease((part - TURNS_FROM) / (1 - TURNS_FROM)));
    } else {
      toward(this.ahead, wanted, along);
    }
  }
}

/** Turns one direction a part of the way toward another. */
export function toward(direction: Vector3, other: Vector3, part: number): void {
  const angle = direction.angleTo(other);
  if (angle < 1e-4 || part <= 0) return;
  const axis = new Vector3().crossVectors(direction, other);
  if (axis.lengthSq() < 1e-8) axis.set(0, 0, 1); // straight back: over the left shoulder
  direction.applyAxisAngle(axis.normalize(), angle * part);
}

/** From 0 to 1 with no jerk at either end. */
export function ease(part: number): number {
  const t = Math.min(1, Math.max(0, part));
  return Math.min(1, t * t * t * (t * (6 * t - 15) + 10)); // rounded, it is more in the last millionth
}
