/** Where a visitor looks: yaw counter-clockwise from +x, pitch up from the horizon, radians. */

import { Vector3 } from "three";

export const PITCH_MAX = 1.45;

export class Look {
  yaw = 0;
  pitch = 0;

  /** Turns toward a point. */
  at(eye: Vector3, target: Vector3): void {
    const way = new Vector3().subVectors(target, eye);
    if (way.lengthSq() < 1e-8) return;
    this.yaw = Math.atan2(way.y, way.x);
    this.pitch = clampPitch(Math.atan2(way.z, Math.hypot(way.x, way.y)));
  }

  turn(yaw: number, pitch: number): void {
    this.yaw = wrap(this.yaw + yaw);
    this.pitch = clampPitch(this.pitch + pitch);
  }

  /** Goes a part of the way toward another look, the short way round. Returns the angle left. */
  approach(yaw: number, pitch: number, part: number): number {
    const dYaw = wrap(yaw - this.yaw);
    const dPitch = clampPitch(pitch) - this.pitch;
    this.turn(dYaw * part, dPitch * part);
    return Math.hypot(dYaw, dPitch) * (1 - part);
  }

  direction(): Vector3 {
    const flat = Math.cos(this.pitch);
    return new Vector3(
      flat * Math.cos(this.yaw),
      flat * Math.sin(this.yaw),
      Math.sin(this.pitch),
    );
  }
}

function clampPitch(pitch: number): number {
  return Math.min(PITCH_MAX, Math.max(-PITCH_MAX, pitch));
}

/** An angle in (-π, π]. */
export function wrap(angle: number): number {
  const turn = 2 * Math.PI;
  return angle - turn * Math.ceil(angle / turn - 0.5);
}
