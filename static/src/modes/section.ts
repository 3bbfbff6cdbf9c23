/** Cuts the room open: what lies beyond a plane is not drawn. */

import { Plane, Vector3 } from "three";
import { element } from "../dom.ts";
import type { Room } from "../tour.ts";
import type { Words } from "../words.ts";

type Axis = 0 | 1 | 2;

/** Of the range, 0 to 1, where a plane begins. */
const FIRST = 0.6;

export class Section {
  readonly element: HTMLElement;
  readonly plane = new Plane(new Vector3(0, 0, -1), 0);
  readonly #room: Room;
  readonly #changed: () => void;
  #axis: Axis = 2;
  #part = FIRST;
  #flipped = false;

  /** @param changed The plane moved. */
  constructor(room: Room, words: Words, changed: () => void) {
    this.#room = room;
    this.#changed = changed;
    const axes = element("fieldset", { class: "choices" }, element("legend", {}, words.sectionAxis));
    [words.sectionAcross, words.sectionAlong, words.sectionLevel].forEach((name, axis) => {
      const input = element("input", { type: "radio", name: "axis", checked: axis === this.#axis });
      input.addEventListener("change", () => {
        this.#axis = axis as Axis;
        this.#cut();
      });
      axes.append(element("label", {}, input, element("span", {}, name)));
    });
    const slider = element("input", {
      type: "range",
      min: "0",
      max: "1",
      step: "0.005",
      value: String(this.#part),
      "aria-label": words.sectionPlace,
    });
    slider.addEventListener("input", () => {
      this.#part = slider.valueAsNumber;
      this.#cut();
    });
    const flip = element("input", { type: "checkbox" });
    flip.addEventListener("change", () => {
      this.#flipped = flip.checked;
      this.#cut();
    });
    this.element = element(
      "div",
      { class: "section-tool" },
      axes,
      slider,
      element("label", { class: "check" }, flip, element("span", {}, words.sectionFlip)),
    );
    this.#cut();
  }

  #cut(): void {
    const { min, max } = this.#room.bounds;
    const at = min[this.#axis] + this.#part * (max[this.#axis] - min[this.#axis]);
    const sense = this.#flipped ? 1 : -1;
    this.plane.normal.set(0, 0, 0).setComponent(this.#axis, sense);
    this.plane.constant = -sense * at;
    this.#changed();
  }
}
