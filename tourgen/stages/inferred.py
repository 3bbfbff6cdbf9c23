"""Inferred: which vertices no measurement stands behind.

What closes a gap of the scan (the disc under a tripod, what furniture hides) is a guess, and those
who look at the tour, or cite it, shall be able to tell. Each vertex of a tile says so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, PointCloud, UInt8

VERSION = 1
INFERRED = 255
"""Of a vertex that is a guess; 0 of one that is not."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What counts as inferred.

    Attributes:
        support_m: A vertex farther than this from every point is.
    """

    support_m: float


def inferred(
    vertices: tuple[Float32, ...], cloud: PointCloud, settings: Settings
) -> tuple[UInt8, ...]:
    """Tell of each mesh's vertices whether they are inferred.

    Args:
        vertices: (v, 3) of each mesh, metres from the cloud's origin.
        cloud: The cleaned points, unthinned.
        settings: See ``Settings``.

    Returns:
        (v,) for each mesh, 0 or ``INFERRED``.
    """
    tree = cKDTree(cloud.points)

    def told(places: Float32) -> UInt8:
        distance, _ = tree.query(places, distance_upper_bound=settings.support_m, workers=-1)
        return np.where(np.isinf(distance), INFERRED, 0).astype(np.uint8)

    return tuple(told(places) for places in vertices)
