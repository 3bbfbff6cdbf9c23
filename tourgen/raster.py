"""Which texels a triangle covers, for many triangles at once.

Unwrap asks it whether charts overlap, bake asks it where each texel lies on the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Float64, Int32

_FLAT = 1e-12  # square texels


@dataclass(frozen=True, slots=True)
class Fragments:
    """Pairs of a texel and a triangle that covers it.

    Attributes:
        face: (k,) int32, index of the triangle.
        row: (k,) int32, texel row.
        column: (k,) int32, texel column.
        barycentric: (k, 3) float32, of the texel's centre; negative outside of the triangle.
    """

    face: Int32
    row: Int32
    column: Int32
    barycentric: Float32


def rasterize(triangles: Float64, width: int, height: int, reach: float = 0.0) -> Fragments:
    """The texels whose centre lies in a triangle, or within ``reach`` texels of its edges.

    Half-open on shared edges only as far as floating point goes: a centre exactly on an edge
    belongs to both triangles.

    Args:
        triangles: (f, 3, 2) float64, corners (column, row) in texels, the centre of the first
            texel at (0.5, 0.5). Winding is free; a triangle without area covers nothing unless
            ``reach`` is given, and then the texels about its corners.
        width: Texels in a row.
        height: Rows.
        reach: Distance in texels past an edge that still counts; corners are mitred at the
            triangle's bounding box, so no texel that the triangle touches is missed at
            ``reach`` = 0.71, half a texel's diagonal.

    Returns:
        Fragments in the order of the triangles.
    """
    first = np.zeros(len(triangles) + 1, np.int64)
    _cover(triangles, width, height, reach, first, *_room(0))
    np.cumsum(first, out=first)
    face, row, column, barycentric = _room(int(first[-1]))
    _cover(triangles, width, height, reach, first, face, row, column, barycentric)
    return Fragments(face, row, column, barycentric)


def _room(count: int) -> tuple[Int32, Int32, Int32, Float32]:
    face, row, column = np.empty((3, count), np.int32)
    return face, row, column, np.empty((count, 3), np.float32)


@compiled
def _cover(
    triangles: Float64,
    width: int,
    height: int,
    reach: float,
    first: npt.NDArray[np.int64],
    face: Int32,
    row: Int32,
    column: Int32,
    barycentric: Float32,
) -> None:
    """Write the fragments of each triangle from ``first`` on.

    Where there is no room for any, count them instead, into the place of the next triangle.
    """
    by_row, by_column, base, margin = np.empty((4, 3))
    share = np.empty(3)
    counting = len(face) == 0
    for number in range(len(triangles)):
        corner = triangles[number]
        area = (corner[1, 0] - corner[0, 0]) * (corner[2, 1] - corner[0, 1])
        area -= (corner[1, 1] - corner[0, 1]) * (corner[2, 0] - corner[0, 0])
        flat = abs(area) < _FLAT
        if flat and not reach > 0:
            continue
        scale = 0.0 if flat else 1 / area
        for i in range(3):  # edge i faces corner i; shares are linear in column and row
            start, end = corner[(i + 1) % 3], corner[(i + 2) % 3]
            by_row[i], by_column[i] = (end[0] - start[0]) * scale, (start[1] - end[1]) * scale
            base[i] = by_row[i] * (0.5 - start[1]) + by_column[i] * (0.5 - start[0])
            if flat:
                base[i] = 1 / 3
            margin[i] = -reach * np.hypot(by_row[i], by_column[i])
        left = max(int(np.floor(corner[:, 0].min() - 0.5 - reach)) + 1, 0)
        right = min(int(np.floor(corner[:, 0].max() - 0.5 + reach)) + 1, width)
        top = max(int(np.floor(corner[:, 1].min() - 0.5 - reach)) + 1, 0)
        bottom = min(int(np.floor(corner[:, 1].max() - 0.5 + reach)) + 1, height)
        at = first[number]
        for r in range(top, bottom):
            for c in range(left, right):
                inside = True
                for i in range(3):
                    share[i] = by_row[i] * r + by_column[i] * c + base[i]
                    inside &= share[i] >= margin[i]
                if not inside:
                    continue
                if counting:
                    first[number + 1] += 1
                else:
                    face[at], row[at], column[at] = number, r, c
                    for i in range(3):
                        barycentric[at, i] = share[i]
                    at += 1
