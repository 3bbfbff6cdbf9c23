/** The script: from the tour's stops to shots, one after the other, each on a way there is. */

import { Vector3 } from "three";
import { stayS } from "../modes/stay.ts";
import type { Link, Room, Stop } from "../tour.ts";
import type { Collider } from "../walk/collider.ts";
import { planRoute } from "../walk/route.ts";
import { EYE_M, Walker } from "../walk/walker.ts";
import { wayOfEye } from "../walk/way.ts";
import { endOf, poseOf, stayShot, walkShot, type Pose, type Shot } from "./shots.ts";

/** A film has the time to search a whole stair for its way. */
const PLACES = 6000;
const GHOST_STRIDE_M = 0.12;
/** One goes so near to a door: behind it there is nothing to be seen yet. */
const BEFORE_DOOR_M = 1.3;
const DOOR_WITHIN_M = 0.45;
/** Less than this is no way. */
const STEP_M = 0.3;

/** A room and its walls. */
export interface Ground {
  readonly room: Room;
  readonly collider: Collider;
}

/** A way that is not there. */
export interface Blocked {
  /** Numbers of the stops, from 0. */
  readonly from: number;
  readonly to: number;
  readonly room: string;
}

/**
 * The shots of a film.
 *
 * @param stops At least one.
 * @param grounds Their rooms, by id.
 * @param textOf What is told at a stop.
 */
export function shotsOf(
  stops: readonly Stop[],
  grounds: ReadonlyMap<string, Ground>,
  textOf: (stop: Stop) => string,
): { shots: readonly Shot[]; blocked: readonly Blocked[] } {
  const shots: Shot[] = [];
  const blocked: Blocked[] = [];
  let pose: Pose | null = null;
  stops.forEach((stop, i) => {
    const ground = groundOf(grounds, stop);
    const before = stops[i - 1];
    if (before && pose) {
      const ways =
        before.room === stop.room
          ? within(ground, pose, stop)
          : between(groundOf(grounds, before), ground, pose, stop);
      if (!ways) blocked.push({ from: i - 1, to: i, room: stop.room });
      shots.push(...(ways ?? []));
    }
    const last = shots[shots.length - 1];
    const led = last && last.stop === null && last.room === ground.room;
    const stay = stayShot(ground, led ? endOf(last) : poseOf(stop), stayS(stop, textOf(stop)), i);
    shots.push(stay);
    pose = endOf(stay);
  });
  return { shots, blocked };
}

function groundOf(grounds: ReadonlyMap<string, Ground>, { room }: Stop): Ground {
  const ground = grounds.get(room);
  if (!ground) throw new Error(`room \`${room}\`: expected in the tour, found none`);
  return ground;
}

/** From stop to stop of a room; null where there is no way. */
function within(ground: Ground, from: Pose, stop: Stop): Shot[] | null {
  const goal = new Vector3(...stop.position);
  const path = wayIn(ground, from.eye, goal);
  return path && [walkShot(ground.room, path, from.ahead, new Vector3(...stop.look_at))];
}

/** To a door and from where one arrives behind it, as far as there are ways; then a cut. */
function between(before: Ground, after: Ground, from: Pose, stop: Stop): Shot[] {
  const door = before.room.links.find(({ to }) => to === stop.room);
  if (!door) return [];
  return [...toDoor(before, from, door), ...fromDoor(after, door, stop)];
}

function toDoor(ground: Ground, from: Pose, door: Link): Shot[] {
  const place = new Vector3(...door.at);
  const walker = walkerAt(ground, from.eye);
  const floor = ground.collider.heightBelow(place.x, place.y, place.z) ?? place.z - EYE_M;
  const ghost = new Walker(ground.collider, ground.room.bounds, GHOST_STRIDE_M);
  const route = planRoute(ghost, walker.feet, place.clone().setZ(floor), DOOR_WITHIN_M, PLACES);
  const eyes = route.map((feet) => feet.clone().setZ(feet.z + EYE_M));
  const way = shortened([from.eye, ...eyes], BEFORE_DOOR_M);
  return way ? [walkShot(ground.room, way, from.ahead, place)] : [];
}

function fromDoor(ground: Ground, door: Link, stop: Stop): Shot[] {
  const arrived = poseOf(door.arrive);
  const goal = new Vector3(...stop.position);
  const path = arrived.eye.distanceTo(goal) > STEP_M ? wayIn(ground, arrived.eye, goal) : null;
  return path ? [walkShot(ground.room, path, arrived.ahead, new Vector3(...stop.look_at))] : [];
}

function wayIn({ room, collider }: Ground, eye: Vector3, goal: Vector3): Vector3[] | null {
  const { feet } = walkerAt({ room, collider }, eye);
  const ghost = new Walker(collider, room.bounds, GHOST_STRIDE_M);
  return wayOfEye(ghost, collider, feet, eye, goal, PLACES);
}

function walkerAt({ room, collider }: Ground, eye: Vector3): Walker {
  const walker = new Walker(collider, room.bounds);
  walker.place(eye);
  return walker;
}

/** A path without its last `by` metres; null where little is left. */
export function shortened(path: readonly Vector3[], by: number): Vector3[] | null {
  const kept = path.map((place) => place.clone());
  let left = by;
  while (kept.length > 1) {
    const last = kept[kept.length - 1] as Vector3;
    const before = kept[kept.length - 2] as Vector3;
    const length = last.distanceTo(before);
    if (length > left) {
      last.lerp(before, left / length);
      return length - left > STEP_M || kept.length > 2 ? kept : null;
    }
    left -= length;
    kept.pop();
  }
  return null;
}
