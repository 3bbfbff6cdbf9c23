import assert from "node:assert/strict";
import { test } from "node:test";
import { Gamepads } from "../../static/src/walk/gamepad.ts";
import type { Wish } from "../../static/src/walk/keyboard.ts";

test("a gamepad is looked at once a frame, and told of once a push or press", () => {
  const pad = {
    connected: true,
    axes: [0, 0, 0, 0],
    buttons: Array.from({ length: 17 }, () => ({ pressed: false })),
  };
  Object.assign(globalThis, { window: { addEventListener: () => undefined } });
  Object.defineProperty(globalThis, "navigator", { value: { getGamepads: () => [null, pad] } });
  const told: string[] = [];
  const events = Object.fromEntries(
    (["pushed", "act", "back", "previous", "next"] as const).map((name) => [name, () => told.push(name)]),
  );
  const gamepads = new Gamepads(events as never, () => undefined);
  const wish = (): Wish | null => gamepads.wish;
  assert.equal(gamepads.poll(), false);
  assert.equal(wish(), null);
  pad.axes[1] = -1;
  for (let frame = 0; frame < 3; frame++) assert.equal(gamepads.poll(), true);
  assert.equal(wish()?.ahead, 1);
  assert.deepEqual(told, ["pushed"]);
  pad.axes[1] = -0.1;
  assert.equal(gamepads.poll(), false, "what a stick at rest may say");
  pad.buttons[5] = { pressed: true };
  for (let frame = 0; frame < 3; frame++) assert.equal(gamepads.poll(), true);
  pad.axes[2] = 1;
  gamepads.poll();
  assert.deepEqual(told, ["pushed", "next", "pushed"]);
  pad.connected = false;
  assert.equal(gamepads.poll(), false);
  assert.equal(wish(), null);
});
