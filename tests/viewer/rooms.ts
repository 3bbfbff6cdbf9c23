/** Rooms to walk in, made of boxes and steps. */

import { Collider } from "../../static/src/walk/collider.ts";
import type { Bounds } from "../../static/src/walk/walker.ts";

type Point = readonly [number, number, number];

export class Shape {
  readonly #positions: number[] = [];
  readonly #index: number[] = [];

  /** A quadrilateral, either way round. */
  quad(a: Point, b: Point, c: Point, d: Point): this {
    const start = this.#positions.length / 3;
    this.#positions.push(...a, ...b, ...c, ...d);
    this.#index.push(start, start + 1, start + 2, start, start + 2, start + 3);
    return this;
  }

  floor(x0: number, y0: number, x1: number, y1: number, z: number): this {
    return this.quad([x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]);
  }

  /** An upright wall between two places. */
  wall(x0: number, y0: number, x1: number, y1: number, z0: number, z1: number): this {
    return this.quad([x0, y0, z0], [x1, y1, z0], [x1, y1, z1], [x0, y0, z1]);
  }

  box(x0: number, y0: number, z0: number, x1: number, y1: number, z1: number): this {
    return this.floor(x0, y0, x1, y1, z0)
      .floor(x0, y0, x1, y1, z1)
      .wall(x0, y0, x1, y0, z0, z1)
      .wall(x1, y0, x1, y1, z0, z1)
      .wall(x1, y1, x0, y1, z0, z1)
      .wall(x0, y1, x0, y0, z0, z1);
  }

  collider(): Collider {
    return new Collider(new Float32Array(this.#positions), new Uint32Array(this.#index));
  }
}

export const SIX_METRES: Bounds = { min: [-3, -3, -0.1], max: [3, 3, 7] };

/** A room of 6 by 6 by 3 metres. */
export function room(): Shape {
  return new Shape().box(-3, -3, 0, 3, 3, 3);
}

export const STAIR_RADIUS_M = 1.1;
const NEWEL_M = 0.12;
const STEPS_A_TURN = 14;
/** No more, or the landing hangs too low over the steps below it. */
const LANDING_STEPS = 3;

/**
 * A spiral stair in a shaft 2.2 m wide: treads counter-clockwise from +x, then a landing.
 *
 * @param missing Numbers of treads that no scanner saw.
 */
export function spiral(steps: number, rise: number, missing: readonly number[] = []): Shape {
  const shape = new Shape();
  const height = steps * rise + 3;
  const at = (turn: number, radius: number, z: number): Point => [
    radius * Math.cos(turn),
    radius * Math.sin(turn),
    z,
  ];
  const step = (2 * Math.PI) / STEPS_A_TURN;
  for (let k = 0; k < 28; k++) {
    const [a, b] = [(k * Math.PI) / 14, ((k + 1) * Math.PI) / 14];
    for (const radius of [NEWEL_M, STAIR_RADIUS_M]) {
      shape.quad(at(a, radius, 0), at(b, radius, 0), at(b, radius, height), at(a, radius, height));
    }
    shape.quad([0, 0, 0], at(a, STAIR_RADIUS_M, 0), at(b, STAIR_RADIUS_M, 0), [0, 0, 0]);
  }
  for (let k = 1; k <= steps + LANDING_STEPS; k++) {
    if (missing.includes(k)) continue;
    const [a, b] = [k * step, (k + 1) * step];
    const top = Math.min(k, steps) * rise;
    const below = top - rise - 0.05;
    shape.quad(at(a, NEWEL_M, top), at(a, STAIR_RADIUS_M, top), at(b, STAIR_RADIUS_M, top), at(b, NEWEL_M, top));
    shape.quad(at(a, NEWEL_M, below), at(a, STAIR_RADIUS_M, below), at(b, STAIR_RADIUS_M, below), at(b, NEWEL_M, below));
    shape.quad(at(a, NEWEL_M, below), at(a, STAIR_RADIUS_M, below), at(a, STAIR_RADIUS_M, top), at(a, NEWEL_M, top));
  }
  return shape;
}
