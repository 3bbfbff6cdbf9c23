import assert from "node:assert/strict";
import { test } from "node:test";
import { PathAddresses } from "../../static/src/address.ts";
import { Errand } from "../../static/src/walk/errand.ts";
import { checkerboard } from "../../static/src/scene/levels.ts";
import { Look, PITCH_MAX, wrap } from "../../static/src/walk/look.ts";
import { planRoute } from "../../static/src/walk/route.ts";
import { Sharpness } from "../../static/src/scene/sharpness.ts";
import { ARM_M, PASS_M, Thresholds } from "../../static/src/walk/threshold.ts";
import { EYE_M, Walker } from "../../static/src/walk/walker.ts";
import { chooseLanguage, textIn } from "../../static/src/words.ts";
import { room, SIX_METRES, spiral } from "./rooms.ts";

const walkerIn = (shape = room()): Walker => {
  const walker = new Walker(shape.collider(), SIX_METRES);
  walker.place(walker.eye.clone().set(0, 0, EYE_M));
  return walker;
};

/** Runs an errand and says how it ended and after how long. */
function run(walker: Walker, errand: Errand): [string, number] {
  const dt = 1 / 60;
  for (let t = dt; t < 20; t += dt) {
    walker.walk(...errand.velocity(walker.feet), dt);
    const state = errand.judge(walker.feet, dt);
    if (state !== "walking") return [state, t];
  }
  return ["never", 20];
}

test("an errand leads to the place that was clicked", () => {
  const walker = walkerIn();
  const target = walker.feet.clone().set(1.5, -2, 0);
  const [state, seconds] = run(walker, new Errand([target]));
  assert.equal(state, "arrived");
  assert.ok(walker.feet.distanceTo(target) < 0.07);
  assert.ok(seconds < 3, `took ${seconds} s`);
});

test("an errand behind a wall ends before it, soon", () => {
  const walker = walkerIn(room().wall(1, -3, 1, 3, 0, 3));
  const [state, seconds] = run(walker, new Errand([walker.feet.clone().set(2, 0, 0)]));
  assert.equal(state, "stuck");
  assert.ok(walker.feet.x < 0.8 && walker.feet.x > 0.7);
  assert.ok(seconds < 3);
});

test("finds a way round a wall, and no more places than it needs", () => {
  const collider = room().wall(0.8, -2, 0.8, 3, 0, 3).collider();
  const walker = new Walker(collider, SIX_METRES);
  walker.place(walker.eye.clone().set(0, 1, EYE_M));
  const goal = walker.feet.clone().set(1.6, 1, 0);
  const route = planRoute(new Walker(collider, SIX_METRES, 0.12), walker.feet, goal, 0.06);
  assert.ok(route.length <= 6, `found ${route.length} places`);
  assert.equal(run(walker, new Errand(route))[0], "arrived");
  assert.ok(walker.feet.distanceTo(goal) < 0.1);
});

test("finds its way up a spiral stair to a tread half a turn above", () => {
  const collider = spiral(32, 0.19).collider();
  const walker = new Walker(collider, SIX_METRES);
  walker.place(walker.eye.clone().set(0.7, -0.1, EYE_M));
  const goal = walker.feet.clone().set(-0.7, -0.1, 7 * 0.19);
  const route = planRoute(new Walker(collider, SIX_METRES, 0.12), walker.feet, goal, 0.06);
  assert.equal(run(walker, new Errand(route))[0], "arrived");
  assert.ok(Math.abs(walker.feet.z - goal.z) < 0.2, `found height ${walker.feet.z}`);
});

test("goes as near as it gets where there is no way", () => {
  const collider = room().wall(0.8, -3, 0.8, 3, 0, 3).collider();
  const walker = new Walker(collider, SIX_METRES);
  walker.place(walker.eye.clone().set(0, 1, EYE_M));
  const goal = walker.feet.clone().set(1.6, -2, 0);
  const route = planRoute(new Walker(collider, SIX_METRES, 0.12), walker.feet, goal, 0.06);
  assert.equal(run(walker, new Errand(route))[0], "arrived");
  assert.ok(walker.feet.x > 0.3 && walker.feet.x < 0.8, `found x ${walker.feet.x}`);
  assert.ok(Math.abs(walker.feet.y + 2) < 0.3, `found y ${walker.feet.y}`);
});

test("draws less sharply only what moves on a slow machine, and recovers", () => {
  const sharpness = new Sharpness();
  const after = (dt: number, count: number, moving = true): number => {
    let sharp = 1;
    for (let i = 0; i < count; i++) sharp = sharpness.next(dt, moving);
    return sharp;
  };
  assert.equal(after(1 / 60, 200), 1);
  const slow = after(1 / 5, 20);
  assert.ok(slow < 0.6 && slow > 0.4);
  assert.equal(sharpness.next(1 / 5, false), 1);
  assert.equal(sharpness.next(1 / 30, true), slow);
  assert.equal(after(1 / 60, 300), 1);
});

test("a door lets nobody pass who arrives beside it, until they have gone and come back", () => {
  const door = { at: [2, 0, 1.2] as const };
  const doors = new Thresholds([door]);
  const feet = walkerIn().feet;
  assert.equal(doors.passed(feet.set(1.6, 0, 0)), null);
  assert.equal(doors.passed(feet.set(2 - PASS_M + 0.1, 0, 0)), null);
  assert.equal(doors.passed(feet.set(2 - ARM_M - 0.05, 0, 0)), null);
  assert.equal(doors.passed(feet.set(2 - PASS_M - 0.05, 0, 0)), null);
  assert.equal(doors.passed(feet.set(2 - PASS_M + 0.05, 0, 0)), door);
});

test("a door on another storey is not passed", () => {
  const doors = new Thresholds([{ at: [0, 0, 4.2] as const }]);
  const feet = walkerIn().feet;
  for (const x of [2, 0.2]) assert.equal(doors.passed(feet.set(x, 0, 0)), null);
  for (const z of [1, 5]) assert.equal(doors.passed(feet.set(0.2, 0, z)), null);
  assert.ok(doors.passed(feet.set(0.2, 0, 3)));
});

test("looks where it is told, and never over its head", () => {
  const look = new Look();
  const eye = walkerIn().eye;
  const target = eye.clone().set(-1, 1, EYE_M);
  look.at(eye, target);
  assert.ok(look.direction().distanceTo(target.sub(eye).normalize()) < 1e-9);
  look.turn(0, 9);
  assert.equal(look.pitch, PITCH_MAX);
  for (const angle of [-7, -Math.PI, 0, 3, 4, 100]) {
    const wrapped = wrap(angle);
    assert.ok(wrapped > -Math.PI - 1e-12 && wrapped <= Math.PI);
    assert.ok(Math.abs(Math.sin(wrapped) - Math.sin(angle)) < 1e-9);
    assert.ok(Math.abs(Math.cos(wrapped) - Math.cos(angle)) < 1e-9);
  }
});

test("turns the short way round", () => {
  const look = new Look();
  look.yaw = 3;
  look.approach(-3, 0, 0.5);
  assert.ok(Math.abs(look.yaw) > 3);
});

test("rooms have addresses under any path, and addresses rooms", () => {
  for (const base of ["https://a.org/", "https://a.org/x/t%20o/", "http://127.0.0.1:8000/tour/"]) {
    const site = new URL(base);
    const addresses = new PathAddresses(site);
    const address = addresses.ofRoom(site, "chamber1");
    assert.equal(address, `${base}rooms/chamber1/index.html`);
    const roomAt = (path: string): string | null => addresses.roomAt(new URL(path, site));
    assert.equal(roomAt(address), "chamber1");
    assert.equal(roomAt("rooms/chamber1/?lang=fr#x"), "chamber1");
    assert.equal(roomAt("index.html"), null);
    assert.equal(roomAt(""), null);
    const french = addresses.ofRoom(new URL("?lang=fr#at=1", site), "b");
    assert.equal(french, `${base}rooms/b/index.html?lang=fr`);
  }
  const below = new PathAddresses(new URL("https://a.org/x/"));
  assert.equal(below.roomAt(new URL("https://a.org/y/rooms/b/index.html")), null);
});

test("speaks the first language that both know", () => {
  assert.equal(chooseLanguage(["en", "fr"], [null, "de-DE", "fr-CA"]), "fr");
  assert.equal(chooseLanguage(["en", "pt-BR"], ["pt-PT"]), "pt-BR");
  assert.equal(chooseLanguage(["en", "fr"], ["ja"]), "en");
  assert.equal(textIn({ fr: "porte" }, "en"), "porte");
  assert.equal(textIn({}, "en"), "");
});

test("cells of a grid are coloured like a checkerboard", () => {
  const boxes = [];
  const expected = [];
  for (const z of [0, 1]) {
    for (const y of [0, 1, 2]) {
      for (const x of [0, 1, 2]) {
        boxes.push({ min: [x, y, z], max: [x + 1, y + 1, z + 1] });
        expected.push((x + y + z) % 2 === 1);
      }
    }
  }
  assert.deepEqual(checkerboard(boxes), expected);
});
