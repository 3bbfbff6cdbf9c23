"""Which faces of a tile belong together: charts that look about one way, and how to cut them.

Rooms are mostly flat, and noise is what shatters their charts. So faces are grouped by normals
averaged over the faces about them, and crumbs join a neighbour.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from scipy import sparse

from tourgen.stages import mesh_arrays

if TYPE_CHECKING:
    from tourgen.geometry import Float64

Int64 = npt.NDArray[np.int64]
Bool = npt.NDArray[np.bool_]

_SMOOTHING_ROUNDS = 8
_AXIS_COS = np.cos(np.radians(40.0))  # a group's normals lie about an axis
_MAX_AXES = 14
_LABEL_ROUNDS = 4
_LABEL_WEIGHT = 0.5  # of agreeing with the faces about, against looking along the axis
_MERGE_COS = np.cos(np.radians(75.0))
_RINGS = 3  # taken out with a fold


@dataclass(frozen=True, slots=True)
class Topology:
    """A tile's faces, and which of them meet.

    Attributes:
        corners: (f, 3, 3) metres.
        normals: (f, 3) unit.
        areas: (f,) square metres.
        pairs: (e, 2) faces that share an edge and agree on its direction.
        lengths: (e,) metres, of the shared edges.
    """

    corners: Float64
    normals: Float64
    areas: Float64
    pairs: Int64
    lengths: Float64


def topology(vertices: Float64, faces: Int64) -> Topology:
    """Measure (f, 3) faces over (v, 3) vertices in metres, and find which of them meet."""
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double_areas = np.linalg.norm(cross, axis=1)
    normals = cross / np.maximum(double_areas, 1e-30)[:, None]

    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    forward, backward = start * len(vertices) + end, end * len(vertices) + start
    _, index, uses = np.unique(forward, return_index=True, return_counts=True)
    once = index[uses == 1]  # an edge run twice in one direction is no manifold: cut there
    lookup = forward[once]
    at = np.minimum(np.searchsorted(lookup, backward[once]), max(len(lookup) - 1, 0))
    met = (lookup[at] == backward[once]) & (lookup < backward[once])
    one, two = once[met], once[at[met]]
    lengths = np.linalg.norm(vertices[start[one]] - vertices[end[one]], axis=1)
    return Topology(corners, normals, double_areas / 2, np.stack([one, two], 1) // 3, lengths)


def segment(tile: Topology, least_faces: int) -> Int64:
    """(f,) chart of each face: connected faces that look about the same way.

    Args:
        tile: Its faces.
        least_faces: A chart of fewer joins a neighbour that it does not look away from.
    """
    normals = _smoothed(tile)
    axes = _axes(normals, tile.areas)
    likeness: Float64 = normals @ axes.T
    label = likeness.argmax(1).astype(np.int64)
    share = _averaging(tile.pairs, tile.lengths, len(label))
    for _ in range(_LABEL_ROUNDS):
        votes = share @ np.eye(len(axes))[label]
        label = (likeness + _LABEL_WEIGHT * votes).argmax(1).astype(np.int64)
    return merge_small(tile, components(tile, label), normals, least_faces, 0.0)


def merge_small(
    tile: Topology, chart: Int64, normals: Float64, least_faces: int, least_cos: float
) -> Int64:
    """Join charts of few faces to the neighbour that shares most border with them.

    Args:
        tile: Its faces.
        chart: (f,) numbered from 0.
        normals: (f, 3) unit, which way each face is taken to look.
        least_faces: Charts of fewer are joined, the smallest first.
        least_cos: Of the angle between the ways that two charts look, for them to be joined.

    Returns:
        (f,) charts, numbered from 0.
    """
    count = int(chart.max()) + 1
    faces = np.bincount(chart, minlength=count)
    ways = sums(chart, normals * tile.areas[:, None], count)
    neighbours = _borders(tile, chart, count)
    target = np.arange(count)
    for small in np.argsort(faces, kind="stable"):
        if faces[small] >= least_faces or not neighbours[small]:
            continue
        cosines = {each: float(unit(ways[small]) @ unit(ways[each])) for each in neighbours[small]}
        best = max(cosines, key=lambda each: (cosines[each] > _MERGE_COS, neighbours[small][each]))
        if cosines[best] < least_cos:
            continue
        target[small] = best
        faces[best] += faces[small]
        ways[best] += ways[small]
        for other, length in neighbours[small].items():
            del neighbours[other][small]
            if other != best:
                neighbours[best][other] = neighbours[best].get(other, 0.0) + length
                neighbours[other][best] = neighbours[other].get(best, 0.0) + length
        neighbours[small] = {}
    while (target[target] != target).any():
        target = target[target]
    return numbered(target[chart])


def cut(tile: Topology, chart: Int64, bad: Bool) -> Int64:
    """Cut the charts that hold bad faces; the others keep their faces together.

    Bad faces are taken out with those about them; where that takes all, the chart is halved.

    Args:
        tile: Its faces.
        chart: (f,) numbered from 0.
        bad: (f,) which faces cannot stay where they are.

    Returns:
        (f,) charts, numbered from 0, each of connected faces.
    """
    inside = tile.pairs[chart[tile.pairs[:, 0]] == chart[tile.pairs[:, 1]]]
    side = bad.copy()
    for _ in range(_RINGS):
        side[inside[(side[inside]).any(1)]] = True
    # A chart that is taken out whole would come back as it was.
    centers = tile.corners.mean(1)
    whole = np.bincount(chart, side) == np.bincount(chart)
    for which in np.flatnonzero(whole):
        some = np.flatnonzero(chart == which)
        side[some] = _halves(centers[some])
    return components(tile, 2 * chart + side)


def components(tile: Topology, label: Int64) -> Int64:
    """Number the connected faces of one label."""
    same = label[tile.pairs[:, 0]] == label[tile.pairs[:, 1]]
    return mesh_arrays.components(tile.pairs[same], len(label)).astype(np.int64)


def numbered(label: Int64) -> Int64:
    """The same labels, numbered from 0."""
    return np.unique(label, return_inverse=True)[1].astype(np.int64)


def unit(vectors: Float64) -> Float64:
    """Vectors of length 1, or zero."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, 1e-30), np.float64)


def sums(label: Int64, values: Float64, count: int) -> Float64:
    """(count, k) the sum of the (n, k) values of each label."""
    columns = [np.bincount(label, column, count) for column in values.T]
    return np.stack(columns, axis=1).astype(np.float64)


def _averaging(pairs: Int64, weights: Float64, count: int) -> sparse.csr_matrix:
    """(count, count) that takes the weighted mean over the faces that each face meets."""
    half = sparse.coo_matrix((weights, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    both = (half + half.T).tocsr()
    total = np.maximum(np.asarray(both.sum(1)).ravel(), 1e-30)
    return sparse.csr_matrix(sparse.diags(1 / total) @ both)


def _smoothed(tile: Topology) -> Float64:
    """(f, 3) normals averaged over the faces about, so that noise does not shatter charts."""
    count = len(tile.areas)
    itself = np.repeat(np.arange(count), 2).reshape(-1, 2)
    pairs = np.concatenate([tile.pairs, itself])
    weights = np.concatenate([np.ones(len(tile.pairs)), np.full(count, 0.5)])  # counted twice
    mixing = _averaging(pairs, weights, count)
    normals = tile.normals * tile.areas[:, None]
    for _ in range(_SMOOTHING_ROUNDS):
        normals = mixing @ normals
    return unit(normals)


def _axes(normals: Float64, areas: Float64) -> Float64:
    """Directions such that nearly all area looks within 40 degrees of one of them."""
    candidates = normals[:: max(len(normals) // 400, 1)]
    near: Float64 = (candidates @ normals.T > _AXIS_COS).astype(np.float64)
    left = areas.copy()
    chosen: list[int] = []
    while len(chosen) < _MAX_AXES and (not chosen or left.sum() > 0.01 * areas.sum()):
        best = int((near @ left).argmax())
        chosen.append(best)
        left[near[best] > 0] = 0
    axes = candidates[chosen]
    for _ in range(4):
        label = (normals @ axes.T).argmax(1).astype(np.int64)
        moved = unit(sums(label, normals * areas[:, None], len(axes)))
        axes = np.where(np.linalg.norm(moved, axis=1, keepdims=True) > 0.5, moved, axes)
    return axes


def _borders(tile: Topology, chart: Int64, count: int) -> list[dict[int, float]]:
    """For each chart its neighbours, and the length of the border that it shares with each."""
    one, two = chart[tile.pairs].T
    apart = one != two
    low, high = np.minimum(one, two)[apart], np.maximum(one, two)[apart]
    key, which = np.unique(low * count + high, return_inverse=True)
    length = np.bincount(which, tile.lengths[apart])
    found: list[dict[int, float]] = [{} for _ in range(count)]
    for a, b, metres in zip(*np.divmod(key, count), length, strict=True):
        found[a][int(b)] = found[b][int(a)] = float(metres)
    return found


def _halves(points: Float64) -> Bool:
    """(n,) which half of (n, 3) points, along the axis in which they reach furthest."""
    longest = np.ptp(points, axis=0).argmax()
    order = np.argsort(points[:, longest], kind="stable")
    half = np.zeros(len(points), bool)
    half[order[len(order) // 2 :]] = True
    return half
