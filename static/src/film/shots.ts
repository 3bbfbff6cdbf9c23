/** What the camera does: it stays at a stop, or goes from one place to another. */

import { Vector3 } from "three";
import type { Room, View } from "../tour.ts";
import type { Collider } from "../walk/collider.ts";
import { ease, Glide } from "../walk/glide.ts";

/** Who stays turns by so much, and comes so much nearer where there is room before the eye. */
const DRIFT_RAD = 0.07;
const NEARER_M = 0.16;
const CLEAR_M = 0.9;
/** Staying for longer drifts on at the same pace, not over the same way. */
const DRIFT_S = 9;
const UP = new Vector3(0, 0, 1);

export interface Pose {
  readonly eye: Vector3;
  /** Where it looks, unit length. */
  readonly ahead: Vector3;
}

export interface Shot {
  readonly room: Room;
  readonly seconds: number;
  /** Number of the stop that it stays at; null on the way. */
  readonly stop: number | null;
  /** Where the camera is after so many seconds. */
  pose(seconds: number): Pose;
}

export function poseOf({ position, look_at }: View): Pose {
  const eye = new Vector3(...position);
  return { eye, ahead: new Vector3(...look_at).sub(eye).normalize() };
}

/** Stays at a stop, and drifts. */
export function stayShot(
  { room, collider }: { readonly room: Room; readonly collider: Collider },
  { eye, ahead }: Pose,
  seconds: number,
  stop: number,
): Shot {
  const clear = collider.cast(eye, ahead, CLEAR_M + NEARER_M)?.distance ?? CLEAR_M + NEARER_M;
  const nearer = Math.max(0, clear - CLEAR_M);
  const turn = DRIFT_RAD * (stop % 2 === 0 ? 1 : -1) * Math.min(1, seconds / DRIFT_S);
  return {
    room,
    seconds,
    stop,
    pose(at) {
      const part = ease(at / seconds);
      return {
        eye: eye.clone().addScaledVector(ahead, nearer * part),
        ahead: ahead.clone().applyAxisAngle(UP, turn * part),
      };
    },
  };
}

/** Goes along a path, and looks at what it came for in the end. */
export function walkShot(
  room: Room,
  path: readonly Vector3[],
  ahead: Vector3,
  target: Vector3,
): Shot {
  const glide = new Glide(path, ahead, target);
  return {
    room,
    seconds: glide.seconds,
    stop: null,
    pose(at) {
      glide.at(at);
      return { eye: glide.eye.clone(), ahead: glide.ahead.clone() };
    },
  };
}

/** Where a shot ends. */
export function endOf(shot: Shot): Pose {
  return shot.pose(shot.seconds);
}
