"""Through: places that one station measured and another looked through.

Whoever walks past stands in one station's view only, and the others measured what lies behind.
A place is looked through where every beam of a station near its direction (3 by 3 cells, each
little wider than the angle between beams) went farther by a margin. Thin objects stop one of
these beams at least, slanted surfaces some of them earlier, and so they stay.

Where another station could not see that part of a person (a foot against the floor, a leg behind
the table), it goes with the rest: points in the midst of such ones go too, unless a second
station measured the same place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.ndimage import minimum_filter, uniform_filter
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, PointCloud
from tourgen.stages.sift.views import View
from tourgen.stages.sight import DepthBuffer, depth_buffer

Mask = npt.NDArray[np.bool_]
_CELL_STEPS = 1.25
_LEAST_BEAMS = 5
_SAMPLE = 20_000
_ROUNDS = 4
_GROW_M = 0.05
_GROW_NEIGHBOURS = 10
_SAME_PLACE_M = 0.015


def passed(cloud: PointCloud, seen: Sequence[View], margin_m: float) -> Mask:
    """Mask of the points that a station other than their own looked through."""
    through = np.zeros(len(cloud), np.bool_)
    for number, view in enumerate(seen):
        if len(view) <= _LEAST_BEAMS:
            continue
        nearest, beams = _reach(view, cloud.points[view.index])
        for other, theirs in enumerate(seen):
            if other != number:
                cell, distance, _ = nearest.cells(cloud.points[theirs.index])
                far = distance + margin_m < nearest.range_m.reshape(-1)[cell]
                through[theirs.index] |= far & (beams.reshape(-1)[cell] >= _LEAST_BEAMS)
    return through


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
    return max(float(np.median(distance)), 1e-4)


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
    return gone


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
