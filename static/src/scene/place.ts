/** Rooms in their building: from one room's frame into another's. */

import { Matrix4, Vector3 } from "three";
import type { Place, Triple } from "../tour.ts";

const UP = new Vector3(0, 0, 1);

/** From a room's frame into the building's. */
export function intoBuilding(place: Place): Matrix4 {
  const turn = new Matrix4().makeRotationAxis(UP, (place.turn_deg * Math.PI) / 180);
  return turn.setPosition(...place.at);
}

/** From one room's frame into that of another. */
export function between(from: Place, to: Place): Matrix4 {
  return intoBuilding(to).invert().multiply(intoBuilding(from));
}

/** A place of a room in the building. */
export function inBuilding(place: Place, at: Triple): Vector3 {
  return new Vector3(...at).applyMatrix4(intoBuilding(place));
}
