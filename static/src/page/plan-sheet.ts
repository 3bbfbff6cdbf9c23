/** The floor plan as large as the window, with its storeys, a scale and north. */

import type { Vector3 } from "three";
import { button, element, svg } from "../dom.ts";
import type { Room, Tour } from "../tour.ts";
import type { Words } from "../words.ts";
import { levelsOf, Plan, storeyAt, type PlanEvents } from "./plan.ts";

export class PlanSheet {
  readonly element: HTMLElement;
  readonly #plan: Plan;
  readonly #tour: Tour;
  readonly #levels = element("div", { class: "levels", role: "group" });
  readonly #bar = element("div", { class: "scale-bar" });
  readonly #length = element("span", {});
  readonly #north: HTMLElement | null;
  readonly #titleOf: (room: Room) => string;
  readonly #labels = element("div", { class: "plan-names" });
  readonly #events: PlanEvents;
  #words: Words;

  constructor(tour: Tour, words: Words, titleOf: (room: Room) => string, events: PlanEvents) {
    this.#tour = tour;
    this.#words = words;
    this.#titleOf = titleOf;
    this.#events = events;
    this.#plan = new Plan(tour, events);
    this.#north = tour.north_deg === null ? null : compass(tour.north_deg);
    const foot = element(
      "div",
      { class: "plan-foot" },
      this.#levels,
      element("div", { class: "scale" }, this.#bar, this.#length),
      ...(this.#north ? [this.#north] : []),
    );
    const paper = element("div", { class: "plan-paper" }, this.#plan.element, this.#labels);
    this.element = element("section", { class: "plan-sheet" }, paper, foot);
    new ResizeObserver(() => this.#fit()).observe(paper);
    this.say(words);
  }

  say(words: Words): void {
    this.#words = words;
    this.element.setAttribute("aria-label", words.plan);
    this.#plan.element.setAttribute("aria-label", words.plan);
    this.#levels.setAttribute("aria-label", words.plan);
    if (this.#north) this.#north.setAttribute("aria-label", words.north);
    const level = this.#plan.level;
    if (level !== null) this.#show(level);
  }

  /** Shows where one stands. */
  stand(room: Room, eye: Vector3, yaw: number): void {
    const storey = storeyAt(room, eye.z);
    if (this.#plan.level === null) this.#show(storey?.level ?? 0);
    this.#plan.stand(room, eye, yaw);
  }

  #show(level: number): void {
    this.#plan.show(level);
    const levels = levelsOf(this.#tour);
    this.#levels.hidden = levels.length < 2;
    this.#levels.replaceChildren(
      ...levels.map((each) => {
        const name = each === 0 ? this.#words.entrance : this.#words.storey.replace("{}", String(each));
        const made = button("tool", () => this.#show(each));
        made.textContent = name;
        made.setAttribute("aria-pressed", String(each === level));
        return made;
      }),
    );
    this.#labels.replaceChildren(
      ...this.#tour.rooms.flatMap((room) => {
        const storey = room.storeys.find((each) => each.level === level);
        if (!storey) return [];
        const name = button("plan-name", () => {
          const [x, y] = room.entry.position;
          this.#events.chosen(room, [x, y, storey.floor_m]);
        });
        name.textContent = this.#titleOf(room);
        name.dataset["room"] = room.id;
        return [name];
      }),
    );
    this.#fit();
  }

  /** Brings names and scale up to the size of the drawing. */
  #fit(): void {
    const drawing = this.#plan.element;
    const paper = drawing.getBoundingClientRect();
    for (const name of this.#labels.children) {
      if (!(name instanceof HTMLElement)) continue;
      const room = drawing.querySelector(`[data-room="${name.dataset["room"]}"] .plan-floor`);
      const box = room?.getBoundingClientRect();
      if (!box) continue;
      const x = box.left + box.width / 2 - paper.left;
      const y = box.top + box.height / 2 - paper.top;
      name.style.transform = `translate(${x.toFixed(0)}px, ${y.toFixed(0)}px) translate(-50%, -50%)`;
    }
    const { metres } = this.#plan.scale();
    const perMetre = drawing.getScreenCTM()?.a ?? 0;
    this.#bar.style.width = `${(metres * perMetre).toFixed(0)}px`;
    const language = document.documentElement.lang;
    const form = new Intl.NumberFormat(language, { style: "unit", unit: "meter" });
    this.#length.textContent = form.format(metres);
  }
}

/** An arrow to the north. */
function compass(northDeg: number): HTMLElement {
  const drawing = svg("svg", { viewBox: "-12 -12 24 24", "aria-hidden": "true" });
  const needle = svg("path", { d: "M0 -10 5 9 0 5 -5 9Z", class: "needle" });
  needle.setAttribute("transform", `rotate(${(90 - northDeg).toFixed(1)})`);
  drawing.append(needle);
  return element("div", { class: "compass", role: "img" }, drawing, element("span", {}, "N"));
}
