/**
 * A small plan in the corner that turns up where one is; a click opens the large one.
 *
 * The plan of a storey is drawn once and then only shifted, the arrow only turned: both are left to
 * the browser's compositor, or each step of a walk would draw it anew.
 */

import type { Vector3 } from "three";
import { button, element, svg } from "../dom.ts";
import { intoBuilding } from "../scene/place.ts";
import type { Room, Tour } from "../tour.ts";
import type { Words } from "../words.ts";
import { ARROW, Plan, storeyAt } from "./plan.ts";

const PX_A_METRE = 17;

export class MiniMap {
  readonly element: HTMLButtonElement;
  readonly #plan: Plan;
  readonly #sheet: HTMLElement;
  readonly #arrow = svg("svg", { class: "map-arrow", viewBox: "-0.5 -0.5 1 1", "aria-hidden": "true" });

  constructor(tour: Tour, open: () => void) {
    this.#plan = new Plan(tour);
    this.#sheet = element("div", { class: "map-sheet", "aria-hidden": "true" }, this.#plan.element);
    this.#arrow.append(svg("path", { class: "you", d: ARROW, transform: "scale(1 -1)" }));
    this.element = button("mini-map", open);
    this.element.append(this.#sheet, this.#arrow);
  }

  say(words: Words): void {
    this.element.setAttribute("aria-label", words.map);
    this.element.title = words.map;
  }

  stand(room: Room, eye: Vector3, yaw: number): void {
    const storey = storeyAt(room, eye.z);
    if (storey && this.#plan.show(storey.level)) {
      const { width, height } = this.#plan.extent;
      this.#sheet.style.width = `${(width * PX_A_METRE).toFixed(1)}px`;
      this.#sheet.style.height = `${(height * PX_A_METRE).toFixed(1)}px`;
    }
    this.#plan.here(room);
    const { left, top } = this.#plan.extent;
    const at = eye.clone().applyMatrix4(intoBuilding(room.place));
    const x = (left - at.x) * PX_A_METRE;
    const y = (top + at.y) * PX_A_METRE;
    this.#sheet.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    const turn = 90 - (yaw * 180) / Math.PI - room.place.turn_deg;
    this.#arrow.style.transform = `rotate(${turn.toFixed(1)}deg)`;
  }
}
