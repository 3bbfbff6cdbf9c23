import assert from "node:assert/strict";
import { test } from "node:test";
import { Collider } from "../../static/src/walk/collider.ts";
import { EYE_M, Walker } from "../../static/src/walk/walker.ts";
import { room, Shape, SIX_METRES, spiral } from "./rooms.ts";

const STEP_S = 1 / 60;
const RADIUS_M = 0.22;

function standing(collider: Collider, x: number, y: number, z = EYE_M): Walker {
  const walker = new Walker(collider, SIX_METRES);
  walker.place(walker.eye.clone().set(x, y, z));
  return walker;
}

/** Walks on for so many seconds, the eye following. */
function walk(walker: Walker, vx: number, vy: number, seconds: number): void {
  for (let t = 0; t < seconds; t += STEP_S) {
    walker.walk(vx, vy, STEP_S);
    walker.settle(STEP_S, true);
  }
}

function near(value: number, expected: number, within: number): void {
  assert.ok(Math.abs(value - expected) <= within, `expected ${expected} ± ${within}, found ${value}`);
}

test("stands at eye height on the floor, whatever height was asked for", () => {
  for (const z of [1.6, 1.9, 1.4, 2.5]) {
    const walker = standing(room().collider(), 0, 0, z);
    near(walker.feet.z, 0, 1e-6);
    near(walker.eye.z, EYE_M, 1e-6);
  }
});

test("walks as far as it is fast", () => {
  const walker = standing(room().collider(), -1, 0);
  walk(walker, 1.5, 0, 1);
  near(walker.feet.x, 0.5, 0.05);
  near(walker.feet.y, 0, 1e-6);
});

test("stops a body's radius before a wall, however fast", () => {
  for (const speed of [1, 3.4, 40]) {
    const walker = standing(room().collider(), 0, 0);
    walk(walker, speed, 0, 4);
    near(walker.feet.x, 3 - RADIUS_M, 0.01);
  }
});

test("slides along a wall", () => {
  const walker = standing(room().collider(), 2, -2);
  walk(walker, 1, 1, 2.5);
  near(walker.feet.x, 3 - RADIUS_M, 0.01);
  near(walker.feet.y, 0.5, 0.1);
});

test("does not squeeze between bars nearer than a body is wide", () => {
  const shape = room();
  for (let y = -3; y <= 3; y += 0.3) shape.box(1, y, 0, 1.04, y + 0.04, 2);
  const walker = standing(shape.collider(), 0, 0);
  walk(walker, 1.5, 0.3, 4);
  assert.ok(walker.feet.x < 1, `expected before the bars, found ${walker.feet.x}`);
});

test("goes through a doorway of 70 cm", () => {
  const shape = room().wall(1, -3, 1, -0.35, 0, 3).wall(1, 0.35, 1, 3, 0, 3);
  const walker = standing(shape.collider(), 0, 0.1);
  walk(walker, 1.5, 0, 2);
  near(walker.feet.x, 3 - RADIUS_M, 0.05);
});

test("climbs steps of 19 and 25 cm, not a bench of 45", () => {
  for (const [height, climbs] of [[0.19, true], [0.25, true], [0.45, false]] as const) {
    const walker = standing(room().box(0.5, -3, 0, 3, 3, height).collider(), 0, 0);
    walk(walker, 1.5, 0, 1.5);
    assert.equal(walker.feet.x > 1, climbs, `height ${height}`);
    near(walker.feet.z, climbs ? height : 0, 1e-4);
  }
});

test("walks under a table top no more than through it, and ducks under a low beam", () => {
  const table = standing(room().box(0.5, -1, 0.7, 1.5, 1, 0.75).collider(), 0, 0);
  walk(table, 1.5, 0, 1.5);
  assert.ok(table.feet.x < 0.5);
  const beam = standing(room().box(0.5, -3, 1.45, 3, 3, 1.6).collider(), 0, 0);
  walk(beam, 1.5, 0, 1.5);
  if (beam.feet.x > 0.5) assert.ok(beam.eye.z < 1.45, `eye in the beam at ${beam.eye.z}`);
});

test("stays on a platform whose edge is deeper than a step, and on the edge slides along", () => {
  const walker = standing(room().box(-3, -3, 0, 0, 3, 1.5).collider(), -1, 0, 1.5 + EYE_M);
  near(walker.feet.z, 1.5, 1e-6);
  walk(walker, 1.5, 0, 2);
  near(walker.feet.z, 1.5, 1e-6);
  assert.ok(walker.feet.x < 0.2);
  walk(walker, 1, 1, 1);
  assert.ok(walker.feet.y > 0.3, `expected to slide along the edge, found y = ${walker.feet.y}`);
});

test("crosses a hole in the floor at the same height", () => {
  const shape = new Shape().floor(-3, -3, -0.85, 3, 0).floor(0.85, -3, 3, 3, 0);
  const walker = standing(shape.collider(), -2, 0);
  walk(walker, 1.5, 0, 1.4);
  near(walker.feet.x, 0.1, 0.1);
  near(walker.feet.z, 0, 1e-6);
  walk(walker, 1.5, 0, 10);
  near(walker.feet.x, 3, 1e-6);
  near(walker.feet.z, 0, 1e-6);
});

test("does not leave through a door or a hole in a wall into the void", () => {
  const shape = new Shape().floor(-3, -3, 1, 3, 0).wall(1, -3, 1, -0.6, 0, 3).wall(1, 0.6, 1, 3, 0, 3);
  const walker = standing(shape.collider(), 0, 0);
  walk(walker, 1.5, 0, 4);
  near(walker.feet.x, 1.06, 0.07);
  near(walker.feet.z, 0, 1e-6);
  walk(walker, -1.5, 0, 1);
  assert.ok(walker.feet.x < -0.3, "and can turn back");
});

test("floats where no floor was scanned at all, inside the bounds", () => {
  const shape = new Shape().wall(-3, 3, 3, 3, 0, 3);
  const walker = standing(shape.collider(), 0, 0);
  near(walker.eye.z, EYE_M, 1e-6);
  walk(walker, 1.5, 0, 5);
  near(walker.feet.x, 3, 1e-6);
  near(walker.eye.z, EYE_M, 1e-6);
});

test("the eye rises smoothly over a step", () => {
  const walker = standing(room().box(0.5, -3, 0, 3, 3, 0.19).collider(), 0, 0);
  let before = walker.eye.z;
  for (let i = 0; i < 120; i++) {
    walker.walk(1.5, 0, STEP_S);
    walker.settle(STEP_S, true);
    assert.ok(walker.eye.z - before < 0.04, `a jump of ${walker.eye.z - before}`);
    before = walker.eye.z;
  }
  near(walker.eye.z, 0.19 + EYE_M, 0.01);
});

for (const [dt, missing] of [
  [1 / 60, []],
  [1 / 4, []],
  [1 / 60, [5, 11, 17, 18, 26]],
] as const) {
  const name = `${Math.round(1 / dt)} pictures a second, ${missing.length} treads missing`;
  test(`climbs a spiral stair of 6 m and comes down again, ${name}`, () => {
    const rise = 0.19;
    const steps = 32;
    const walker = standing(spiral(steps, rise, missing).collider(), 0.7, -0.3);
    near(walker.feet.z, 0, 1e-6);
    const go = (sense: 1 | -1, until: () => boolean): void => {
      for (let t = 0; t < 60 && !until(); t += dt) {
        const angle = Math.atan2(walker.feet.y, walker.feet.x);
        walker.walk(-1.4 * sense * Math.sin(angle), 1.4 * sense * Math.cos(angle), dt);
        walker.settle(dt, true);
      }
    };
    go(1, () => walker.feet.z >= steps * rise - 0.01);
    near(walker.feet.z, steps * rise, 0.011);
    go(-1, () => walker.feet.z <= 0.01);
    near(walker.feet.z, 0, 0.011);
  });
}
