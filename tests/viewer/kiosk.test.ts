import assert from "node:assert/strict";
import { test } from "node:test";
import { isOpen } from "../../static/src/kiosk/hours.ts";
import { isRefused } from "../../static/src/kiosk/locks.ts";

const at = (day: number, time: string): Date => new Date(`2026-07-0${day}T${time}:00`); // the 6th: Monday

test("the screen is awake in the hours of its day, and past midnight", () => {
  const hours = { mon: "10:00-18:00", fri: "20:00-02:00", sun: "00:00-24:00" };
  assert.equal(isOpen(hours, at(6, "09:59")), false);
  assert.equal(isOpen(hours, at(6, "10:00")), true);
  assert.equal(isOpen(hours, at(6, "17:59")), true);
  assert.equal(isOpen(hours, at(6, "18:00")), false);
  assert.equal(isOpen(hours, at(7, "12:00")), false);
  assert.equal(isOpen(hours, at(3, "19:59")), false);
  assert.equal(isOpen(hours, at(3, "23:30")), true);
  assert.equal(isOpen(hours, at(4, "01:59")), true);
  assert.equal(isOpen(hours, at(4, "02:00")), false);
  assert.equal(isOpen(hours, at(5, "00:00")), true);
  assert.equal(isOpen(hours, at(5, "23:59")), true);
  assert.equal(isOpen({}, at(6, "12:00")), false);
});

test("keys that the tour knows pass, and none that a browser does", () => {
  const keys = { ctrlKey: false, altKey: false, metaKey: false, shiftKey: false };
  for (const key of ["ArrowUp", "PageDown", "w", "Z", "Enter", "Escape", "Tab", " ", "7", "Shift"]) {
    assert.equal(isRefused({ ...keys, key }), false, key);
  }
  for (const key of ["F1", "F11", "Backspace", "ContextMenu", "PrintScreen", "BrowserBack", "/", "'"]) {
    assert.equal(isRefused({ ...keys, key }), true, key);
  }
  for (const held of ["ctrlKey", "altKey", "metaKey"]) {
    assert.equal(isRefused({ ...keys, [held]: true, key: "w" }), true, held);
  }
  assert.equal(isRefused({ ...keys, shiftKey: true, key: "Escape" }), true);
});
