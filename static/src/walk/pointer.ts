/** Mouse and fingers on the picture: drag to look, click to go, two fingers to move. */

const CLICK_SLOP_PX = 7;
const CLICK_MAX_MS = 600;
/** A two-finger drag so long asks for full speed. */
const STICK_PX = 90;

export interface PointerEvents {
  /** Dragged by so many pixels. */
  look(dx: number, dy: number): void;
  /** Clicked or tapped, pixels from the upper left. */
  click(x: number, y: number): void;
  /** A mouse hovers there, or left. */
  hover(x: number, y: number): void;
  leave(): void;
  /** Two fingers ask to move ahead and left, -1 to 1 each. */
  stick(ahead: number, left: number): void;
  wheel(delta: number): void;
}

interface Finger {
  x: number;
  y: number;
  readonly startX: number;
  readonly startY: number;
  readonly since: number;
  moved: boolean;
}

export class Pointer {
  readonly #fingers = new Map<number, Finger>();
  readonly #events: PointerEvents;
  readonly #canvas: HTMLElement;
  #anchor: readonly [number, number] | null = null;
  /** Pressed on a sign: a click of that sign, unless it moves. */
  #onSign: PointerEvent | null = null;

  /** @param signs What hangs over the picture: whoever begins a drag there turns, too. */
  constructor(canvas: HTMLElement, signs: HTMLElement, events: PointerEvents) {
    this.#canvas = canvas;
    this.#events = events;
    canvas.addEventListener("pointerdown", (event) => {
      if (this.#onSign?.pointerId === event.pointerId) this.#onSign = null; // its sign went with a room
      if (event.button === 0) this.#press(event);
    });
    signs.addEventListener("pointerdown", (event) => {
      this.#onSign = event.button === 0 ? event : null;
    });
    signs.addEventListener("pointermove", (event) => this.#drawOff(event));
    for (const kind of ["pointerup", "pointercancel"]) {
      signs.addEventListener(kind, () => (this.#onSign = null));
    }
    canvas.addEventListener("pointermove", (event) => {
      this.#drawOff(event);
      this.#move(event);
    });
    canvas.addEventListener("pointerup", (event) => this.#release(event, true));
    canvas.addEventListener("pointercancel", (event) => this.#release(event, false));
    canvas.addEventListener("pointerleave", () => events.leave());
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        events.wheel(Math.sign(event.deltaY));
      },
      { passive: false },
    );
  }

  get dragging(): boolean {
    return this.#fingers.size > 0;
  }

  /** A press on a sign that moves is one on the picture, and opens nothing. */
  #drawOff(event: PointerEvent): void {
    const press = this.#onSign;
    if (press?.pointerId !== event.pointerId) return;
    if (event.buttons === 0) this.#onSign = null;
    else if (isDrag(press, event)) {
      this.#onSign = null;
      this.#press(press);
    }
  }

  #press(event: PointerEvent): void {
    this.#canvas.setPointerCapture(event.pointerId);
    const frame = this.#canvas.getBoundingClientRect();
    const [x, y] = [event.x - frame.left, event.y - frame.top];
    this.#fingers.set(event.pointerId, {
      x,
      y,
      startX: x,
      startY: y,
      since: event.timeStamp,
      moved: this.#fingers.size > 0,
    });
    this.#anchor = this.#fingers.size > 1 ? this.#middle() : null;
    for (const finger of this.#fingers.values()) finger.moved ||= this.#fingers.size > 1;
  }

  #move(event: PointerEvent): void {
    const finger = this.#fingers.get(event.pointerId);
    if (!finger) {
      if (event.pointerType === "mouse") this.#events.hover(event.offsetX, event.offsetY);
      return;
    }
    const dx = event.offsetX - finger.x;
    const dy = event.offsetY - finger.y;
    finger.x = event.offsetX;
    finger.y = event.offsetY;
    const far = Math.hypot(finger.x - finger.startX, finger.y - finger.startY);
    finger.moved ||= far > CLICK_SLOP_PX;
    if (this.#anchor) {
      const [x, y] = this.#middle();
      this.#events.stick(unit((this.#anchor[1] - y) / STICK_PX), unit((this.#anchor[0] - x) / STICK_PX));
    } else if (finger.moved) {
      this.#events.look(dx, dy);
    }
  }

  #release(event: PointerEvent, done: boolean): void {
    const finger = this.#fingers.get(event.pointerId);
    if (!finger) return;
    this.#fingers.delete(event.pointerId);
    if (this.#anchor) {
      this.#anchor = null;
      this.#events.stick(0, 0);
    }
    const brief = event.timeStamp - finger.since < CLICK_MAX_MS;
    if (done && brief && !finger.moved) this.#events.click(finger.x, finger.y);
  }

  #middle(): [number, number] {
    let x = 0;
    let y = 0;
    for (const finger of this.#fingers.values()) {
      x += finger.x / this.#fingers.size;
      y += finger.y / this.#fingers.size;
    }
    return [x, y];
  }
}

/** Whether a pointer has come too far from where it was pressed for a click. */
export function isDrag(press: PointerEvent, now: PointerEvent): boolean {
  return Math.hypot(now.x - press.x, now.y - press.y) > CLICK_SLOP_PX;
}

function unit(value: number): number {
  return Math.min(1, Math.max(-1, value));
}
