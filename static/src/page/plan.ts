/** The floor plan: rooms from above, storey by storey, with doors, notes and where one is. */

import { Vector3 } from "three";
import { svg } from "../dom.ts";
import { intoBuilding } from "../scene/place.ts";
import type { Room, Storey, Tour, Triple } from "../tour.ts";

/** Metres that a plan shows beyond the rooms. */
const MARGIN_M = 0.6;
/** Lengths that a scale bar may have. */
const BARS_M = [0.5, 1, 2, 5, 10, 20, 50, 100];
const BAR_SHARE = 0.28;
/** Where one is and looks, up the page, y up, metres. */
export const ARROW = "M0 .34 .2 -.22 0 -.1 -.2 -.22Z";

export interface PlanEvents {
  /** A place on a floor was clicked, room frame. */
  chosen(room: Room, at: Triple): void;
}

interface Drawn {
  readonly room: Room;
  readonly storey: Storey;
}

/** The storeys of the building that there are, from above. */
export function levelsOf(tour: Tour): number[] {
  const levels = new Set(tour.rooms.flatMap((room) => room.storeys.map(({ level }) => level)));
  return [...levels].sort((a, b) => b - a);
}

/** The storey of a room that a place in it belongs to: the highest floor below it. */
export function storeyAt(room: Room, z: number): Storey | null {
  const below = room.storeys.filter(({ floor_m }) => floor_m < z - 0.3);
  return below[below.length - 1] ?? room.storeys[0] ?? null;
}

export class Plan {
  readonly element: SVGSVGElement;
  readonly #tour: Tour;
  readonly #events: PlanEvents | null;
  readonly #rooms = svg("g");
  /** Not to be seen before somebody stands on this plan. */
  readonly #you = svg("path", { class: "you", d: ARROW, hidden: "" });
  #level: number | null = null;
  #low = { x: 0, y: 0 };
  #high = { x: 1, y: 1 };

  /** @param events Left out: a picture that cannot be clicked. */
  constructor(tour: Tour, events: PlanEvents | null = null) {
    this.#tour = tour;
    this.#events = events;
    this.element = svg("svg", { class: "plan", role: "img" });
    this.element.append(this.#rooms, this.#you);
  }

  get level(): number | null {
    return this.#level;
  }

  /** What the drawing shows: its upper left corner and its size, metres, y down. */
  get extent(): { readonly left: number; readonly top: number; readonly width: number; readonly height: number } {
    const { x, y } = this.#low;
    return { left: x, top: y, width: this.#high.x - x, height: this.#high.y - y };
  }

  /** Draws a storey of the building. Returns whether it was another one until now. */
  show(level: number): boolean {
    if (this.#level === level) return false;
    this.#level = level;
    const drawn = this.#tour.rooms.flatMap((room) =>
      room.storeys.filter((storey) => storey.level === level).map((storey) => ({ room, storey })),
    );
    this.#rooms.replaceChildren(...drawn.map((each) => this.#draw(each)));
    this.#frame(drawn);
    return true;
  }

  /** Marks the room one is in. */
  here(room: Room): void {
    for (const each of this.#rooms.children) {
      each.classList.toggle("here", each.getAttribute("data-room") === room.id);
    }
  }

  /** Marks where in a room one is. */
  stand(room: Room, eye: Vector3, yaw: number): void {
    this.here(room);
    const at = eye.clone().applyMatrix4(intoBuilding(room.place));
    const turn = (yaw * 180) / Math.PI + room.place.turn_deg - 90;
    this.#you.setAttribute(
      "transform",
      `translate(${at.x.toFixed(2)} ${(-at.y).toFixed(2)}) rotate(${(-turn).toFixed(1)}) scale(1.1 -1.1)`,
    );
    const storey = storeyAt(room, eye.z);
    this.#you.toggleAttribute("hidden", storey?.level !== this.#level);
  }

  /** A bar as long as a round number of metres, and that number. */
  scale(): { readonly metres: number; readonly share: number } {
    const width = this.#high.x - this.#low.x;
    const metres = BARS_M.findLast((each) => each <= width * BAR_SHARE) ?? 0.5;
    return { metres, share: metres / width };
  }

  #draw({ room, storey }: Drawn): SVGGElement {
    const group = svg("g", { "data-room": room.id, class: "plan-room" });
    const { at, turn_deg } = room.place;
    group.setAttribute("transform", `translate(${at[0]} ${-at[1]}) rotate(${-turn_deg}) scale(1 -1)`);
    const floor = svg("path", { class: "plan-floor", d: storey.floor, "fill-rule": "evenodd" });
    group.append(
      floor,
      svg("path", { class: "plan-low", d: storey.low }),
      svg("path", { class: "plan-walls", d: storey.walls }),
    );
    const near = (z: number): boolean => storeyAt(room, z) === storey;
    for (const door of room.links.filter(({ at: place }) => near(place[2]))) {
      group.append(dot(door.at, "plan-door", 0.16));
    }
    for (const note of room.notes.filter(({ at: place }) => near(place[2]))) {
      group.append(dot(note.at, "plan-note", 0.1));
    }
    const events = this.#events;
    if (events) {
      floor.addEventListener("click", (event) => {
        const matrix = floor.getScreenCTM()?.inverse();
        if (!matrix) return;
        const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix);
        events.chosen(room, [place.x, place.y, storey.floor_m]);
      });
    }
    return group;
  }

  #frame(drawn: readonly Drawn[]): void {
    const xs: number[] = [];
    const ys: number[] = [];
    for (const { room } of drawn) {
      const { min, max } = room.bounds;
      for (const [x, y] of [
        [min[0], min[1]],
        [min[0], max[1]],
        [max[0], min[1]],
        [max[0], max[1]],
      ] as const) {
        const at = new Vector3(x, y, 0).applyMatrix4(intoBuilding(room.place));
        xs.push(at.x);
        ys.push(-at.y);
      }
    }
    if (xs.length === 0) return;
    this.#low = { x: Math.min(...xs) - MARGIN_M, y: Math.min(...ys) - MARGIN_M };
    this.#high = { x: Math.max(...xs) + MARGIN_M, y: Math.max(...ys) + MARGIN_M };
    const { x, y } = this.#low;
    this.element.setAttribute(
      "viewBox",
      [x, y, this.#high.x - x, this.#high.y - y].map((v) => v.toFixed(2)).join(" "),
    );
  }
}

function dot(at: Triple, kind: string, radius: number): SVGCircleElement {
  return svg("circle", { class: kind, cx: String(at[0]), cy: String(at[1]), r: String(radius) });
}
