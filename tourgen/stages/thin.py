"""Thin: one point a voxel, the mean of those in it.

A scanner samples what is near a hundred times as densely as what is far. Normals and the solve
want even density; the mean of a voxel also averages the range noise away. Colours for the
texture are baked from the full cloud instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.geometry import Float32, PointCloud
from tourgen.sorting import order_of

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


def voxel_groups(
    points: Float32, voxel_m: float
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Sort points by voxel.

    Returns:
        ``order`` (n,), positions sorted by voxel, and ``starts`` (v,), where each voxel begins.
    """
    low = points.min(axis=0)
    key = _cells(points, low, np.float32(voxel_m), points.max(axis=0))
    order = order_of(key)
    return order, _starts(key, order)


@compiled
def _cells(
    points: Float32, low: Float32, voxel_m: np.float32, high: Float32
) -> npt.NDArray[np.int64]:
    """(n,) number of each point's voxel, by x, then y, then z."""
    columns = np.int64((high[1] - low[1]) / voxel_m) + 1
    layers = np.int64((high[2] - low[2]) / voxel_m) + 1
    key = np.empty(len(points), np.int64)
    for i in range(len(points)):
        x = np.int64((points[i, 0] - low[0]) / voxel_m)
        y = np.int64((points[i, 1] - low[1]) / voxel_m)
        z = np.int64((points[i, 2] - low[2]) / voxel_m)
        key[i] = (x * columns + y) * layers + z
    return key


@compiled
def _starts(key: npt.NDArray[np.int64], order: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Where in the order a voxel begins."""
    found = np.empty(len(order), np.int64)
    count = 0
    for i in range(len(order)):
        if i == 0 or key[order[i]] != key[order[i - 1]]:
            found[count] = i
            count += 1
    return found[:count].copy()
