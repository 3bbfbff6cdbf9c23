"""Thin: one point a voxel, the mean of those in it.

A scanner samples what is near a hundred times as densely as what is far. Normals and the solve
want even density; the mean of a voxel also averages the range noise away. Colours for the
texture are baked from the full cloud instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tourgen.geometry import PointCloud
from tourgen.voxels import voxel_groups

VERSION = 2


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
    count = np.diff(np.append(starts, len(order)))[:, None]
    points = np.add.reduceat(cloud.points[order], starts, axis=0, dtype=np.float64) / count
    colors = np.add.reduceat(cloud.colors[order], starts, axis=0, dtype=np.float32) / count
    return PointCloud(
        cloud.origin,
        points.astype(np.float32),
        np.rint(colors).astype(np.uint8),
        cloud.station[order[starts]],
    )
