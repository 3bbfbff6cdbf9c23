/** Walking: the picture as the visitor's eyes see it, and doors passed by walking up to them. */

import type { Vector3 } from "three";
import { prefersStillness } from "../dom.ts";
import type { Frontend } from "../page/frontend.ts";
import type { Rooms } from "../rooms.ts";
import type { Stage } from "../scene/stage.ts";
import type { Link, Room, View } from "../tour.ts";
import type { Collider } from "../walk/collider.ts";
import type { Wish } from "../walk/keyboard.ts";
import { Thresholds } from "../walk/threshold.ts";
import { Visitor } from "../walk/visitor.ts";

export interface WalkingHost {
  readonly stage: Stage;
  readonly front: Frontend;
  readonly rooms: Rooms;
  /** What keys or sticks ask for. */
  wish(): Wish;
  /** Whether something else than these eyes makes the picture: a view from outside, a headset. */
  isElsewhere(): boolean;
  /** One goes through a door. */
  pass(link: Link): void;
  /** One looks from elsewhere, or elsewhere to. */
  aimed(): void;
}

export class Walking {
  readonly visitor: Visitor;
  readonly #host: WalkingHost;
  #thresholds = new Thresholds<Link>([]);

  constructor(host: WalkingHost) {
    this.#host = host;
    this.visitor = new Visitor(
      () => host.wish(),
      (door) => host.pass(door),
    );
  }

  /** Looks into a room that is not there yet. */
  wait(view: View): void {
    this.visitor.wait(view);
    this.aim();
  }

  /** Sets foot in a room. */
  enter(room: Room, view: View, collider: Collider): void {
    this.visitor.enter(view, collider, room.bounds);
    this.#thresholds = new Thresholds(room.links);
    this.aim();
  }

  /** Stands at another place of the room at once. */
  jump(view: View): void {
    this.visitor.jump(view);
    this.#thresholds.disarm();
    this.aim();
  }

  /** Goes to another place of the room as a camera does, where there is a way; else at once. */
  glide(view: View, pace = 1): void {
    if (prefersStillness() || !this.visitor.glide(view, pace)) return this.jump(view);
    this.aim();
  }

  /** Walks to a door and through it. */
  walkThrough(link: Link): void {
    const { collider } = this.#host.rooms;
    if (collider) this.act(() => this.visitor.walkThrough(link, collider));
  }

  /** Turns to a sign that the keyboard reached. */
  face(at: Vector3): void {
    this.act(() => this.visitor.face(at));
  }

  /** Does something that may set the visitor moving. */
  act(act: () => void): void {
    act();
    this.#host.front.hideHint();
    this.#host.stage.wake();
  }

  /** One step of time. Returns whether anything moved. */
  frame(dt: number): boolean {
    if (!this.#host.rooms.isOpen) return false;
    const isBrought = this.visitor.isGliding;
    const moved = this.visitor.move(dt);
    const { feet } = this.visitor;
    if (isBrought) this.#thresholds.disarm(); // doors on the way are not meant
    else if (moved && feet) this.#pass(feet);
    if (moved) this.aim();
    return moved;
  }

  /** Goes through the door that feet came to, if there is one. */
  #pass(feet: Vector3): void {
    const door = this.#thresholds.passed(feet);
    if (door) this.#host.pass(door);
  }

  /** Looks through the visitor's eyes. */
  aim(): void {
    const { stage, rooms, front } = this.#host;
    if (this.#host.isElsewhere()) return;
    const { eye, look } = this.visitor;
    stage.aim(eye, look);
    rooms.tiles?.moved();
    stage.draw();
    front.map.stand(rooms.room, eye, look.yaw);
    this.#host.aimed();
  }
}
