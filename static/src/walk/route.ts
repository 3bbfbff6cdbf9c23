/**
 * A way on foot from one place to another: round a table, up a stair.
 *
 * A* over places a quarter of a metre apart. Whether one leads to the next is asked of a walker
 * that nobody sees, so that what is found can be walked; its heights tell storeys apart. The way
 * is then pulled straight.
 */

import { Vector3 } from "three";
import type { Walker } from "./walker.ts";

const CELL_M = 0.25;
const STOREY_M = 0.5;
/** A walker that stops so far from where it was sent met something. */
const MISSED_M = 0.1;
/** Floors so far apart in height are not the same. */
const LEVEL_M = 0.6;
/** Beyond this a click is not worth the wait. */
export const PLACES_OF_A_CLICK = 250;
/** More than 1 prefers places toward the goal to the very shortest way. */
const HASTE = 1.3;
const SPEED_M_S = 1;
const NEIGHBOURS = [-1, 0, 1]
  .flatMap((x) => [-1, 0, 1].map((y) => [x, y] as const))
  .filter(([x, y]) => x !== 0 || y !== 0);

interface Place {
  readonly feet: Vector3;
  readonly before: Place | null;
  readonly gone: number;
  readonly rank: number;
}

/**
 * Places to walk to one after the other, the last one as near to the goal as one gets.
 *
 * @param ghost A walker in the same room, moved about by the search.
 * @param from Feet, metres.
 * @param goal On the floor, metres.
 * @param within Near enough to the goal, metres.
 * @param places So many are looked at before the search gives up.
 */
export function planRoute(
  ghost: Walker,
  from: Vector3,
  goal: Vector3,
  within: number,
  places = PLACES_OF_A_CLICK,
): Vector3[] {
  if (isThere(send(ghost, from, goal), goal, within)) return [goal];
  const near = Math.max(within, CELL_M);
  const last = search(ghost, from, goal, near, places);
  const feet: Vector3[] = [];
  for (let place: Place | null = last; place; place = place.before) feet.unshift(place.feet);
  const route = straighten(ghost, feet);
  return isThere(last.feet, goal, near) ? [...route, goal] : route;
}

/** The place nearest to the goal, with the places that lead there. */
function search(
  ghost: Walker,
  from: Vector3,
  goal: Vector3,
  near: number,
  places: number,
): Place {
  const start: Place = { feet: from.clone(), before: null, gone: 0, rank: 0 };
  const open = [start];
  const seen = new Set([cellOf(from)]);
  let nearest = start;
  for (let looked = 0; looked < places; looked++) {
    const place = takeBest(open);
    if (!place) break;
    if (place.feet.distanceTo(goal) < nearest.feet.distanceTo(goal)) nearest = place;
    if (isThere(place.feet, goal, near)) break;
    for (const [x, y] of NEIGHBOURS) {
      const target = new Vector3(
        (Math.round(place.feet.x / CELL_M) + x) * CELL_M,
        (Math.round(place.feet.y / CELL_M) + y) * CELL_M,
        place.feet.z,
      );
      const feet = send(ghost, place.feet, target);
      const cell = cellOf(feet);
      if (seen.has(cell) || flat(feet, target) > MISSED_M) continue;
      seen.add(cell);
      const gone = place.gone + feet.distanceTo(place.feet);
      open.push({ feet, before: place, gone, rank: gone + HASTE * feet.distanceTo(goal) });
    }
  }
  return nearest;
}

function takeBest(open: Place[]): Place | undefined {
  let best = 0;
  open.forEach((place, i) => {
    if (place.rank < (open[best]?.rank ?? Infinity)) best = i;
  });
  return open.splice(best, 1)[0];
}

/** Drops every place that the one after it can be reached without. */
function straighten(ghost: Walker, places: readonly Vector3[]): Vector3[] {
  const kept: Vector3[] = [];
  let here = 0;
  while (here < places.length - 1) {
    let next = places.length - 1;
    while (next > here + 1 && !leads(ghost, places[here], places[next])) next--;
    const place = places[next];
    if (place) kept.push(place);
    here = next;
  }
  return kept;
}

function leads(ghost: Walker, from: Vector3 | undefined, to: Vector3 | undefined): boolean {
  return from !== undefined && to !== undefined && isThere(send(ghost, from, to), to, MISSED_M);
}

/** Where a walker ends that goes straight toward a place. */
function send(ghost: Walker, from: Vector3, to: Vector3): Vector3 {
  ghost.feet.copy(from);
  const distance = flat(from, to);
  if (distance > 1e-6) {
    const pace = SPEED_M_S / distance;
    ghost.walk((to.x - from.x) * pace, (to.y - from.y) * pace, distance / SPEED_M_S);
  }
  return ghost.feet.clone();
}

function isThere(feet: Vector3, goal: Vector3, within: number): boolean {
  return flat(feet, goal) <= within && Math.abs(feet.z - goal.z) <= LEVEL_M;
}

function flat(a: Vector3, b: Vector3): number {
  return Math.hypot(a.x - b.x, a.y - b.y);
}

function cellOf(feet: Vector3): string {
  return [feet.x / CELL_M, feet.y / CELL_M, feet.z / STOREY_M].map(Math.round).join();
}
