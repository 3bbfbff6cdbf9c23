"""Thin: one point a voxel, the mean of those in it.

A scanner samples what is near a hundred times as densely as what is far. Normals and the solve
want even density; the mean of a voxel also averages the range noise away. Colours for the
texture are baked from the full cloud instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tourgen.geometry import PointCloud
from tourgen.voxels import means, voxel_groups

VERSION = 3


@dataclass(frozen=True, slots=True)
class Settings:
    """How fine.

    Attributes:
        voxel_m: Edge of a voxel.
    """

    voxel_m: float


def thin(cloud: PointCloud, settings: Settings) -> PointCloud:
    """Return at most one point a voxel.

    Args:
        cloud: n points.
        settings: See ``Settings``.

    Returns:
        Mean positions and colours; the station is that of one of the voxel's points.
    """
    order, starts = voxel_groups(cloud.points, settings.voxel_m)
    return PointCloud(
        cloud.origin,
        means(cloud.points, order, starts),
        np.rint(means(cloud.colors, order, starts)).astype(np.uint8),
        cloud.station[order[starts]],
    )
