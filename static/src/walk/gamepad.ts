/** A gamepad: left stick walks, right stick looks; its buttons do what is before one. */

import type { Wish } from "./keyboard.ts";

/** What a stick at rest may say. */
const REST = 0.16;
/** Of the standard layout. */
const BUTTONS = { act: 0, back: 1, run: 10, previous: 4, next: 5 } as const;

export interface GamepadEvents {
  /** A stick is pushed, after both were at rest. */
  pushed(): void;
  /** Through the door, or to the note, that one looks at. */
  act(): void;
  back(): void;
  previous(): void;
  next(): void;
}

export class Gamepads {
  readonly #events: GamepadEvents;
  readonly #held = new Set<string>();
  #wish: Wish | null = null;

  /** @param wake Called when one comes, so that it is looked at. */
  constructor(events: GamepadEvents, wake: () => void) {
    this.#events = events;
    window.addEventListener("gamepadconnected", wake);
  }

  /** Whether there is one to be looked at. */
  get isThere(): boolean {
    return this.#pad() !== null;
  }

  /** What it asked for when it was looked at last; null while its sticks are at rest. */
  get wish(): Wish | null {
    return this.#wish;
  }

  /** Looks at it, once a frame: it sends no events. Returns whether it is in somebody's hands. */
  poll(): boolean {
    const pad = this.#pad();
    const wasAtRest = this.#wish === null;
    this.#wish = pad && wishOf(pad);
    if (this.#wish && wasAtRest) this.#events.pushed();
    if (pad) this.#press(pad);
    return this.#wish !== null || (pad?.buttons.some(({ pressed }) => pressed) ?? false);
  }

  #pad(): Gamepad | null {
    return navigator.getGamepads?.().find((pad) => pad?.connected && pad.axes.length >= 4) ?? null;
  }

  #press(pad: Gamepad): void {
    for (const name of ["act", "back", "previous", "next"] as const) {
      const pressed = pad.buttons[BUTTONS[name]]?.pressed ?? false;
      if (pressed && !this.#held.has(name)) {
        this.#held.add(name);
        this.#events[name]();
      } else if (!pressed) {
        this.#held.delete(name);
      }
    }
  }
}

function wishOf(pad: Gamepad): Wish | null {
  const [leftX, leftY, rightX, rightY] = pad.axes.map(beyondRest);
  const wish = {
    ahead: -(leftY ?? 0),
    left: -(leftX ?? 0),
    turn: -(rightX ?? 0),
    up: -(rightY ?? 0),
    fast: pad.buttons[BUTTONS.run]?.pressed ?? false,
  };
  return wish.ahead || wish.left || wish.turn || wish.up ? wish : null;
}

function beyondRest(value: number): number {
  const beyond = Math.max(0, Math.abs(value) - REST) / (1 - REST);
  return Math.sign(value) * beyond;
}
