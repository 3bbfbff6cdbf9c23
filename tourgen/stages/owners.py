"""Owners: tell which station measured each point of a merged scan.

A terrestrial scanner turns by equal steps about its vertical axis and about its mirror's. Seen
from exactly where it stood, the azimuths and elevations of its own points are whole multiples of
two angles, and those of all other points are not. So a merged cloud still tells who measured
what, for those who know the places of the stations to a few decimetres:

1. About the place given, in rings outwards, the azimuths of a sample are counted in fine bins. At
   the right place the Fourier transform of these counts has a line, at as many cycles a turn as
   the scanner has columns.
2. Up and down from there the same is done with the elevations.
3. Place and tilt are refined until both lines are as bright as can be (a simplex search): found so
   within a fraction of a millimetre.
4. Each point belongs to the station on whose grid it lies.

This needs scanner points as they were measured: averaged or resampled ones lie on no grid. Nothing
is claimed then.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from tourgen.geometry import Float32, Float64, PointCloud
from tourgen.stages.sight import depth_buffer

VERSION = 1
_BINS = 1 << 14
_LOWEST_CYCLES = 150
"""A turn has more columns than this; fewer cycles are the room's own shape."""
_SAMPLE = 8_000
_BLOCK = 500_000
_FEWEST = 1000
_NARROWEST_DEG = 60
_CLOSE = 0.03
_SHARP = 0.85
_TURN = 2 * np.pi


@dataclass(frozen=True, slots=True)
class Settings:
    """How far to look and what to believe.

    Attributes:
        search_m: How far a station's place may be off, sideways.
        search_height_m: The same, up and down.
        evidence: A grid is one on which so many times more points lie than would by chance.
        tolerance: Farthest from the grid, in steps, that a station's own points lie.
        share: Least share of all points that must lie on a grid; else nothing is claimed.
    """

    search_m: float = 0.2
    search_height_m: float = 0.3
    evidence: float = 8.0
    tolerance: float = 0.1
    share: float = 0.9


@dataclass(frozen=True, slots=True)
class Owned:
    """A cloud whose points know their stations, as far as could be told.

    Attributes:
        cloud: The same points; ``station`` counts through ``stations``.
        stations: (s, 3) float64, metres from the cloud's origin, refined where a grid was found.
    """

    cloud: PointCloud
    stations: Float64


class _Line(NamedTuple):
    """A line of a spectrum of angles."""

    brightness: float
    cycles: float


@dataclass(frozen=True, slots=True)
class _Grid:
    """A scanner's grid of directions.

    Attributes:
        place: (3,) metres.
        tilt: (2,) radians, about x and y.
        cycles: Columns a turn, and rows a turn of the mirror.
        phase: Of both, cycles.
    """

    place: Float64
    tilt: Float64
    cycles: Float64
    phase: Float64

    def residual(self, points: Float64) -> Float64:
        """(n, 2) how far the directions to (n, 3) points lie off the grid, in steps."""
        angle = np.stack(_angles(points - self.place, self.tilt), axis=1)
        turns = angle * (self.cycles / _TURN) - self.phase
        return np.asarray(turns - np.rint(turns))


def owners(cloud: PointCloud, stations: Float64, settings: Settings) -> Owned:
    """Tell which station measured each point.

    Args:
        cloud: n points, unthinned.
        stations: (s, 3) metres from the cloud's origin: where the scanner stood, roughly.
        settings: See ``Settings``.

    Returns:
        The cloud as it is where it tells its stations already, where none is known, or where too
        few points lie on grids; else with every point given to the station on whose grid it lies
        best, and -1 for those on none.
    """
    if not len(stations) or not len(cloud) or cloud.station.min() >= 0:
        return Owned(cloud, stations)
    grids = [_grid(cloud.points, place, len(stations), settings) for place in stations]
    owner = _owner(cloud.points, grids, settings.tolerance)
    known = [grid.cycles[0] for grid in grids if grid]
    if known and len(known) < len(stations):
        # The other stations stand out from what is left; mostly they share the instrument.
        left, missing = cloud.points[owner < 0], len(stations) - len(known)
        usual = float(np.median(known))
        grids = [
            grid or _grid(left, place, missing, settings, usual)
            for grid, place in zip(grids, stations, strict=True)
        ]
        owner = _owner(cloud.points, grids, settings.tolerance)
    grids = [
        grid and _polished(cloud.points[owner == number], grid) for number, grid in enumerate(grids)
    ]
    owner = _owner(cloud.points, grids, settings.tolerance)
    if (owner >= 0).mean() < settings.share:
        return Owned(cloud, stations)
    refined = [
        place if grid is None else grid.place for place, grid in zip(stations, grids, strict=True)
    ]
    return Owned(replace(cloud, station=owner), np.array(refined))


def _owner(points: Float32, grids: list[_Grid | None], tolerance: float) -> npt.NDArray[np.int16]:
    owner = np.full(len(points), -1, np.int16)
    for start in range(0, len(points), _BLOCK):
        part = points[start : start + _BLOCK].astype(np.float64)
        least = np.full(len(part), tolerance)
        for number, grid in enumerate(grids):
            if grid is not None:
                off = np.hypot(*grid.residual(part).T)
                better = off < least
                least[better] = off[better]
                owner[start : start + _BLOCK][better] = number
    return owner


def _grid(
    points: Float32,
    place: Float64,
    stations: int,
    settings: Settings,
    columns: float | None = None,
) -> _Grid | None:
    """The grid of the scanner near a place, of so many columns if given; None where none shows."""
    sample = _sample(points, place)
    if len(sample) < _FEWEST or _view_deg(sample - place) < _NARROWEST_DEG:
        return None
    step_m = _step_m(len(points) / stations, sample - place)
    height_m = settings.search_height_m
    for radius_m in (settings.search_m / 4, settings.search_m):
        found = _sought(sample, place, (radius_m, height_m), step_m, columns)
        for close in (0.25, 0.1, 0.05):
            own = sample[np.hypot(*found.residual(sample).T) < close]
            found = _refined(own, found, step_m * close)
        strayed = np.abs(found.place - place) > 1.5 * np.array([radius_m, radius_m, height_m])
        if not strayed.any() and _is_sharp(np.hypot(*found.residual(sample).T), settings.evidence):
            return found
    return None


def _polished(own: Float32, grid: _Grid) -> _Grid:
    """The grid that a station's own points show."""
    rng = np.random.default_rng(0)
    if len(own) < _FEWEST:
        return grid
    sample = own[rng.choice(len(own), min(len(own), _SAMPLE), replace=False)].astype(np.float64)
    return _refined(sample, grid, 1e-4)


def _is_sharp(off: Float64, evidence: float) -> bool:
    """Whether many points lie right on a grid, and few just beside it."""
    chance = np.pi * _CLOSE**2
    on, around = (off < _CLOSE).mean() - chance, (off < 3 * _CLOSE).mean() - 9 * chance
    return bool(on > evidence * chance and on > _SHARP * around)


def _sought(
    sample: Float64,
    place: Float64,
    search_m: tuple[float, float],
    step_m: float,
    number: float | None,
) -> _Grid:
    """The grid whose lines are brightest: across, then up and down, then all at once."""

    quick = sample.astype(np.float32)

    def columns(x: float, y: float) -> _Line:
        return _line(np.arctan2(quick[:, 1] - np.float32(y), quick[:, 0] - np.float32(x)))

    def rows(z: float) -> _Line:
        return _line(np.arctan2(quick[:, 2] - np.float32(z), across))

    def shine(turns: float, of: Float64, at: Float64) -> float:
        return _shine(np.arctan2(of[:, 1] - at[1], of[:, 0] - at[0]), turns)

    x, y = place[:2]
    for reach_m, every_m in ((search_m[0], 2 * step_m), (3 * step_m, step_m / 2)):
        centre = np.array([x, y])
        line, (x, y) = max((columns(*at), tuple(at)) for at in centre + _disc(reach_m, every_m))
    # A wrong place shifts the line by a cycle or two; each of these is followed to its own best.
    start = np.array([x, y])
    few, tried = sample[::3], []
    for turns in [number] if number else line.cycles + np.arange(-2, 3):
        best = _simplex(partial(shine, turns, few), start, np.full(2, step_m / 2))
        tried.append((shine(turns, sample, best), float(turns), *best))
    _, turns, x, y = max(tried)
    across = np.hypot(sample[:, 0] - x, sample[:, 1] - y).astype(np.float32)
    z = place[2]
    for reach_m, every_m in ((search_m[1], step_m / 2), (2.5 * step_m, step_m / 8)):
        line, z = max((rows(at), at) for at in np.arange(z - reach_m, z + reach_m, every_m))
    found = _Grid(np.array([x, y, z]), np.zeros(2), np.array([turns, line.cycles]), np.zeros(2))
    return _refined(sample, found, step_m / 4)


def _sample(points: Float32, place: Float64) -> Float64:
    """Points that may have been measured from a place, far enough off to forgive its error."""
    rng = np.random.default_rng(0)
    some = points[rng.choice(len(points), min(len(points), 20 * _SAMPLE), replace=False)]
    buffer = depth_buffer(some, place, 1.0)
    way = some - place.astype(np.float32)
    flat = np.hypot(way[:, 0], way[:, 1])
    good = buffer.sees(some, np.full(len(some), 0.3, np.float32)) & (flat > np.abs(way[:, 2]) / 2)
    far = flat > 0.5 * np.median(flat[good]) if good.any() else good
    return some[good & far][:_SAMPLE].astype(np.float64)


def _view_deg(way: Float64) -> int:
    """How many degrees of azimuth a sample fills."""
    azimuth = np.degrees(np.arctan2(way[:, 1], way[:, 0]))
    return len(np.unique(np.floor(azimuth)))


def _step_m(points: float, way: Float64) -> float:
    """How far a place may be off for most beams to stay within a quarter of a step."""
    step = np.sqrt(3 * np.pi / points)
    return float(0.2 * step * np.median(np.hypot(way[:, 0], way[:, 1])))


def _disc(radius_m: float, step_m: float) -> Float64:
    """(k, 2) the places of a square grid within a circle about zero."""
    steps = np.arange(-np.ceil(radius_m / step_m), np.ceil(radius_m / step_m) + 1) * step_m
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    return np.asarray(places[np.hypot(*places.T) <= radius_m])


def _line(angle: Float32) -> _Line:
    """The brightest line in the spectrum of angles, or the lowest that is nearly as bright.

    A line has overtones, and one of them may outshine it.
    """
    bins = ((angle + np.float32(np.pi)) * np.float32(_BINS / _TURN)).astype(np.int32) % _BINS
    spectrum = np.abs(np.fft.rfft(np.bincount(bins, minlength=_BINS)))
    spectrum[:_LOWEST_CYCLES] = 0
    brightest = spectrum.max()
    cycles = int(np.argmax(spectrum > 0.6 * brightest))
    cycles += int(np.argmax(spectrum[cycles : cycles + 3]))
    return _Line(float(brightest), float(cycles))


def _angles(way: Float64, tilt: Float64) -> tuple[Float64, Float64]:
    """Azimuth and elevation of (n, 3) ways in a frame tilted a little."""
    x, y, z = way.T
    x, y, z = x + tilt[1] * z, y - tilt[0] * z, z - tilt[1] * x + tilt[0] * y
    return np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))


def _shine(angle: Float64, cycles: float) -> float:
    return float(np.abs(np.exp(1j * cycles * angle).sum()))


def _simplex(shine: Callable[[Float64], float], start: Float64, scale: Float64) -> Float64:
    """Where something shines brightest, from a start nearly there (Nelder and Mead 1965)."""
    corners = start + np.concatenate([np.zeros((1, len(start))), np.diag(scale)])
    options: Any = {"initial_simplex": corners, "maxiter": 300, "xatol": 1e-6, "fatol": 0.5}

    def dark(at: Any) -> Any:
        return -shine(at)

    found: Any = minimize(dark, start, method="Nelder-Mead", options=options)
    return np.asarray(found.x)


def _refined(sample: Float64, near: _Grid, scale_m: float) -> _Grid:
    """The grid for which both lines are brightest, from one nearly so."""

    def shine(at: Float64) -> float:
        azimuth, elevation = _angles(sample - at[:3], at[3:5])
        return _shine(azimuth, near.cycles[0]) + _shine(elevation, at[5])

    scale = scale_m * np.array([1, 1, 1, 0.1, 0.1, 50])
    found = _simplex(shine, np.array([*near.place, *near.tilt, near.cycles[1]]), scale)
    cycles = np.array([near.cycles[0], found[5]])
    angles = _angles(sample - found[:3], found[3:5])
    phase = [
        float(np.angle(np.exp(1j * each * angle).sum())) / _TURN
        for each, angle in zip(cycles, angles, strict=True)
    ]
    return _Grid(found[:3], found[3:5], cycles, np.array(phase))
