"""Repeats: points at the very place of another one, which tell nothing that the other does not.

Exporters write them: a scan merged twice, a point for every try of a scanner that met nothing. A
thousand at one place make a direction in which the scanner seems to have measured a thousand
times, and leave their neighbours no spacing.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, PointCloud

_ODD = (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9)
"""Factors that spread coordinates over 64 bits."""


def without_repeats(cloud: PointCloud) -> PointCloud:
    """The first point at each place, in their order; 24 bytes a point at work.

    Args:
        cloud: n points.

    Returns:
        The same object where no place repeats.
    """
    key = _keys(cloud.points)
    ordered = np.sort(key)
    if not (ordered[1:] == ordered[:-1]).any():
        return cloud
    order = np.argsort(key, kind="stable")
    alike = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    before, after = order[alike], order[alike + 1]
    again = (cloud.points[before] == cloud.points[after]).all(axis=1)
    keep = np.ones(len(cloud), np.bool_)
    keep[after[again]] = False
    return cloud.take(keep)


def _keys(points: Float32) -> npt.NDArray[np.uint64]:
    """(n,) the same for the same place, and hardly ever for another."""
    key = np.zeros(len(points), np.uint64)
    for axis, factor in enumerate(_ODD):
        column = points[:, axis] + np.float32(0)  # which turns -0 into 0
        key += column.view(np.uint32).astype(np.uint64) * np.uint64(factor)
    return key
