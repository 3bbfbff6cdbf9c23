"""Spacing: how far apart the points of a scan lie, which all other lengths follow from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tourgen.geometry import Float32, PointCloud
from tourgen.neighbours import Neighbours
from tourgen.voxels import voxel_groups

VERSION = 2
_SAMPLE = 20_000
FOURTH = 5
"""A point and its four nearest neighbours."""


@dataclass(frozen=True, slots=True)
class Spacing:
    """Distance between neighbouring points on the surface.

    Attributes:
        fine_m: In the denser parts (first quartile over space).
        median_m: In the middle.
    """

    fine_m: float
    median_m: float


def spacing(cloud: PointCloud) -> Spacing:
    """Measure a cloud.

    Each occupied 10 cm voxel counts once, so that the dense floor by the tripod does not speak
    for the room.
    """
    order, starts = voxel_groups(cloud.points, 0.1)
    rng = np.random.default_rng(0)
    chosen = order[rng.choice(starts, min(_SAMPLE, len(starts)), replace=False)]
    local = spacing_at(Neighbours.of(cloud.points, FOURTH), cloud.points[chosen])
    fine, median = np.quantile(local, [0.25, 0.5])
    return Spacing(float(fine), float(median))


def spacing_at(around: Neighbours, points: Float32) -> Float32:
    """Spacing around each of (n, 3) points of a cloud, metres.

    From the distance r to the fourth neighbour: a disc of radius r holds four points, so a
    point has the area pi r² / 4.
    """
    _, away_m = around.nearest(points, FOURTH)
    return away_m[:, -1] * np.float32(np.sqrt(np.pi / 4))
