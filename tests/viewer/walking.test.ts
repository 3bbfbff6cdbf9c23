import assert from "node:assert/strict";
import { test } from "node:test";
import type { Link, Room, Triple, View } from "../../static/src/tour.ts";
import { Walking, type WalkingHost } from "../../static/src/visit/walking.ts";
import { EYE_M } from "../../static/src/walk/walker.ts";
import { room, SIX_METRES } from "./rooms.ts";

const STEP_S = 1 / 30;
const DOOR = { to: "next", at: [0, 0, 1.2] } as unknown as Link;
const STILL = { ahead: 0, left: 0, turn: 0, up: 0, fast: false };

const viewFrom = (x: number, y: number): View => ({ position: [x, y, EYE_M], look_at: [x, y + 1, EYE_M] });

/** Somebody in a room with a door in the middle, and the doors that they pass. */
function inRoom(from: View, still = false): { walking: Walking; passed: Link[]; go: (seconds: number) => void } {
  Object.assign(globalThis, { window: { matchMedia: () => ({ matches: still }) } });
  const passed: Link[] = [];
  const nothing = (): void => undefined;
  const here = { links: [DOOR], bounds: SIX_METRES } as unknown as Room;
  const walking = new Walking({
    stage: { aim: nothing, draw: nothing, wake: nothing },
    front: { hideHint: nothing, map: { stand: nothing } },
    rooms: { isOpen: true, room: here, tiles: null },
    wish: () => STILL,
    isElsewhere: () => false,
    pass: (link: Link) => passed.push(link),
    aimed: nothing,
  } as unknown as WalkingHost);
  walking.enter(here, from, room().collider());
  const go = (seconds: number): void => {
    for (let t = 0; t < seconds; t += STEP_S) walking.frame(STEP_S);
  };
  return { walking, passed, go };
}

const placeOf = ({ visitor }: Walking): Triple => visitor.view.position;

test("whoever is brought past a door does not go through it, nor where they are left beside it", () => {
  for (const still of [false, true]) {
    const { walking, passed, go } = inRoom(viewFrom(-2, 0), still);
    go(0.1);
    walking.glide(viewFrom(2, 0));
    go(12);
    assert.ok(Math.abs(placeOf(walking)[0] - 2) < 0.01);
    walking.glide(viewFrom(0.3, 0));
    go(12);
    assert.ok(Math.abs(placeOf(walking)[0] - 0.3) < 0.01);
    walking.act(() => walking.visitor.walkTo(walking.visitor.eye.clone().set(0.2, 0.2, 0)));
    go(3);
    assert.deepEqual(passed, []);
  }
});

test("whoever walks past a door goes through it, once they have been away from it", () => {
  const { walking, passed, go } = inRoom(viewFrom(-2, 0));
  walking.glide(viewFrom(-0.4, 0));
  go(12);
  const walkTo = (x: number): void => {
    walking.act(() => walking.visitor.walkTo(walking.visitor.eye.clone().set(x, 0, 0)));
    go(4);
  };
  walkTo(-2);
  assert.deepEqual(passed, []);
  walkTo(2);
  assert.equal(passed[0], DOOR);
});

test("a glide that is broken off beside a door passes it no more", () => {
  const { walking, passed, go } = inRoom(viewFrom(-2, 0));
  go(0.1);
  walking.glide(viewFrom(2, 0));
  for (let i = 0; i < 1000 && placeOf(walking)[0] < -0.3; i++) walking.frame(STEP_S);
  walking.visitor.stop();
  walking.act(() => walking.visitor.walkTo(walking.visitor.eye.clone().set(0, 0, 0)));
  go(3);
  assert.deepEqual(passed, []);
});
