/** Which levels of detail are shown: what the view asks for, or, for tests, what an address says. */

import type { Tile } from "3d-tiles-renderer/core";

/** `view` is the rule; the others are for tests, asked for as `?levels=...`. */
export type Levels = "view" | "root" | "leaves" | "checkerboard";

export function levelsOf(value: string | null): Levels {
  return value === "root" || value === "leaves" || value === "checkerboard" ? value : "view";
}

interface Box {
  readonly min: readonly number[];
  readonly max: readonly number[];
}

/**
 * Two colours for boxes, such that neighbours differ where that is possible.
 *
 * Boxes are taken in the order given; each gets the colour that fewer of its coloured
 * neighbours have. On a regular grid in row order this is a checkerboard.
 */
export function checkerboard(boxes: readonly Box[]): boolean[] {
  const colours: boolean[] = [];
  boxes.forEach((box, i) => {
    let balance = 0;
    for (let j = 0; j < i; j++) {
      const other = boxes[j];
      if (other) balance += facesMeet(box, other) ? (colours[j] ? 1 : -1) : 0;
    }
    colours.push(balance < 0);
  });
  return colours;
}

/** Whether two boxes touch along more than an edge. */
function facesMeet(a: Box, b: Box): boolean {
  let wide = 0;
  for (let axis = 0; axis < 3; axis++) {
    const overlap =
      Math.min(a.max[axis] ?? 0, b.max[axis] ?? 0) - Math.max(a.min[axis] ?? 0, b.min[axis] ?? 0);
    const size = Math.min(
      (a.max[axis] ?? 0) - (a.min[axis] ?? 0),
      (b.max[axis] ?? 0) - (b.min[axis] ?? 0),
    );
    if (overlap < -0.05) return false;
    if (overlap > 0.3 * size) wide++;
  }
  return wide >= 2;
}

/** A tile's box from its twelve numbers; axis-aligned, as tourgen writes them. */
export function boxOf(tile: Tile): Box {
  const b = tile.boundingVolume.box ?? [];
  const centre = [b[0] ?? 0, b[1] ?? 0, b[2] ?? 0];
  const half = [0, 1, 2].map((axis) =>
    [3, 6, 9].reduce((sum, row) => sum + Math.abs(b[row + axis] ?? 0), 0),
  );
  return {
    min: centre.map((c, i) => c - (half[i] ?? 0)),
    max: centre.map((c, i) => c + (half[i] ?? 0)),
  };
}
