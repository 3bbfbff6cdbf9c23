/** The room as something to bump into: rays and capsules against its coarsest tile. */

import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  Line3,
  Ray,
  Vector3,
} from "three";
import { MeshBVH } from "three-mesh-bvh";

export interface Hit {
  readonly point: Vector3;
  /** Unit length, turned toward where the ray came from. */
  readonly normal: Vector3;
  readonly distance: number;
}

const DOWN = new Vector3(0, 0, -1);
const UP = new Vector3(0, 0, 1);
/** A contact that pushes more up or down than this is floor or ceiling, not wall (sine of slope). */
const WALL_MAX_RISE = 0.6;
const PUSH_ROUNDS = 3;
/** A surface whose normal points up less than this is no place to walk to (cosine of its slope). */
const FLOOR_MIN_RISE = 0.6;

export class Collider {
  readonly #bvh: MeshBVH;

  /**
   * @param positions (v, 3), metres, room frame, z up.
   * @param index (f, 3), indices into positions.
   */
  constructor(positions: Float32Array, index: Uint32Array) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    geometry.setIndex(new BufferAttribute(index, 1));
    this.#bvh = new MeshBVH(geometry);
  }

  /** The first surface that a ray meets, whichever way it faces. */
  cast(origin: Vector3, direction: Vector3, far = Infinity): Hit | null {
    const ray = new Ray(origin, direction);
    const hit = this.#bvh.raycastFirst(ray, DoubleSide, 0, far);
    if (!hit) return null;
    const normal = hit.face ? hit.face.normal.clone() : UP.clone();
    if (normal.dot(direction) > 0) normal.negate();
    return { point: hit.point, normal, distance: hit.distance };
  }

  /** Height of the first surface below a point, or null. */
  heightBelow(x: number, y: number, z: number, far = Infinity): number | null {
    return this.cast(new Vector3(x, y, z), DOWN, far)?.point.z ?? null;
  }

  /** Height of the first surface above a point, or null. */
  heightAbove(x: number, y: number, z: number, far = Infinity): number | null {
    return this.cast(new Vector3(x, y, z), UP, far)?.point.z ?? null;
  }

  /** Whether a surface stands between two points, `slack` metres before the second one at least. */
  blocks(from: Vector3, to: Vector3, slack: number): boolean {
    const way = new Vector3().subVectors(to, from);
    const length = way.length();
    if (length <= slack) return false;
    return this.cast(from, way.divideScalar(length), length - slack) !== null;
  }

  /**
   * How far an upright capsule must move sideways to stand clear of walls.
   *
   * Floors and ceilings do not push: heights are the walker's own business, and a visitor who
   * brushes the edge of a step must not be held up by it.
   *
   * @param x @param y Centre line, metres.
   * @param low @param high Ends of the centre line, metres.
   * @param radius Metres.
   */
  pushOut(x: number, y: number, low: number, high: number, radius: number): [number, number] {
    const segment = new Line3();
    const box = new Box3();
    const onTriangle = new Vector3();
    const onSegment = new Vector3();
    let px = x;
    let py = y;
    for (let round = 0; round < PUSH_ROUNDS; round++) {
      let deepest = 0;
      let pushX = 0;
      let pushY = 0;
      segment.start.set(px, py, low);
      segment.end.set(px, py, Math.max(low, high));
      box.makeEmpty().expandByPoint(segment.start).expandByPoint(segment.end);
      box.min.addScalar(-radius);
      box.max.addScalar(radius);
      this.#bvh.shapecast({
        intersectsBounds: (bounds) => bounds.intersectsBox(box),
        intersectsTriangle: (triangle) => {
          const distance = triangle.closestPointToSegment(segment, onTriangle, onSegment);
          const depth = radius - distance;
          if (depth <= deepest) return;
          const dx = onSegment.x - onTriangle.x;
          const dy = onSegment.y - onTriangle.y;
          const dz = onSegment.z - onTriangle.z;
          const flat = Math.hypot(dx, dy);
          if (flat < 1e-6 || Math.abs(dz) > WALL_MAX_RISE * distance) return;
          deepest = depth;
          // sideways far enough to clear a contact that also leans: radius² = dz² + flat'²
          const clear = Math.sqrt(Math.max(radius * radius - dz * dz, 0)) - flat;
          pushX = (dx / flat) * clear;
          pushY = (dy / flat) * clear;
        },
      });
      if (deepest <= 1e-4) break;
      px += pushX;
      py += pushY;
    }
    return [px, py];
  }
}

/** Whether what a ray met is a floor. */
export function isFloor({ normal }: Hit): boolean {
  return normal.z > FLOOR_MIN_RISE;
}
