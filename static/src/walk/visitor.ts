/** The visitor: feet, eye and head, and whatever moves them: keys, fingers, an errand. */

import { Vector3 } from "three";
import type { Collider } from "./collider.ts";
import { prefersStillness } from "../dom.ts";
import { Errand } from "./errand.ts";
import { Glide, SPEED_M_S } from "./glide.ts";
import type { Wish } from "./keyboard.ts";
import { Look } from "./look.ts";
import { planRoute } from "./route.ts";
import type { Link, View } from "../tour.ts";
import { Walker, type Bounds } from "./walker.ts";
import { wayOfEye } from "./way.ts";

const WALK_M_S = 1.7;
const RUN_M_S = 3.4;
const TURN_RAD_S = 1.5;
const NOD_RAD_S = 0.9;
/** How fast the head follows what it shall look at. */
const STEER_PER_S = 5;
const STEERED_RAD = 0.01;
/** Time steps of a walk that is not shown, for visitors who asked for less motion. */
const CUT_STEP_S = 0.05;
const CUT_STEPS = 400;
const PLACE_WITHIN_M = 0.06;
/** The search for a way looks at every so many metres of it. */
const GHOST_STRIDE_M = 0.12;
/** An eye so much higher or lower than a person's hangs in the air. */
const AFLOAT_M = 0.5;
/** How near to a door's place a walk must come that a click on the door began. */
const DOOR_WITHIN_M = 0.45;

export class Visitor {
  readonly look = new Look();
  readonly eye = new Vector3();
  readonly #wish: () => Wish;
  readonly #arrived: (door: Link) => void;
  #walker: Walker | null = null;
  #ghost: Walker | null = null;
  #collider: Collider | null = null;
  #errand: Errand | null = null;
  #glide: Glide | null = null;
  #door: Link | null = null;
  #steerTo: Vector3 | null = null;
  #stick: readonly [ahead: number, left: number] = [0, 0];

  /**
   * @param wish What keys or sticks ask for.
   * @param arrived Called when a walk to a door ends.
   */
  constructor(wish: () => Wish, arrived: (door: Link) => void) {
    this.#wish = wish;
    this.#arrived = arrived;
  }

  /** Where one stands; null before a room is there. */
  get feet(): Vector3 | null {
    return this.#walker?.feet ?? null;
  }

  /** Where one is and what one looks at. */
  get view(): View {
    const target = this.look.direction().add(this.eye);
    return {
      position: [this.eye.x, this.eye.y, this.eye.z],
      look_at: [target.x, target.y, target.z],
    };
  }

  /** Whether one is on the way to somewhere. */
  get isUnderWay(): boolean {
    return this.#glide !== null || this.#errand !== null;
  }

  /** Whether one is brought somewhere as a camera is, wherever the way leads. */
  get isGliding(): boolean {
    return this.#glide !== null;
  }

  /** Looks into a room that is not there yet. */
  wait(view: View): void {
    this.stop();
    this.#walker = null;
    this.#ghost = null;
    this.#collider = null;
    this.eye.set(...view.position);
    this.look.at(this.eye, new Vector3(...view.look_at));
  }

  /** Sets foot in a room. */
  enter(view: View, collider: Collider, bounds: Bounds): void {
    this.wait(view);
    this.#collider = collider;
    this.#walker = new Walker(collider, bounds);
    this.#ghost = new Walker(collider, bounds, GHOST_STRIDE_M);
    this.jump(view);
  }

  /** Stands at another place of the room at once, or hangs there if that is no place to stand. */
  jump(view: View): void {
    this.stop();
    this.eye.set(...view.position);
    this.look.at(this.eye, new Vector3(...view.look_at));
    this.#land();
  }

  /**
   * Goes to another place of the room as a camera does, eased, on foot or through the air.
   *
   * @param pace Part of the usual speed.
   * @returns Whether there is a way; else one stays.
   */
  glide(view: View, pace = 1): boolean {
    const goal = new Vector3(...view.position);
    const path = this.#pathTo(goal);
    if (!path) return false;
    this.stop();
    const target = new Vector3(...view.look_at);
    this.#glide = new Glide(path, this.look.direction(), target, pace * SPEED_M_S);
    return true;
  }

  /** Hangs the eye anywhere. */
  hover(eye: Vector3, target: Vector3): void {
    this.stop();
    this.#walker?.hover(eye);
    this.eye.copy(eye);
    this.look.at(eye, target);
  }

  stop(): void {
    this.#errand = null;
    this.#glide = null;
    this.#door = null;
    this.#steerTo = null;
  }

  /** Turns the head at once. */
  turn(yaw: number, pitch: number): void {
    this.#steerTo = null;
    this.look.turn(yaw, pitch);
  }

  /** Turns the head toward a place, bit by bit. */
  face(place: Vector3): void {
    this.#steerTo = place;
  }

  /** Walks as two fingers ask: -1 to 1 ahead and left. */
  setStick(ahead: number, left: number): void {
    this.#stick = [ahead, left];
    if (ahead !== 0 || left !== 0) this.stop();
  }

  /** Walks to a place on the floor. */
  walkTo(place: Vector3): void {
    this.stop();
    this.#begin(place, PLACE_WITHIN_M);
  }

  /** Walks to a door, as near as it goes. */
  walkThrough(door: Link, collider: Collider): void {
    const place = new Vector3(...door.at);
    this.stop();
    this.#door = door;
    this.#steerTo = place;
    const floor = collider.heightBelow(place.x, place.y, place.z) ?? place.z;
    this.#begin(place.clone().setZ(floor), DOOR_WITHIN_M);
  }

  /** One step of time. Returns whether anything moved. */
  move(dt: number): boolean {
    const walker = this.#walker;
    if (!walker) return false;
    if (this.#glide) return this.#float(this.#glide, dt);
    const wish = this.#wish();
    const ahead = wish.ahead + this.#stick[0];
    const left = wish.left + this.#stick[1];
    const asked = ahead !== 0 || left !== 0;
    let moved = asked || wish.turn !== 0 || wish.up !== 0;
    this.look.turn(wish.turn * TURN_RAD_S * dt, wish.up * NOD_RAD_S * dt);
    if (this.#steerTo) {
      this.#steer(this.#steerTo, dt);
      moved = true;
    }
    if (asked) this.#walk(walker, ahead, left, wish.fast ? RUN_M_S : WALK_M_S, dt);
    else if (this.#errand) {
      moved = true;
      this.#run(walker, this.#errand, dt);
    }
    if (walker.settle(dt, !prefersStillness())) moved = true;
    this.eye.copy(walker.eye);
    return moved;
  }

  /** A step through the air. */
  #float(glide: Glide, dt: number): boolean {
    const goesOn = glide.step(dt);
    this.eye.copy(glide.eye);
    this.look.at(this.eye, glide.ahead.clone().add(this.eye));
    this.#walker?.hover(this.eye);
    if (!goesOn) {
      this.#glide = null;
      this.#land();
    }
    return true;
  }

  /** Sets foot on the floor, where the eye is as high above one as a person's. */
  #land(): void {
    const walker = this.#walker;
    if (!walker) return;
    const asked = this.eye.z;
    walker.place(this.eye);
    if (Math.abs(walker.eye.z - asked) < AFLOAT_M || !walker.isGrounded) {
      this.eye.copy(walker.eye);
    } else {
      walker.hover(this.eye);
    }
  }

  #pathTo(goal: Vector3): Vector3[] | null {
    if (!this.#walker || !this.#ghost || !this.#collider) return null;
    return wayOfEye(this.#ghost, this.#collider, this.#walker.feet, this.eye, goal);
  }

  #walk(walker: Walker, ahead: number, left: number, speed: number, dt: number): void {
    const pace = speed / Math.max(1, Math.hypot(ahead, left));
    const c = Math.cos(this.look.yaw) * pace;
    const s = Math.sin(this.look.yaw) * pace;
    walker.walk(ahead * c - left * s, ahead * s + left * c, dt);
  }

  #begin(place: Vector3, within: number): void {
    if (!this.#walker || !this.#ghost) return;
    const route = planRoute(this.#ghost, this.#walker.feet, place, within);
    const errand = new Errand(route, within);
    this.#errand = errand;
    if (!prefersStillness()) return;
    for (let i = 0; i < CUT_STEPS && this.#errand; i++) {
      this.#run(this.#walker, errand, CUT_STEP_S);
    }
  }

  #run(walker: Walker, errand: Errand, dt: number): void {
    walker.walk(...errand.velocity(walker.feet), dt);
    if (errand.judge(walker.feet, dt) === "walking") return;
    const door = this.#door;
    this.#errand = null;
    this.#door = null;
    if (door) this.#arrived(door);
  }

  #steer(place: Vector3, dt: number): void {
    const goal = new Look();
    goal.at(this.eye, place);
    const part = prefersStillness() ? 1 : 1 - Math.exp(-STEER_PER_S * dt);
    if (this.look.approach(goal.yaw, goal.pitch, part) < STEERED_RAD) this.#steerTo = null;
  }
}
