"""Stations: find where the scanner stood, from the blind discs under its tripod.

No scanner looks straight down. Around each tripod the floor is bare, or holds only what other
stations saw, and right outside that disc it is denser than anywhere else. So the discs are rings
in a density map of the floor: the strongest answers of a ring-shaped filter, dense outside and
sparse inside, over the radii that tripods make. Each level is looked at for itself: a tripod that
looks down on a dais leaves its disc there and none in the floor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from tourgen.geometry import Float32, Float64
from tourgen.threads import each

VERSION = 5
_SECTORS = 8
_BIN_M = 0.02
_LEVEL_SHARE = 0.2
"""Of the points of the fullest height; the floor of the demo's rooms holds 0.4 of the ceiling's."""
_MOST_POINTS = 16_000_000
"""Of more every so manieth is looked at: they tell a disc as well."""
_FAR_SHARE, _FAR_M = 0.01, 2.0
"""What lies so far beyond all but so small a share of a level's points is no floor of the room: the
ground outside, seen through a door, of which a map would take all memory."""
_ABOVE_SHARE = 0.1
"""Of all points: a ceiling has next to none above it."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What a tripod looks like.

    Attributes:
        blind_angle_deg: Half opening of the cone under the scanner that it does not see.
        radius_m: Smallest and largest radius of a blind disc.
        cell_m: Edge of a cell of the floor's density map.
        contrast: Least step of log density at the disc's edge (e times denser is 1), over the
            step at the smallest and the largest radius. In three rooms discs gave 0.7 to 3.1,
            all else less than 0.5.
        most: Most stations looked for.
        clearance_m: Nothing stands this near to a scanner. Round a newel, too, the floor is bare
            within a ring.
    """

    blind_angle_deg: float = 30.0
    radius_m: tuple[float, float] = (0.5, 1.15)
    cell_m: float = 0.04
    contrast: float = 0.65
    most: int = 12
    clearance_m: float = 0.25


def find_stations(points: Float32, settings: Settings) -> Float64:
    """Where the scanner stood.

    Args:
        points: (n, 3), metres, z up, unthinned: density is the evidence.
        settings: See ``Settings``.

    Returns:
        (s, 3) metres, strongest evidence first; s is 0 where no disc stands out.
    """
    points = points[:: max(1, -(-len(points) // _MOST_POINTS))]
    discs = [disc for level_z in _levels_z(points) for disc in _discs(points, level_z, settings)]
    found: list[Float64] = []
    for disc in sorted(discs, key=lambda disc: -disc.contrast):
        apart_m = [float(np.linalg.norm(disc.station - other)) for other in found]
        if min(apart_m, default=np.inf) > disc.radius_m and _is_clear(points, disc, settings):
            found.append(disc.station)
    return np.array(found[: settings.most]).reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class _Disc:
    """A blind disc.

    Attributes:
        station: (3,) metres, where the scanner stood above it.
        radius_m: Of the disc.
        contrast: Step of log density at its edge.
    """

    station: Float64
    radius_m: float
    contrast: float


def _levels_z(points: Float32) -> list[float]:
    """Heights of the levels that hold a good share of the points: the lowest, and all above it that
    are no ceiling.

    A tripod may stand on a dais or a landing, or over a table's edge: its disc then lies there, and
    the floor that most points lie on has none.
    """
    bins = np.arange(points[:, 2].min(), points[:, 2].max() + 2 * _BIN_M, _BIN_M)
    count, edges = np.histogram(points[:, 2], bins)
    around = np.pad(count, 1)
    peak = (count >= around[:-2]) & (count > around[2:]) & (count > _LEVEL_SHARE * count.max())
    above = 1 - np.cumsum(count) / len(points)
    peak &= (above > _ABOVE_SHARE) | (np.cumsum(peak) == 1)
    middles = edges[:-1][peak] + _BIN_M / 2
    return [float(np.median(_slab(points, z, 2 * _BIN_M)[:, 2])) for z in middles]


def _slab(points: Float32, height: float, half_m: float) -> Float32:
    """The points that near to a height."""
    near: Float32 = points[np.abs(points[:, 2] - height) < half_m]
    return near


def _discs(points: Float32, level_z: float, settings: Settings) -> Iterator[_Disc]:
    """Blind discs in one level, the clearest first."""
    level = _slab(points, level_z, 0.03)[:, :2].astype(np.float64)
    if len(level) < 1000:
        return
    level = _without_far(level)
    low = level.min(axis=0)
    cell = np.floor((level - low) / settings.cell_m).astype(int)
    shape = cell.max(axis=0) + 1
    count = np.bincount(cell[:, 0] * shape[1] + cell[:, 1], minlength=shape.prod())
    density = np.log1p(gaussian_filter(count.reshape(shape).astype(float), 1.0))
    radii = np.arange(*settings.radius_m, settings.cell_m)
    score = np.stack(each(lambda radius: _ring_response(density, radius / settings.cell_m), radii))
    # A table's leg answers the smallest radii, a wall the largest ones.
    score -= np.maximum(np.maximum(score[0], score[-1]), 0)
    x, y = np.ogrid[: shape[0], : shape[1]]
    for _ in range(settings.most):
        best = np.unravel_index(np.argmax(score), score.shape)
        if score[best] < settings.contrast:
            return
        radius = float(radii[best[0]])
        centre = low + (np.array(best[1:]) + 0.5) * settings.cell_m
        height = radius / np.tan(np.radians(settings.blind_angle_deg))
        yield _Disc(np.array([*centre, level_z + height]), radius, float(score[best]))
        near = np.hypot(x - best[1], y - best[2]) < 0.7 * radius / settings.cell_m
        score[:, near] = -np.inf


def _without_far(level: Float64) -> Float64:
    low, high = np.quantile(level, [_FAR_SHARE, 1 - _FAR_SHARE], axis=0)
    near: Float64 = level[((level > low - _FAR_M) & (level < high + _FAR_M)).all(axis=1)]
    return near


def _is_clear(points: Float32, disc: _Disc, settings: Settings) -> bool:
    """Whether nothing stands where the scanner did."""
    away2 = np.square(points - disc.station.astype(np.float32)).sum(axis=1)
    return bool(away2.min() > settings.clearance_m**2)


def _ring_response(density: Float64, radius: float) -> Float64:
    """Step of log density across a circle about every cell.

    The circle is cut into sectors and a quarter of them may be worse than the answer: furniture
    hides a part of many a disc, and a ring that is there only in part is the flank of another.
    """
    from scipy.signal import fftconvolve  # takes a second to load

    reach = int(np.ceil(radius * 1.3)) + 1
    x, y = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    r, sector = np.hypot(x, y), ((np.arctan2(y, x) + np.pi) / (2 * np.pi) * _SECTORS).astype(int)
    steps = []
    for k in range(_SECTORS):
        outside = (r > radius * 1.05) & (r < radius * 1.3) & (sector == k)
        inside = (r > radius * 0.65) & (r < radius * 0.95) & (sector == k)
        kernel = outside / outside.sum() - inside / inside.sum()
        steps.append(fftconvolve(density, kernel[::-1, ::-1], mode="same"))
    return np.asarray(np.partition(steps, _SECTORS // 4, axis=0)[_SECTORS // 4])
