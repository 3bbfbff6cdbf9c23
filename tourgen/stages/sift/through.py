"""Through: places that one station measured and another looked through.

Whoever walks past stands in one station's view only, and the others measured what lies behind.
A place is looked through where every beam of a station near its direction (3 by 3 cells, each
little wider than the angle between beams) went farther by a margin. Slanted surfaces stop some of
these beams earlier, and so they stay. So do rods, even such as fit between two beams: what was
looked through must be wider than that, or a point without company.

Where another station could not see that part of a person (a foot against the floor, a leg behind
the table), it goes with the rest: points in the midst of such ones go too, unless a second
station measured the same place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation, binary_opening, minimum_filter, uniform_filter
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, PointCloud
from tourgen.stages.mesh_arrays import components
from tourgen.stages.sift.strays import clusters
from tourgen.stages.sift.views import View
from tourgen.stages.sight import DepthBuffer, depth_buffer

Mask = npt.NDArray[np.bool_]
_CELL_STEPS = 1.25
_FINEST_RAD = 1e-3
"""Beams nearer to each other share cells: finer ones, of a station far away, fill the memory."""
_LEAST_BEAMS = 5
_SAMPLE = 20_000
_ROUNDS = 4
_GROW_M = 0.05
_GROW_NEIGHBOURS = 10
_SAME_PLACE_M = 0.015
_ENCLAVE_M = 0.2
_BODY_POINTS = 200
_LINK_SPACINGS = 1.7
_SQUARE = np.ones((3, 3), np.bool_)
_LINE_POINTS = 3
_LINE_SPACINGS = 2.5


def passed(cloud: PointCloud, seen: Sequence[View], margin_m: float) -> Mask:
    """Mask of the points that a station other than their own looked through."""
    wide, narrow = np.zeros(len(cloud), np.bool_), np.zeros(len(cloud), np.bool_)
    for number, view in enumerate(seen):
        if len(view) <= _LEAST_BEAMS:
            continue
        nearest, beams = _reach(view, cloud.points[view.index])
        for other, theirs in enumerate(seen):
            if other == number:
                continue
            cell, distance, _ = nearest.cells(cloud.points[theirs.index])
            through = distance + margin_m < nearest.range_m.reshape(-1)[cell]
            through &= beams.reshape(-1)[cell] >= _LEAST_BEAMS
            at, cell = theirs.index[through], cell[through]
            filled = np.zeros(nearest.range_m.shape, np.bool_)
            filled.reshape(-1)[cell] = True
            core = binary_opening(filled, _SQUARE)
            broad = binary_dilation(core, _SQUARE, iterations=2).reshape(-1)[cell]
            wide[at[broad]] = True
            narrow[at[~broad]] = True
    narrow &= ~wide
    for view in seen:
        thin = np.flatnonzero(narrow[view.index])
        narrow[view.index[thin[_in_line(view, thin, cloud.points)]]] = False
    return wide | narrow


def _in_line(view: View, at: npt.NDArray[np.int64], points: Float32) -> Mask:
    """Which of the points ``at`` of a view have several others of them close by, as a rod has."""
    if len(at) <= _LINE_POINTS:
        return np.zeros(len(at), np.bool_)
    own = points[view.index[at]]
    distance = np.asarray(cKDTree(own).query(own, k=[_LINE_POINTS + 1])[0])
    spacing_m = _step(view) * view.range_m[at]
    return np.asarray(np.asarray(distance)[:, 0] < _LINE_SPACINGS * spacing_m)


def _reach(view: View, points: Float32) -> tuple[DepthBuffer, Float32]:
    """Least range within the 3 by 3 cells about each, and how many points these hold."""
    buffer = depth_buffer(points, view.station, _CELL_STEPS * float(np.degrees(_step(view))))
    cell, _, _ = buffer.cells(points)
    beams = np.bincount(cell, minlength=buffer.range_m.size).reshape(buffer.range_m.shape)
    around = uniform_filter(beams.astype(np.float32), 3, mode=("nearest", "wrap"))
    nearest = minimum_filter(buffer.range_m, 3, mode=("nearest", "wrap"))
    return DepthBuffer(view.station, buffer.cell_deg, nearest), np.rint(9 * around)


def _step(view: View) -> float:
    """Angle between neighbouring beams, radians."""
    rng = np.random.default_rng(0)
    sample = rng.choice(len(view), min(_SAMPLE, len(view)), replace=False)
    distance, _ = view.tree.query(view.direction[sample], k=[2, 3, 4, 5], workers=-1)
    return max(float(np.median(distance)), _FINEST_RAD)


def grown(cloud: PointCloud, gone: Mask) -> Mask:
    """``gone``, and the points in the midst of such ones that no second station confirms."""
    gone = gone.copy()
    for _ in range(_ROUNDS):
        if not gone.any():
            break
        rest = np.flatnonzero(~gone)
        distance, _ = cKDTree(cloud.points[gone]).query(
            cloud.points[rest], distance_upper_bound=_GROW_M, workers=-1
        )
        edge = rest[np.isfinite(distance)]
        edge = edge[~confirmed(cloud, edge, ~gone, _SAME_PLACE_M)]
        edge = edge[_amid(cloud, edge, gone)]
        if not len(edge):
            break
        gone[edge] = True
    gone[_enclaves(cloud, gone)] = True
    return gone


def _enclaves(cloud: PointCloud, gone: Mask) -> npt.NDArray[np.int64]:
    """Small pieces that only one station measured, next to a body that is gone, and nowhere far
    from it: a shoe that all others have in shadow."""
    body = cloud.points[gone]
    if len(body):
        number = clusters(body, _GROW_M)
        body = body[(np.bincount(number) >= _BODY_POINTS)[number]]
    if not len(body):
        return np.empty(0, np.int64)
    rest = np.flatnonzero(~gone)
    distance, _ = cKDTree(body).query(
        cloud.points[rest], distance_upper_bound=_ENCLAVE_M + _GROW_M, workers=-1
    )
    near = np.isfinite(distance)
    rest, distance = rest[near], np.asarray(distance)[near]
    alone = ~confirmed(cloud, rest, ~gone, _SAME_PLACE_M)
    rest, distance = rest[alone], distance[alone]
    if len(rest) < 2:
        return np.empty(0, np.int64)
    tree = cKDTree(cloud.points[rest])
    distance_m = np.asarray(tree.query(cloud.points[rest], k=[2])[0])
    pairs = tree.query_pairs(_LINK_SPACINGS * float(np.median(distance_m)), output_type="ndarray")
    piece = components(pairs, len(rest))
    farthest, nearest = np.zeros(len(rest)), np.full(len(rest), np.inf)
    np.maximum.at(farthest, piece, distance)
    np.minimum.at(nearest, piece, distance)
    return rest[((farthest < _ENCLAVE_M) & (nearest < _GROW_M))[piece]]


def _amid(cloud: PointCloud, edge: npt.NDArray[np.int64], gone: Mask) -> Mask:
    """Which of the points ``edge`` have gone ones for half their neighbours or more."""
    if not len(edge):
        return np.zeros(0, np.bool_)
    tree = cKDTree(cloud.points[edge])
    distance, _ = tree.query(cloud.points, distance_upper_bound=2 * _GROW_M, workers=-1)
    around = np.flatnonzero(np.isfinite(distance))
    far = 2 * _GROW_M
    distance, near = cKDTree(cloud.points[around]).query(
        cloud.points[edge], k=np.arange(2, _GROW_NEIGHBOURS + 2), distance_upper_bound=far
    )
    known = np.isfinite(distance)
    at = around[np.where(known, near, 0)]
    known &= cloud.station[at] == cloud.station[edge][:, None]
    return np.asarray(2 * (gone[at] & known).sum(axis=1) >= np.maximum(known.sum(axis=1), 1))


def confirmed(cloud: PointCloud, at: npt.NDArray[np.int64], by: Mask, radius_m: float) -> Mask:
    """Which of the points ``at`` have one of ``by`` from another station within a radius."""
    found = np.zeros(len(at), np.bool_)
    if not len(at):
        return found
    witness = np.flatnonzero(by)
    distance, _ = cKDTree(cloud.points[at]).query(
        cloud.points[witness], distance_upper_bound=2 * radius_m, workers=-1
    )
    witness = witness[np.isfinite(distance)]
    for station in np.unique(cloud.station[witness]):
        own = witness[cloud.station[witness] == station]
        others = np.flatnonzero(cloud.station[at] != station)
        distance, _ = cKDTree(cloud.points[own]).query(
            cloud.points[at[others]], distance_upper_bound=radius_m, workers=-1
        )
        found[others] |= np.isfinite(distance)
    return found
