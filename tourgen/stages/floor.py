"""Floor: lay points where a scanner's own tripod stood.

No scanner sees the floor under itself. Left bare, the disc joins the shadows around it, and the
solve spans them with a hump that one stumbles over. But a tripod stood there: the floor around
goes on beneath it. Where the ring about the disc is level, the disc is laid out with points of
the plane through it; where it is not, as on a stair, nothing is done.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64, OrientedCloud, PointCloud

VERSION = 2
LAID = -2
"""The station of points that nobody measured."""
_SECTORS = 16
_MIN_UPRIGHT = 0.9
_STANDING_M = 0.5


@dataclass(frozen=True, slots=True)
class Settings:
    """What is a floor.

    Attributes:
        spacing_m: Distance between the points laid.
        lowest_deg: Lower edge of a scanner's field of view.
        ring: Outer radius of the ring that must be level, over that of the disc.
        level_m: How far parts of the ring may lie from its middle height.
        level_share: Share of the ring that must be so.
    """

    spacing_m: float
    lowest_deg: float = -58.0
    ring: float = 1.5
    level_m: float = 0.03
    level_share: float = 0.4


def floor(oriented: OrientedCloud, settings: Settings) -> OrientedCloud:
    """Lay out the blind discs.

    Args:
        oriented: n points with normals and stations.
        settings: See ``Settings``.

    Returns:
        The same points, then those laid, grey: their colours are found when the rest has its own.
    """
    points = oriented.cloud.points
    upright = points[oriented.normals[:, 2] > _MIN_UPRIGHT]
    around = cKDTree(points[:, :2])
    laid = [
        _without_occupied(disc, points, around, settings.spacing_m)
        for station in oriented.stations
        if (disc := _disc(upright, station, settings)) is not None
    ]
    new = np.concatenate([np.empty((0, 3), np.float32), *laid])
    grey = np.full(new.shape, 128, np.uint8)
    unseen = PointCloud(oriented.cloud.origin, new, grey, np.full(len(new), LAID, np.int16))
    cloud = oriented.cloud.joined(unseen)
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), new.shape)
    return OrientedCloud(cloud, np.concatenate([oriented.normals, up]), oriented.stations)


def _disc(upright: Float32, station: Float64, settings: Settings) -> Float32 | None:
    """(m, 3) points of the floor under a station, or None where there is no level ring."""
    offset = upright - station.astype(np.float32)
    radius = np.hypot(offset[:, 0], offset[:, 1])
    steep = np.tan(np.radians(-settings.lowest_deg))
    below = -offset[:, 2]
    in_ring = (below > steep / settings.ring * radius) & (below < 1.1 * steep * radius)
    ring, azimuth = offset[in_ring], np.arctan2(offset[in_ring, 1], offset[in_ring, 0])
    height = _lowest_by_sector(ring[:, 2], azimuth)
    if not np.isfinite(height).any():
        return None
    middle = np.median(height[np.isfinite(height)])
    if (np.abs(height - middle) < settings.level_m).mean() < settings.level_share:
        return None
    level = ring[np.abs(ring[:, 2] - middle) < settings.level_m].astype(np.float64)
    plane, *_ = np.linalg.lstsq(
        np.column_stack([level[:, :2], np.ones(len(level))]), level[:, 2], rcond=None
    )
    reach_m = -middle / steep
    steps = np.arange(-reach_m, reach_m, settings.spacing_m)
    x, y = np.meshgrid(steps, steps)
    inside = np.hypot(x, y) < reach_m
    x, y = x[inside], y[inside]
    z = plane[0] * x + plane[1] * y + plane[2]
    return np.asarray(station + np.column_stack([x, y, z]), np.float32)


def _lowest_by_sector(height: Float32, azimuth: Float32) -> npt.NDArray[np.float32]:
    """Lowest height in each sector, but for a few strays; NaN where there is none."""
    sector = ((azimuth + np.pi) / (2 * np.pi) * _SECTORS).astype(int) % _SECTORS
    found = np.full(_SECTORS, np.nan, np.float32)
    for each in np.unique(sector):
        found[each] = np.quantile(height[sector == each], 0.1)
    return found


def _without_occupied(disc: Float32, points: Float32, around: cKDTree, spacing_m: float) -> Float32:
    """Those where the scan has no point, neither there nor right above."""
    pairs = cKDTree(disc[:, :2]).sparse_distance_matrix(
        around, 1.5 * spacing_m, output_type="ndarray"
    )
    above = points[pairs["j"], 2] - disc[pairs["i"], 2]
    taken = pairs["i"][(above > -2 * spacing_m) & (above < _STANDING_M)]
    free = np.bincount(taken, minlength=len(disc)) == 0
    return np.asarray(disc[free])
