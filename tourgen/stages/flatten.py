"""Lay charts flat, each in a plane of its own, and say which of their faces still fold.

A chart is seen from its front, relaxed as rigidly as possible, and its small tangles are drawn
out. What folds even then is for the caller to cut.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from tourgen.compiled import compiled
from tourgen.raster import rasterize
from tourgen.stages.charts import numbered, sums, unit

if TYPE_CHECKING:
    from tourgen.geometry import Float64
    from tourgen.stages.charts import Bool, Int64, Topology

_RELAX_ROUNDS = 6
_UNTANGLE_ROUNDS = 4
_TUTTE_ROUNDS = 20
_ANGLES = np.radians(np.arange(0.0, 90.0, 3.0))
_EDGE = 1e-3  # share of a corner below which a place counts as on the edge
_LEAST_AREA = 1e-3  # of a face, as drawn


def flatten(
    tile: Topology, faces: Int64, chart: Int64, some: Int64, texel_m: float
) -> tuple[Float64, Bool]:
    """Lay whole charts flat.

    Args:
        tile: Its faces, each with some area.
        faces: (f, 3) their vertices.
        chart: (f,) their charts.
        some: (k,) the faces to lay flat, all those of the charts that they lie in.
        texel_m: Edge of a texel, metres.

    Returns:
        (k, 3, 2) corners in texels: each chart begins at (0, 0), turned so that the box about
        it is smallest. And (k,) which faces lie on another face of their chart, or are drawn
        upside down or as nothing.
    """
    patch = _patch(tile, faces, chart, some)
    corners = _drawn(patch, _relaxed(patch, _seen(patch)), texel_m)
    return corners, _folded(patch, corners, texel_m)


@dataclass(frozen=True, slots=True)
class _Patch:
    """Charts with vertices of their own, numbered from 0.

    Attributes:
        own: (k, 3, 2) metres, each face in its own plane.
        faces: (k, 3) indices of vertices.
        chart: (k,) chart of each face.
        axes: (c, 3) unit, where each chart looks.
        at: (u, 3) metres in the room.
        owner: (u,) chart of each vertex.
    """

    own: Float64
    faces: Int64
    chart: Int64
    axes: Float64
    at: Float64
    owner: Int64


def _patch(tile: Topology, faces: Int64, chart: Int64, some: Int64) -> _Patch:
    chart = numbered(chart[some])
    corners = tile.corners[some]
    most = int(faces.max()) + 1
    key, first, vertex = np.unique(
        chart[:, None] * most + faces[some], return_index=True, return_inverse=True
    )
    ways = sums(chart, tile.normals[some] * tile.areas[some, None], int(chart.max()) + 1)
    at = corners.reshape(-1, 3)[first]
    return _Patch(_laid(corners), vertex.reshape(-1, 3), chart, unit(ways), at, key // most)


def _laid(corners: Float64) -> Float64:
    """(k, 3, 2) each face in its own plane, its first edge along the first axis."""
    edge = corners[:, 1] - corners[:, 0]
    length = np.linalg.norm(edge, axis=1)
    along = edge / np.maximum(length, 1e-30)[:, None]
    other = corners[:, 2] - corners[:, 0]
    x = (other * along).sum(1)
    y = np.linalg.norm(other - x[:, None] * along, axis=1)
    zero = np.zeros_like(x)
    return np.stack([zero, zero, length, zero, x, y], axis=1).reshape(-1, 3, 2)


def _seen(patch: _Patch) -> Float64:
    """(u, 2) metres, each chart from its front."""
    least = np.eye(3)[np.abs(patch.axes).argmin(1)]
    right = unit(np.cross(least, patch.axes))
    up = np.cross(patch.axes, right)
    axes = np.stack([right, up], axis=1)[patch.owner]
    return np.asarray((axes * patch.at[:, None]).sum(2))


def _relaxed(patch: _Patch, flat: Float64) -> Float64:
    """(u, 2) as rigid as possible: each face keeps its shape as far as its neighbours let it.

    Liu, Zhang, Xu, Gotsman, Gortler: A local/global approach to mesh parameterization, 2008.
    """
    own, faces, count = patch.own, patch.faces, len(flat)
    # Edge i runs from corner i + 1 to corner i + 2 and faces corner i.
    first, second = np.roll(own, -1, 1) - own, np.roll(own, -2, 1) - own
    cross = np.abs(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
    cotangent = (first * second).sum(2) / np.maximum(cross, 1e-12)
    weight = np.clip(cotangent, 0.05, 20.0) / 2
    begin, end = np.roll(faces, -1, 1), np.roll(faces, -2, 1)
    half = sparse.coo_matrix((weight.ravel(), (begin.ravel(), end.ravel())), shape=(count, count))
    off = (half + half.T).tocsr()
    degree = np.asarray(off.sum(1)).ravel()
    pin = np.zeros(count)
    pin[np.unique(patch.owner, return_index=True)[1]] = 1.0  # each chart may slide freely
    solve = splu(
        sparse.csc_matrix(sparse.diags(degree + pin + 1e-9) - off),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    # In complex numbers a face's turn is one number of length 1.
    edge = np.roll(own, -2, 1) - np.roll(own, -1, 1)
    edges = edge[..., 0] + 1j * edge[..., 1]
    plane = flat[:, 0] + 1j * flat[:, 1]
    for _ in range(_RELAX_ROUNDS):
        turn = (weight * (plane[end] - plane[begin]) * edges.conj()).sum(1)
        pull = (weight * edges * (turn / np.maximum(np.abs(turn), 1e-30))[:, None]).ravel()
        right_side = np.stack([pin * plane.real, pin * plane.imag], axis=1)
        for i, part in enumerate((pull.real, pull.imag)):
            right_side[:, i] += np.bincount(end.ravel(), part, count)
            right_side[:, i] -= np.bincount(begin.ravel(), part, count)
        solved = solve.solve(right_side)
        plane = solved[:, 0] + 1j * solved[:, 1]
    return _untangled(np.stack([plane.real, plane.imag], axis=1), faces)


def _untangled(flat: Float64, faces: Int64) -> Float64:
    """Draw the vertices about upside-down faces toward the middle of their neighbours.

    Tutte: How to draw a graph, 1963, on small patches; the border of a chart stays.
    """
    count = len(flat)
    begin, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edges = sparse.coo_matrix((np.ones(len(begin)), (begin, end)), shape=(count, count)).tocsr()
    lone = (edges - edges.T).tocoo()
    inner = np.ones(count, bool)
    inner[lone.row[lone.data != 0]] = False
    both = edges + edges.T
    degree = np.maximum(np.asarray(both.sum(1)).ravel(), 1.0)
    mean = sparse.csr_matrix(sparse.diags(1 / degree) @ both)
    for ring in range(_UNTANGLE_ROUNDS):
        upside_down = (_signed_areas(flat[faces]) <= 0) & inner[faces].any(1)
        if not upside_down.any():
            break
        near = np.zeros(count)
        near[faces[upside_down]] = 1.0
        for _ in range(ring):
            near = near + np.asarray(both @ near)
        moving = np.flatnonzero((near > 0) & inner)
        rows = mean[moving]
        flat = flat.copy()
        for _ in range(_TUTTE_ROUNDS):
            flat[moving] = np.asarray(rows @ flat)
    return flat


def _drawn(patch: _Patch, flat: Float64, texel_m: float) -> Float64:
    """(k, 3, 2) texels, each chart turned so that the box about it is smallest."""
    best_area = np.full(len(patch.axes), np.inf)
    best = np.zeros(len(best_area))
    for angle in _ANGLES:
        low, high = boxes(_turned(flat, angle), patch.owner)
        area = (high - low).prod(1)
        better = area < best_area * (1 - 1e-6)
        best_area[better], best[better] = area[better], angle
    flat = _turned(flat, best[patch.owner])
    low, _ = boxes(flat, patch.owner)
    return np.asarray(((flat - low[patch.owner]) / texel_m)[patch.faces])


def _turned(flat: Float64, angle: float | Float64) -> Float64:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * flat[:, 0] - sin * flat[:, 1], sin * flat[:, 0] + cos * flat[:, 1]], 1)


def _folded(patch: _Patch, corners: Float64, texel_m: float) -> Bool:
    """(k,) faces that lie on another of their chart, or upside down, or are drawn as nothing."""
    _, high = boxes(corners.reshape(-1, 2), np.repeat(patch.chart, 3))
    heights = np.ceil(high[:, 1]).astype(np.int64) + 1
    apart = corners.copy()
    apart[..., 1] += (np.cumsum(heights) - heights)[patch.chart, None]
    true = _signed_areas(patch.own) / texel_m**2
    nothing: Bool = _signed_areas(corners) < _LEAST_AREA * true
    return nothing | drawn_twice(apart, int(np.ceil(high[:, 0].max())) + 1, int(heights.sum()))


def drawn_twice(corners: Float64, width: int, height: int) -> Bool:
    """(k,) which of (k, 3, 2) faces, in texels, cover the centre of a texel that another covers."""
    hits = rasterize(corners, width, height)
    # A centre on a common edge belongs to both of its faces, and is no overlap.
    deep = hits.barycentric.min(1) > _EDGE
    key = hits.row[deep].astype(np.int64) * width + hits.column[deep]
    order = np.argsort(key, kind="stable")
    twice = np.flatnonzero(np.diff(key[order]) == 0)
    found = hits.face[deep][order]
    bad = np.zeros(len(corners), bool)
    bad[found[twice]] = True
    bad[found[twice + 1]] = True
    return bad


def boxes(flat: Float64, owner: Int64) -> tuple[Float64, Float64]:
    """Lowest and highest (c, 2) of the (n, 2) points of each owner, numbered from 0."""
    count = int(owner.max()) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    _stretch(flat, owner, low, high)
    return low, high


@compiled
def _stretch(flat: Float64, owner: Int64, low: Float64, high: Float64) -> None:
    """Stretch the box of each owner about its points."""
    for i, own in enumerate(owner):
        for k in range(2):
            low[own, k] = min(low[own, k], flat[i, k])
            high[own, k] = max(high[own, k], flat[i, k])


def _signed_areas(corners: Float64) -> Float64:
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray((one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2)
