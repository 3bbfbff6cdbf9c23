"""Which texels a triangle covers, for many triangles at once.

Unwrap asks it whether charts overlap, bake asks it where each texel lies on the surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from tourgen.geometry import Float32, Float64, Int32

_CANDIDATES_AT_ONCE = 2_000_000
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
    size = np.array([width, height])
    low = np.clip(np.floor(triangles.min(1) - 0.5 - reach).astype(np.int64) + 1, 0, size)
    low = np.minimum(low, size - 1)
    high = np.floor(triangles.max(1) - 0.5 + reach).astype(np.int64) + 1
    spans = np.maximum(np.minimum(high, size) - low, 0)
    counts = spans.prod(1)
    ends = np.cumsum(counts)
    pieces: list[Fragments] = []
    first = 0
    while first < len(triangles):
        start = ends[first] - counts[first]
        last = max(int(np.searchsorted(ends, start + _CANDIDATES_AT_ONCE)), first + 1)
        pieces.append(_piece(triangles, low, spans, counts, first, last, reach))
        first = last
    if not pieces:
        empty = np.zeros(0, np.int32)
        return Fragments(empty, empty, empty, np.zeros((0, 3), np.float32))
    return Fragments(
        np.concatenate([piece.face for piece in pieces]),
        np.concatenate([piece.row for piece in pieces]),
        np.concatenate([piece.column for piece in pieces]),
        np.concatenate([piece.barycentric for piece in pieces]),
    )


def _piece(
    triangles: Float64,
    low: npt.NDArray[np.int64],
    spans: npt.NDArray[np.int64],
    counts: npt.NDArray[np.int64],
    first: int,
    last: int,
    reach: float,
) -> Fragments:
    """The fragments of triangles ``first`` to ``last``: every texel of a box, then a test."""
    counts = counts[first:last]
    face = np.repeat(np.arange(first, last, dtype=np.int32), counts)
    within = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
    across = np.repeat(spans[first:last, 0], counts)
    down = within // across
    column = np.repeat(low[first:last, 0], counts) + within - down * across
    row = np.repeat(low[first:last, 1], counts) + down

    corners = triangles[first:last]
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # edge i faces corner i
    double_area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    flat = np.abs(double_area) < _FLAT
    # Shares of the corners, linear in column and row; a flat triangle gets thirds everywhere.
    scale = np.where(flat, 0.0, 1 / np.where(flat, 1.0, double_area))
    barycentric = np.empty((len(face), 3), np.float32)
    keep = np.repeat(~flat | (reach > 0), counts)
    for i in range(3):
        start = corners[:, (i + 1) % 3]
        by_row, by_column = edges[:, i, 0] * scale, -edges[:, i, 1] * scale
        base = by_row * (0.5 - start[:, 1]) + by_column * (0.5 - start[:, 0])
        base = np.where(flat, 1 / 3, base)
        margin = -reach * np.hypot(by_row, by_column)
        share = np.repeat(by_row, counts) * row
        share += np.repeat(by_column, counts) * column
        share += np.repeat(base, counts)
        keep &= share >= np.repeat(margin, counts)
        barycentric[:, i] = share
    return Fragments(
        face[keep], row[keep].astype(np.int32), column[keep].astype(np.int32), barycentric[keep]
    )
