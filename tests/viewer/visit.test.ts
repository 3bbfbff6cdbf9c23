import assert from "node:assert/strict";
import { test } from "node:test";
import { FragmentAddresses, hashOf, PathAddresses, placeIn } from "../../static/src/address.ts";
import { CarriedFiles } from "../../static/src/files.ts";
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
  const addresses = new PathAddresses(new URL("https://a.org/t/"));
  assert.equal(
    addresses.ofRoom(new URL("https://a.org/t/?lang=fr"), "b", { view: null, way: "plan", note: null }),
    "https://a.org/t/rooms/b/index.html?lang=fr#see=plan",
  );
});

test("in a single file all of an address stands behind the #", () => {
  const addresses = new FragmentAddresses();
  const file = "file:///C:/my%20tours/tour.html";
  const plan = { view: null, way: "plan", note: 2 } as const;
  let here = new URL(file);
  assert.equal(addresses.roomAt(here), null);
  const go = (to: string): URL => (here = new URL(to));
  assert.equal(go(addresses.ofPlace(here, plan)).href, `${file}#see=plan&note=2`);
  assert.equal(go(addresses.ofRoom(here, "b")).href, `${file}#room=b`);
  assert.equal(go(addresses.ofPlace(here, plan)).href, `${file}#room=b&see=plan&note=2`);
  go(addresses.inLanguage(here, "fr"));
  assert.equal(here.href, `${file}#room=b&lang=fr&see=plan&note=2`);
  assert.equal(addresses.languageAt(here), "fr");
  assert.equal(addresses.roomAt(here), "b");
  assert.deepEqual(placeIn(here.hash), plan);
  assert.equal(go(addresses.ofRoom(here, "c")).href, `${file}#room=c&lang=fr`);
});

test("others find a view of a single file where the tour is published, or nowhere", () => {
  const here = new URL("file:///tour.html#room=b&lang=fr");
  const place = { view: null, way: "walk", note: 1 } as const;
  const told = (published: string | null): string | null =>
    new FragmentAddresses().forOthers(here, published, "b", place);
  assert.equal(told(null), null);
  assert.equal(told("https://a.org/t/"), "https://a.org/t/rooms/b/index.html?lang=fr#note=1");
});

test("a page that carries its files gives them out by their paths", async () => {
  const carrier = (file: string, src: string | null, textContent: string): Element =>
    ({ textContent, getAttribute: (name: string) => (name === "src" ? src : file) }) as Element;
  const all = [
    carrier("rooms/a/tiles/r.glb", null, "data:model/gltf-binary;base64,Z2xURg=="),
    carrier("rooms/a/poster.webp", "data:image/webp;base64,UklGRg==", ""),
  ];
  const files = new CarriedFiles({ querySelectorAll: () => all } as unknown as ParentNode);
  const tile = new URL("tiles/r.glb", files.locate("rooms/a/tileset.json"));
  const response = await files.fetch(tile);
  assert.equal(response.headers.get("content-type"), "model/gltf-binary");
  assert.equal(await response.text(), "glTF");
  assert.equal(files.source("rooms/a/poster.webp"), "data:image/webp;base64,UklGRg==");
  assert.equal((await files.fetch(files.locate("rooms/b/tileset.json"))).status, 404);
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

test("a glide is on its way in its last millionth, too", () => {
  const goal = vector(3, 0, 1.6);
  const glide = new Glide([vector(0, 0, 1.6), goal], vector(1, 0, 0), vector(3, 6, 1));
  for (let left = 0; left < 1e-5; left += 1e-8) {
    glide.at(glide.seconds * (1 - left));
    near(glide.eye, goal, 1e-6);
  }
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
