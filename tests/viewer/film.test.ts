import assert from "node:assert/strict";
import { test } from "node:test";
import { cuesOf } from "../../static/src/film/cues.ts";
import { shortened, shotsOf, type Ground } from "../../static/src/film/script.ts";
import { endOf, poseOf, type Shot } from "../../static/src/film/shots.ts";
import { Timeline } from "../../static/src/film/timeline.ts";
import type { Link, Room, Stop, Triple } from "../../static/src/tour.ts";
import { room, SIX_METRES, type Shape } from "./rooms.ts";

const DT = 1 / 30;

/** A room that a film can be made in, of six metres with its door on the right. */
function ground(id: string, shape: Shape = room()): Ground {
  const door: Link = {
    to: id === "left" ? "right" : "left",
    title: {},
    at: [2.9, 0, 1.2],
    arrive: { position: [-2, 0, 1.6], look_at: [0, 0, 1.4] },
  };
  return {
    room: { id, bounds: SIX_METRES, links: [door], notes: [], title: { en: id } } as unknown as Room,
    collider: shape.collider(),
  };
}

function stop(of: string, position: Triple, look_at: Triple): Stop {
  return { room: of, position, look_at, text: {}, seconds: 3 };
}

function film(stops: readonly Stop[], shape?: Shape): ReturnType<typeof shotsOf> {
  const grounds = new Map(["left", "right"].map((id) => [id, ground(id, shape)]));
  return shotsOf(stops, grounds, () => "");
}

const place = (...position: Triple): ReturnType<typeof poseOf>["eye"] =>
  poseOf({ position, look_at: [9, 9, 9] }).eye;

const STOPS = [
  stop("left", [-1.5, -1, 1.6], [0, 2, 1.4]),
  stop("left", [1.5, 1.5, 1.6], [-1, -2, 1.2]),
  stop("right", [1, -1, 1.6], [0, 2, 1.4]),
];

test("the camera neither jumps nor turns at once but at a cut", () => {
  const { shots, blocked } = film(STOPS);
  assert.deepEqual(blocked, []);
  const timeline = new Timeline(shots, 5);
  let before = timeline.at(0);
  let cuts = 0;
  for (let t = DT; t < timeline.seconds; t += DT) {
    const now = timeline.at(t);
    if (now.room === before.room) {
      assert.ok(now.pose.eye.distanceTo(before.pose.eye) < 0.12, `jumps at ${t} s`);
      assert.ok(now.pose.ahead.angleTo(before.pose.ahead) < 0.12, `turns at ${t} s`);
    } else {
      assert.ok(Math.max(now.dark, before.dark) > 0.95, `is seen to jump at ${t} s`);
      cuts += 1;
    }
    before = now;
  }
  assert.equal(cuts, 1);
});

test("a film starts and ends in the dark, and says what it is about", () => {
  const timeline = new Timeline(film(STOPS).shots, 5);
  assert.equal(timeline.at(0).dark, 1);
  assert.ok(timeline.at(2).title > 0.99);
  assert.equal(timeline.at(timeline.clearS).dark + timeline.at(timeline.clearS).title, 0);
  assert.equal(timeline.at(timeline.seconds - 2).dark, 1);
  assert.ok(timeline.at(timeline.seconds - 2).credits > 0.99);
  assert.equal(timeline.at(timeline.seconds).credits, 0);
});

test("it stays at every stop for as long as the stop says", () => {
  const { stays } = new Timeline(film(STOPS).shots, 5);
  assert.deepEqual(
    stays.map(({ stop: number }) => number),
    [0, 1, 2],
  );
  for (const { from, to } of stays) assert.ok(Math.abs(to - from - 3) < 1e-9);
});

test("it goes round a wall, and tells of one that leaves no way", () => {
  const stops = [stop("left", [-2, 0, 1.6], [0, 0, 1]), stop("left", [2, 0, 1.6], [0, 0, 1])];
  const round = room().wall(0, -3, 0, 1.5, 0, 3);
  const { shots, blocked } = film(stops, round);
  assert.deepEqual(blocked, []);
  const walk = shots[1] as Shot;
  for (let t = 0; t < walk.seconds; t += DT) {
    const { eye } = walk.pose(t);
    assert.ok(Math.abs(eye.x) > 0.1 || eye.y > 1.5, `through the wall at ${eye.y} m`);
  }
  const shut = film(stops, room().wall(0, -3, 0, 3, 0, 3));
  assert.deepEqual(shut.blocked, [{ from: 0, to: 1, room: "left" }]);
});

test("a drift keeps off what is before the eye", () => {
  const near = [stop("left", [2.4, 0, 1.6], [3, 0, 1.6]), stop("left", [0, 0, 1.6], [1, 0, 1.6])];
  const [stay] = film(near).shots;
  assert.ok(stay && endOf(stay).eye.distanceTo(place(2.4, 0, 1.6)) < 1e-9);
});

test("a path is shortened from its end, over its corners", () => {
  const path = [place(0, 0, 0), place(2, 0, 0), place(2, 0.5, 0)];
  assert.deepEqual(shortened(path, 1.5)?.map(({ x, y }) => [x, y]), [[0, 0], [1, 0]]);
  assert.equal(shortened(path, 2.4), null);
});

test("captions hold two lines, keep all words, and last as long as the text", () => {
  const text =
    "The watch lived here: bed, stove, table and log book in one panelled room of under six metres. " +
    "The floor carries a compass rose of sixteen rays in maple and ebony. Short.";
  const cues = cuesOf(text, "en", 10, 26);
  assert.ok(cues.length >= 3);
  assert.equal(cues.map((cue) => cue.text.replaceAll("\n", " ")).join(" "), text);
  assert.equal(cues[0]?.from, 10);
  assert.ok(Math.abs((cues.at(-1)?.to ?? 0) - 26) < 1e-9);
  cues.forEach((cue, i) => {
    const lines = cue.text.split("\n");
    assert.ok(lines.length <= 2 && lines.every((line) => line.length <= 56), cue.text);
    if (i > 0) assert.equal(cue.from, cues[i - 1]?.to);
  });
});

test("captions of a script without spaces break between words, never before a stop", () => {
  const text = "灯台守はここで暮らしていました。".repeat(9);
  const cues = cuesOf(text, "ja", 0, 20);
  assert.ok(cues.length > 1);
  assert.equal(cues.map((cue) => cue.text.replaceAll(/\s/g, "")).join(""), text);
  for (const cue of cues) assert.ok(!/^。|\n。/.test(cue.text), cue.text);
});

test("a stop that tells nothing has no caption", () => {
  assert.deepEqual(cuesOf("  ", "en", 0, 5), []);
});
