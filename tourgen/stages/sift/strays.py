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
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Int32
from tourgen.stages.mesh_arrays import components

Mask = npt.NDArray[np.bool_]
_BLOCK = 500_000


def isolated(points: Float32, neighbours: int, ratio: float) -> Mask:
    """Mask of the (n, 3) points that are ``ratio`` times as far from theirs as these from others.

    Places with more than ``neighbours`` points in one spot count as dense, not as strays.
    """
    tree, nearest = cKDTree(points), np.arange(2, neighbours + 2)  # the first is the point itself
    nearest = nearest[nearest <= len(points)]
    if not len(nearest):
        return np.zeros(len(points), np.bool_)
    own = np.empty(len(points), np.float32)
    for start in range(0, len(points), _BLOCK):
        part = slice(start, start + _BLOCK)
        distance, _ = tree.query(points[part], k=nearest, workers=-1)
        own[part] = np.asarray(distance).mean(axis=1)
    # Only what is farther from its neighbours than most points can be a stray.
    suspect = np.flatnonzero(own > ratio * max(float(np.quantile(own, 0.1)), 1e-4))
    found = np.zeros(len(points), np.bool_)
    for start in range(0, len(suspect), _BLOCK):
        at = suspect[start : start + _BLOCK]
        _, index = tree.query(points[at], k=nearest, workers=-1)
        found[at] = own[at] > ratio * np.maximum(np.median(own[index], axis=1), 1e-4)
    return found


def clusters(points: Float32, gap_m: float) -> Int32:
    """(n,) number of the cluster that each point lies in, ``gap_m`` apart, the largest first."""
    cells, inverse, counts = _occupied(points, gap_m)
    pairs = cKDTree(cells).query_pairs(1.8, output_type="ndarray")
    cluster = components(pairs, len(cells))
    size = np.bincount(cluster, weights=counts)
    rank = np.empty(len(size), np.int32)
    rank[np.argsort(-size, kind="stable")] = np.arange(len(size))
    return np.asarray(rank[cluster][inverse])


def islands(points: Float32, gap_m: float, share: float) -> Mask:
    """Mask of the (n, 3) points in clusters of less than ``share`` of all, ``gap_m`` apart."""
    cluster = clusters(points, gap_m)
    return np.asarray((np.bincount(cluster) < share * len(points))[cluster])


def _occupied(
    points: Float32, edge_m: float
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Cells of a grid that hold points, the cell of each point, and how many each holds."""
    low = points.min(axis=0)
    cell = np.floor((points - low) / edge_m).astype(np.int64)
    _, rows, columns = shape = cell.max(axis=0) + 1
    key, inverse, counts = np.unique(
        (cell[:, 0] * rows + cell[:, 1]) * columns + cell[:, 2],
        return_inverse=True,
        return_counts=True,
    )
    return np.stack(np.unravel_index(key, shape), axis=1), inverse.reshape(-1), counts
