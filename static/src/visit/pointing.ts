/** Mouse and fingers: what a drag, a click, a hover over the picture means in the way one sees. */

import type { Raycaster, Vector3 } from "three";
import type { Frontend } from "../page/frontend.ts";
import type { Rooms } from "../rooms.ts";
import { Marker } from "../scene/marker.ts";
import type { Stage } from "../scene/stage.ts";
import type { Tools } from "../tools.ts";
import { isFloor, type Hit } from "../walk/collider.ts";
import { Pointer } from "../walk/pointer.ts";
import type { Walking } from "./walking.ts";
import type { Ways } from "./ways.ts";

const ZOOM_STEP = 1.08;
/** A click on a wall leads to the floor so far before it. */
const BEFORE_WALL_M = 0.45;

export interface PointingHost {
  readonly stage: Stage;
  readonly front: Frontend;
  readonly rooms: Rooms;
  readonly walking: Walking;
  readonly ways: Ways;
  readonly tools: Tools;
  /** Whatever moves by itself leaves off. */
  takeOver(): void;
}

export class Pointing {
  readonly #host: PointingHost;
  readonly #marker = new Marker();
  readonly #pointer: Pointer;

  constructor(host: PointingHost) {
    this.#host = host;
    host.stage.scene.add(this.#marker.group);
    this.#pointer = new Pointer(host.front.canvas, host.front.spots.element, {
      look: (dx, dy) => this.#turn(dx, dy),
      click: (x, y) => this.#click(x, y),
      hover: (x, y) => this.#hover(x, y),
      leave: () => {
        if (this.#marker.hide()) host.stage.draw();
      },
      stick: (ahead, left) => this.#walk(ahead, left),
      wheel: (sense) => this.#zoom(sense),
    });
  }

  /** Takes the mark on the floor away. */
  unmark(): void {
    this.#marker.hide();
  }

  #turn(dx: number, dy: number): void {
    const { stage, walking, ways } = this.#host;
    if (ways.overview) return walking.act(() => undefined);
    this.#host.takeOver();
    const angle = stage.pixelAngle;
    walking.visitor.turn(dx * angle, dy * angle);
    walking.aim();
  }

  #click(x: number, y: number): void {
    const { stage, tools, walking, ways } = this.#host;
    const caster = stage.caster(x, y);
    if (tools.click(caster)) return;
    if (ways.overview) return ways.overview.click(caster);
    const place = this.#placeAt(this.#cast(caster));
    this.#host.takeOver();
    if (place) walking.act(() => walking.visitor.walkTo(place));
  }

  #walk(ahead: number, left: number): void {
    const { walking, ways } = this.#host;
    if (ways.overview) return walking.act(() => undefined);
    this.#host.takeOver();
    walking.act(() => walking.visitor.setStick(ahead, left));
  }

  #zoom(sense: number): void {
    const { rooms, stage, walking, ways } = this.#host;
    if (ways.overview) return walking.act(() => undefined);
    stage.zoom(ZOOM_STEP ** sense);
    rooms.tiles?.moved();
  }

  #cast({ ray }: Raycaster): Hit | null {
    return this.#host.rooms.collider?.cast(ray.origin, ray.direction) ?? null;
  }

  /** Where a click leads: to the floor that it hit, or to the foot of the wall. */
  #placeAt(hit: Hit | null): Vector3 | null {
    if (!hit) return null;
    const { rooms, walking } = this.#host;
    const place = hit.point.clone();
    if (isFloor(hit)) return place;
    place.addScaledVector(hit.normal, BEFORE_WALL_M);
    const floor = rooms.collider?.heightBelow(place.x, place.y, place.z);
    return place.setZ(floor ?? walking.visitor.feet?.z ?? place.z);
  }

  #hover(x: number, y: number): void {
    const { front, stage, tools, ways } = this.#host;
    const idle = this.#pointer.dragging || ways.overview !== null || tools.picks;
    const hit = idle ? null : this.#cast(stage.caster(x, y));
    const floor = hit && isFloor(hit) ? hit : null;
    front.canvas.classList.toggle("on-floor", floor !== null);
    if (floor) this.#marker.show(floor.point, floor.normal);
    if (floor || this.#marker.hide()) stage.draw();
  }
}
