import assert from "node:assert/strict";
import { test } from "node:test";
import { hashOf, placeIn, roomAddress } from "../../static/src/address.ts";
import { Backoff } from "../../static/src/scene/backoff.ts";
import { between, inBuilding } from "../../static/src/scene/place.ts";
import type { View } from "../../static/src/tour.ts";
import { Glide } from "../../static/src/walk/glide.ts";
import { Look } from "../../static/src/walk/look.ts";
import { directionOf } from "../../static/src/words.ts";

const VIEW: View = { position: [1.25, -2, 1.6], look_at: [1.25, 2, 0.6] };

type Vector = ReturnType<Look["direction"]>;

const vector = (x: number, y: number, z: number): Vector => new Look().direction().set(x, y, z);

const near = (one: Vector, other: Vector, within: number): void => {
  assert.ok(one.distanceTo(other) < within, `${one.toArray()} is not ${other.toArray()}`);
};

test("an address holds a view, a way to see and a note", () => {
  for (const way of ["walk", "orbit", "dollhouse", "plan"] as const) {
    const place = placeIn(`#${hashOf({ view: VIEW, way, note: 3 })}`);
    assert.equal(place.way, way);
    assert.equal(place.note, 3);
    assert.deepEqual(place.view?.position, VIEW.position);
    const look = vector(...VIEW.look_at).sub(vector(...VIEW.position)).normalize();
    const told = vector(...(place.view?.look_at ?? [0, 0, 0])).sub(vector(...VIEW.position));
    near(told.normalize(), look, 0.002);
  }
  assert.equal(
    roomAddress(new URL("https://a.org/t/"), "b", "?lang=fr", { view: null, way: "plan", note: null }),
    "https://a.org/t/rooms/b/index.html?lang=fr#see=plan",
  );
});

test("what an address says wrongly is left out", () => {
  for (const hash of ["", "#", "#at=", "#at=1,2,3", "#at=1,2,3,4,x", "#at=1,2,3,4,1e9", "#see=upside"]) {
    assert.deepEqual(placeIn(hash), { view: null, way: "walk", note: null }, hash);
  }
  for (const note of ["0", "-1", "1.5", "x"]) assert.equal(placeIn(`#note=${note}`).note, null);
});

test("a glide goes from here to there, never faster than on foot at twice the pace", () => {
  const path = [vector(0, 0, 1.6), vector(3, 0, 1.6), vector(3, 4, 1.6)];
  const glide = new Glide(path, vector(1, 0, 0), vector(3, 6, 1));
  let before = glide.eye.clone();
  near(before, path[0] as Vector, 1e-6);
  let look = glide.ahead.clone();
  let steps = 0;
  for (let more = true; more; steps++) {
    more = glide.step(1 / 60);
    assert.ok(glide.eye.distanceTo(before) * 60 < 3.4);
    assert.ok(glide.ahead.angleTo(look) < 0.1, "the head turns smoothly");
    before = glide.eye.clone();
    look = glide.ahead.clone();
  }
  near(before, path[2] as Vector, 1e-6);
  near(look, vector(0, 2, -0.6).normalize(), 1e-3);
  assert.ok(steps > 120 && steps < 1200);
});

test("a glide to where one is turns the head, straight back too", () => {
  const here = vector(0, 0, 1.6);
  const glide = new Glide([here, here], vector(1, 0, 0), vector(-5, 0, 1.6));
  while (glide.step(1 / 30)) near(glide.eye, here, 1e-6);
  near(glide.ahead, vector(-1, 0, 0), 1e-3);
});

test("rooms are carried from frame to frame", () => {
  const hall = { at: [2, 1, 0], turn_deg: 90 } as const;
  const loft = { at: [0, 0, 3], turn_deg: 180 } as const;
  near(inBuilding(hall, [1, 0, 0]), vector(2, 2, 0), 1e-9);
  const there = vector(1, 0, 0).applyMatrix4(between(hall, loft));
  near(inBuilding(loft, [there.x, there.y, there.z]), vector(2, 2, 0), 1e-9);
});

test("what fails is asked for again, ever later, then no more", (context) => {
  context.mock.timers.enable({ apis: ["setTimeout"] });
  let asked = 0;
  const backoff = new Backoff(() => asked++);
  const waits = [1000, 2000, 4000, 8000, 16000];
  waits.forEach((wait, i) => {
    assert.equal(backoff.later(), true);
    assert.equal(backoff.later(), true, "once for all that fails until then");
    context.mock.timers.tick(wait - 1);
    assert.equal(asked, i);
    context.mock.timers.tick(1);
    assert.equal(asked, i + 1);
  });
  assert.equal(backoff.later(), false);
});

test("languages are written their own way", () => {
  assert.equal(directionOf("ar-MA"), "rtl");
  assert.equal(directionOf("br"), "ltr");
});
