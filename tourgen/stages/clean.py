"""Clean: drop strays and mixed pixels, then even out the density.

Two filters, each relative to the surroundings, since the density of a scan falls with the square
of the distance:

- *Isolation*: a point whose mean distance to its neighbours is far above that of the neighbours
  themselves hangs in the air (a simplified local outlier factor, Breunig et al. 2000). A global
  statistical filter was rejected: it eats the far wall before it finds a stray near the tripod.
- *Islands*: clusters that hold a negligible share of the points, far from all else, are what the
  scanner saw through a window.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.errors import InputError
from tourgen.geometry import Float32, PointCloud
from tourgen.stages.mesh_arrays import components

VERSION = 1


@dataclass(frozen=True, slots=True)
class Settings:
    """How strict to be.

    Attributes:
        min_points: Fewest points that make a room.
        neighbours: Points that make a neighbourhood.
        isolation_ratio: A point is a stray when its mean distance to its neighbours exceeds
            theirs by this factor.
        island_gap_m: Clusters farther apart than this are separate.
        island_share: A cluster with less than this share of the points is an island.
    """

    min_points: int = 10_000
    neighbours: int = 8
    isolation_ratio: float = 2.5
    island_gap_m: float = 0.15
    island_share: float = 0.002


def clean(cloud: PointCloud, settings: Settings) -> PointCloud:
    """Return the points that belong to the room.

    Args:
        cloud: n points, already cropped.
        settings: See ``Settings``.

    Returns:
        The kept points in their order.

    Raises:
        InputError: Fewer than ``min_points`` points, before or after.
    """
    _require(len(cloud), settings.min_points, "")
    kept = cloud.take(~_islands(cloud.points, settings))
    kept = kept.take(~_isolated(kept.points, settings))
    _require(len(kept), settings.min_points, " after cleaning")
    return kept


def _require(found: int, needed: int, when: str) -> None:
    if found < needed:
        raise InputError(
            f"expected at least {needed} points{when}, found {found}",
            "check the export and the keep box, or lower `clean.min_points`",
        )


def _isolated(points: Float32, settings: Settings) -> npt.NDArray[np.bool_]:
    nearest = np.arange(2, settings.neighbours + 2)  # the first is the point itself
    distance, index = cKDTree(points).query(points, k=nearest, workers=-1)
    own = np.asarray(distance, np.float32).mean(axis=1)
    around = np.median(own[index], axis=1)
    return np.asarray(own > settings.isolation_ratio * np.maximum(around, 1e-4))


def _islands(points: Float32, settings: Settings) -> npt.NDArray[np.bool_]:
    """Mask of the points in clusters that are small and apart."""
    cell = np.floor(points / settings.island_gap_m).astype(np.int32)
    cells, inverse, counts = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    pairs = cKDTree(cells).query_pairs(1.8, output_type="ndarray")
    cluster = components(pairs, len(cells))
    size = np.bincount(cluster, weights=counts)
    return np.asarray((size < settings.island_share * len(points))[cluster][inverse.reshape(-1)])
