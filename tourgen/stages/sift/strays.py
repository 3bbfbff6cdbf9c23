"""Strays: points and clusters apart from all else, by statistics alone.

Two filters, each relative to the surroundings, since the density of a scan falls with the square
of the distance:

- *Isolation*: a point whose mean distance to its neighbours is far above that of the neighbours
  themselves hangs in the air (a simplified local outlier factor, Breunig et al. 2000). A global
  statistical filter was rejected: it eats the far wall before it finds a stray near the tripod.
- *Islands*: clusters that hold a negligible share of the points, far from all else, are what the
  scanner saw through a window.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull, QhullError, cKDTree

from tourgen.geometry import Float32, Int32
from tourgen.neighbours import Neighbours
from tourgen.stages.mesh_arrays import components
from tourgen.voxels import grouped, voxels

Mask = npt.NDArray[np.bool_]
_SPOT_M = 1e-4
_CRUMB = 60
"""Fewest points that are a thing of their own."""


def isolated(points: Float32, suspect: Mask, neighbours: int, ratio: float) -> Mask:
    """Mask of the (n, 3) points that are ``ratio`` times as far from theirs as these from others.

    Only those of the (n,) ``suspect`` are asked. Places with more than ``neighbours`` points in
    one spot count as dense, not as strays.
    """
    found = np.zeros(len(points), np.bool_)
    asked = np.flatnonzero(suspect)
    count = min(neighbours, len(points) - 1)
    if not len(asked) or count < 1:
        return found
    cloud = Neighbours.of(points, count)
    own, near = _around(cloud, points[asked], count)
    # Only what is farther from its neighbours than most points can be a stray.
    far = own > ratio * max(float(np.quantile(own, 0.1)), _SPOT_M)
    asked, own, near = asked[far], own[far], near[far]
    others, inverse = np.unique(near, return_inverse=True)
    theirs = _around(cloud, points[others], count)[0][inverse].reshape(near.shape)
    found[asked] = own > ratio * np.maximum(np.median(theirs, axis=1), _SPOT_M)
    return found


def _around(cloud: Neighbours, places: Float32, count: int) -> tuple[Float32, Int32]:
    """Mean distance of some points to their neighbours, and which these are."""
    near, away_m = cloud.nearest(places, count + 1)
    return away_m[:, 1:].mean(axis=1), near[:, 1:]  # the first is the point itself


def clusters(points: Float32, gap_m: float, least_share: float = 0.0) -> Int32:
    """(n,) number of the cluster that each point lies in, ``gap_m`` apart, the largest first.

    Cells of that edge with less than ``least_share`` of the points that there are about most
    points join nothing: what lies in them has the number -1.
    """
    cells, inverse, counts = _occupied(points, gap_m)
    full = counts >= least_share * _about_most(counts)
    pairs = cKDTree(cells[full]).query_pairs(1.8, output_type="ndarray")
    cluster = components(pairs, int(full.sum()))
    size = np.bincount(cluster, weights=counts[full])
    rank = np.empty(len(size), np.int32)
    rank[np.argsort(-size, kind="stable")] = np.arange(len(size))
    number = np.full(len(cells), -1, np.int32)
    number[full] = rank[cluster]
    return np.asarray(number[inverse])


def _about_most(counts: npt.NDArray[np.int64]) -> int:
    """Median over all points of how many their cell holds; 0 of none."""
    ordered = np.sort(counts)
    return (
        int(ordered[np.searchsorted(np.cumsum(ordered), ordered.sum() / 2)]) if len(ordered) else 0
    )


def islands(points: Float32, gap_m: float, share: float) -> Mask:
    """Mask of the (n, 3) points in clusters of less than ``share`` of all, ``gap_m`` apart.

    Of those that the room surrounds only crumbs: a lamp may hang on a wire that no beam meets.
    """
    cluster = clusters(points, gap_m)
    size = np.bincount(cluster)
    small = size < share * len(points)
    few = np.flatnonzero(small[cluster])
    if not len(few):
        return np.zeros(len(points), np.bool_)
    outside = ~_within(points[few], points[cluster == 0], gap_m)
    beyond = np.bincount(cluster[few], outside, minlength=len(size)) > 0
    return np.asarray((small & (beyond | (size < _CRUMB)))[cluster])


def _within(points: Float32, room: Float32, edge_m: float) -> Mask:
    """Mask of the (n, 3) points that a room surrounds: within its convex hull."""
    low = room.min(axis=0)
    cells, _, _ = _occupied(room, edge_m)
    try:
        outline = ConvexHull((cells + 0.5) * edge_m).equations
    except (QhullError, ValueError):
        return np.zeros(len(points), np.bool_)
    return np.asarray(((points - low) @ outline[:, :3].T + outline[:, 3] < 0).all(axis=1))


def _occupied(
    points: Float32, edge_m: float
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Cells of a grid that hold points, the cell of each point, and how many each holds."""
    number, shape = voxels(points, edge_m)
    order, starts = grouped(number)
    counts = np.diff(starts, append=len(order))
    inverse = np.empty(len(order), np.int64)
    inverse[order] = np.repeat(np.arange(len(starts)), counts)
    return np.stack(np.unravel_index(number[order[starts]], shape), axis=1), inverse, counts
