/** The buttons that stand for doors and notes. */

import { element, icon, ICONS } from "../dom.ts";
import type { Spot } from "./hotspots.ts";
import type { Link, Note, Triple } from "../tour.ts";
import { isDrag } from "../walk/pointer.ts";

const DOOR_FADE_M = [9, 18] as const;
const NOTE_FADE_M = [4, 8] as const;
const PLACE_FADE_M = [200, 400] as const;

export interface SignEvents {
  /** A door was clicked. */
  door(link: Link): void;
  /** The keyboard reached a sign, which may be behind one's back. */
  reached(at: Triple): void;
}

export function doorSpot(link: Link, name: string, events: SignEvents): Spot {
  const button = element(
    "button",
    { type: "button", class: "spot door", "data-to": link.to },
    icon(ICONS.door),
    element("span", {}, name),
  );
  button.addEventListener("click", () => events.door(link));
  return spot(button, link.at, DOOR_FADE_M, events);
}

export function noteSpot(note: Note, title: string, open: () => void, events: SignEvents): Spot {
  const button = element(
    "button",
    { type: "button", class: "spot note" },
    element("span", {}, title),
  );
  button.addEventListener("click", open);
  return spot(button, note.at, NOTE_FADE_M, events);
}

/** A room's name, seen from outside. */
export function placeSpot(
  name: string,
  at: Triple,
  enter: () => void,
  events: Pick<SignEvents, "reached">,
): Spot {
  const button = element("button", { type: "button", class: "spot place" }, name);
  button.addEventListener("click", enter);
  return spot(button, at, PLACE_FADE_M, events);
}

/**
 * A finger that lifts from a button clicks it: of a tap that follows two fingers Chromium makes no
 * click now and then. One that drags does not: the sign follows it as the view turns, and a touch ends
 * where it began, whoever has captured its pointer.
 */
function clickByTouch(button: HTMLButtonElement): void {
  let press: PointerEvent | null = null;
  button.addEventListener("pointerdown", (event) => (press = event));
  button.addEventListener("pointermove", (event) => {
    if (press?.pointerId === event.pointerId && isDrag(press, event)) press = null;
  });
  button.addEventListener("touchend", (event) => {
    const touch = event.changedTouches[0];
    if (!touch || !event.cancelable || event.touches.length > 0) return;
    if (!button.contains(document.elementFromPoint(touch.clientX, touch.clientY))) return;
    event.preventDefault(); // or it would click twice, or of so short a drag that a browser sees a tap
    if (press) button.click();
  });
}

function spot(
  button: HTMLButtonElement,
  at: Triple,
  fade: readonly [number, number],
  events: Pick<SignEvents, "reached">,
): Spot {
  clickByTouch(button);
  button.addEventListener("focus", () => {
    if (button.matches(":focus-visible")) events.reached(at);
  });
  return { at, button, fade };
}
