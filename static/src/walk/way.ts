/** The eye's way from one place of a room to another: on foot, else straight through the air. */

import { Vector3 } from "three";
import type { Collider } from "./collider.ts";
import { planRoute } from "./route.ts";
import { EYE_M, type Walker } from "./walker.ts";

const PLACE_WITHIN_M = 0.06;
/** Who comes to within so far of a place has found a way on foot. */
const WAY_WITHIN_M = 0.35;

/**
 * Places of the eye on the way to a goal, both ends included; null where walls are between.
 *
 * @param ghost A walker in the room, moved about by the search.
 * @param feet Where one stands, metres.
 * @param eye Where one looks from, metres.
 * @param goal Where the eye shall be, metres.
 * @param places How far to search, see `planRoute`.
 */
export function wayOfEye(
  ghost: Walker,
  collider: Collider,
  feet: Vector3,
  eye: Vector3,
  goal: Vector3,
  places?: number,
): Vector3[] | null {
  const floor = goal.clone().setZ(goal.z - EYE_M);
  const route = planRoute(ghost, feet, floor, PLACE_WITHIN_M, places);
  const last = route[route.length - 1];
  if (last && last.distanceTo(floor) < WAY_WITHIN_M) {
    const eyes = route.map((place) => place.clone().setZ(place.z + EYE_M));
    return [eye.clone(), ...eyes.slice(0, -1), goal];
  }
  return collider.blocks(eye, goal, 0) ? null : [eye.clone(), goal];
}
