/** Doors and notes: real buttons that hang over the picture where their places are. */

import { Vector3, type PerspectiveCamera, type Vector2 } from "three";
import { element } from "../dom.ts";
import type { Triple } from "../tour.ts";

export interface Spot {
  readonly at: Triple;
  readonly button: HTMLButtonElement;
  /** Full up to the first distance, gone from the second on, metres. */
  readonly fade: readonly [full: number, gone: number];
}

const HIDDEN_BELOW = 0.06;
const EDGE_PX = 24;
const MARGIN_PX = 8;

export class Hotspots {
  readonly element = element("nav", { class: "spots" });
  #spots: readonly Spot[] = [];

  show(spots: readonly Spot[]): void {
    this.#spots = spots;
    this.element.replaceChildren(...spots.map((spot) => spot.button));
    for (const spot of spots) spot.button.classList.add("away");
  }

  /** The button seen nearest to the middle of the picture, within so many pixels. */
  nearest(within: number): HTMLButtonElement | null {
    const frame = this.element.getBoundingClientRect();
    let found: HTMLButtonElement | null = null;
    let least = within;
    for (const { button } of this.#spots) {
      if (button.classList.contains("away")) continue;
      const box = button.getBoundingClientRect();
      const x = box.left + box.width / 2 - frame.left - frame.width / 2;
      const y = box.top + box.height / 2 - frame.top - frame.height / 2;
      if (Math.hypot(x, y) >= least) continue;
      least = Math.hypot(x, y);
      found = button;
    }
    return found;
  }

  /**
   * Moves the buttons to where their places are seen, as far as all of them stays in the picture.
   *
   * @param hidden Whether a place stands behind something.
   */
  place(camera: PerspectiveCamera, size: Vector2, hidden: (at: Vector3) => boolean): void {
    const at = new Vector3();
    // All are measured before any is moved: the page is laid out once.
    const spots = this.#spots.map((spot) => {
      return { ...spot, reach: spot.button.offsetWidth / 2 + MARGIN_PX };
    });
    for (const { at: place, button, fade, reach } of spots) {
      at.set(...place);
      const distance = camera.position.distanceTo(at);
      const strength = Math.min(1, Math.max(0, (fade[1] - distance) / (fade[1] - fade[0])));
      const seen = at.clone().project(camera);
      const x = ((seen.x + 1) / 2) * size.x;
      const y = ((1 - seen.y) / 2) * size.y;
      const inside =
        seen.z < 1 && x > EDGE_PX && x < size.x - EDGE_PX && y > EDGE_PX && y < size.y - EDGE_PX;
      const shown = inside && strength > HIDDEN_BELOW && !hidden(at);
      button.classList.toggle("away", !shown);
      if (!inside) continue;
      button.style.setProperty("--strength", strength.toFixed(2));
      const whole = Math.max(reach, Math.min(x, size.x - reach));
      button.style.transform = `translate(${whole.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }
}
