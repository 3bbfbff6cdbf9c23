"""Ownership: which station measured each point of a merged cloud, and where exactly it stood.

A merged cloud has lost its stations, but not their traces. A scanner sends its beams on a grid
that is regular in azimuth and elevation, and range noise moves a point along its beam only: seen
from the place of its own station, a point lies on the grid to a thousandth of a degree; seen from
anywhere else, it lies anywhere. Points dropped at random leave the grid as it is; only averaging
destroys it, and then nothing is found and nothing is claimed.

From a place known to some centimetres the search goes in steps, each as sharp as the next one
needs. *Frequency*: the spectrum of elevations within small windows of like range, where a wrong
place shifts all points alike. *Place*: climb where those windows, each for itself, are most
regular. *Phase*: climb where all windows agree on one grid; that tells the place to some
hundredths of a millimetre, and the scanner's tilt.

On the demo's merged scans, from the blind discs found in the floor (up to 15 cm off)
and, on the stair, from places rounded to centimetres: 99.6, 100.0 and 99.96 % of the points
come back to their station, of the second chamber at full size, with steps of 0.1 degrees, 99.9 %;
8 s of one core a station.

Tried and rejected: the spectrum over the whole circle instead of windows: a place 5 mm off
already blurs it, and ten stations on a stair drown it; windows of 5 degrees alone: a place 15 cm
off blurs the steps that are finer than a quarter of a degree.
"""

from __future__ import annotations

from dataclasses import dataclass
from threading import Event

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64
from tourgen.neighbours import Neighbours
from tourgen.stages.ownership.grid import Grid, fitted, polished
from tourgen.stages.ownership.settings import Settings
from tourgen.stages.ownership.windows import (
    HIGHEST_DEG,
    Lookout,
    Windows,
    agreeing,
    angles,
    climbed,
    drawn,
    rough,
    windows_about,
)
from tourgen.threads import each, in_parts

__all__ = ["VERSION", "Ownership", "Settings", "ownership"]

VERSION = 10
Ints = npt.NDArray[np.int64]
_BLOCK = 200_000
_ABOUT_M = 0.03
"""How uncertain a place is that was found by its blind disc."""
_TRIES = 6
"""Of a grid so fine that only the narrowest windows answer, but clearly: tenths of a millimetre
off its place already blur it."""
_CLEAR_SHARE = 0.2
"""Of the points that lie on such a grid: none better is looked for."""


@dataclass(frozen=True, slots=True)
class Ownership:
    """What the grids tell.

    Attributes:
        station: (m,) int16, the station that measured each point asked for; -1 throughout where
            that cannot be told.
        stations: (s, 3) float64, their places, metres; as given where no grid was found.
    """

    station: npt.NDArray[np.int16]
    stations: Float64


def ownership(
    points: Float32, stations: Float64, settings: Settings, asked: Ints | None = None
) -> Ownership:
    """Find the grids of stations in a merged cloud.

    Args:
        points: (n, 3) metres, z up, as merged: not averaged.
        stations: (s, 3) metres, known to some centimetres.
        settings: See ``Settings``.
        asked: (m,) positions of the points whose owners are wanted; of all n if left out.

    Returns:
        The stations' exact places where the grid of each is found, else those given; and the owner
        of each point where moreover nearly all points lie on a grid. The few that lie on none
        follow the nearest that does.
    """
    asked = np.arange(len(points)) if asked is None else asked
    nobody = np.full(len(asked), -1, np.int16)
    lacking = Event()  # one without a grid is enough: the others need not be sought

    def sought(number: int) -> Grid | None:
        if lacking.is_set():
            return None
        grid = _grid(points, stations[number], settings, np.random.default_rng([0, number]))
        if grid is None:
            lacking.set()
        return grid

    found = [grid for grid in each(sought, range(len(stations))) if grid is not None]
    if not found or len(found) < len(stations):
        return Ownership(nobody, stations)
    places = np.array([grid.place for grid in found])
    points = points[asked]
    owner = _nearest_grid(points, found, settings.most_off)
    known = owner >= 0
    if known.mean() < settings.least_matched:
        return Ownership(nobody, places)
    if not known.all():
        near, _ = Neighbours.of(points[known], 1).nearest(points[~known], 1)
        owner[~known] = owner[known][near[:, 0]]
    return Ownership(owner, places)


def _nearest_grid(points: Float32, grids: list[Grid], most_off: float) -> npt.NDArray[np.int16]:
    """Number of the grid that each point lies on, -1 where it lies on none."""
    owner = np.full(len(points), -1, np.int16)

    def own(first: int, last: int) -> None:
        block = points[first:last]
        best = np.full(len(block), most_off, np.float32)
        for number, grid in enumerate(grids):
            off = grid.off(block)
            nearer = off < best
            best[nearer] = off[nearer]
            owner[first:last][nearer] = number

    in_parts(own, len(points), _BLOCK)
    return owner


def _grid(
    points: Float32, place: Float64, settings: Settings, rng: np.random.Generator
) -> Grid | None:
    """The grid of the station near a place, or None."""
    tries: list[tuple[float, int, Windows, Float64, float]] = []
    lookout = Lookout(points, place, rng)
    windows_deg = settings.windows_deg
    for number, window_deg in enumerate(windows_deg):
        windows = windows_about(lookout, place, window_deg, settings, rng)
        if windows is not None:
            there, frequency, answer = rough(windows, place, window_deg, settings)
            tries.append((answer, number, windows, there, frequency))
            if answer >= settings.clear_answer:
                break
    if not tries:
        return None
    answer, number, windows, place, frequency = max(tries, key=lambda each: each[0])
    if answer < settings.least_answer:
        return None
    best, most = None, settings.least_share
    clear = answer >= settings.clear_answer and windows_deg[number] == windows_deg[-1]
    for _ in range(_TRIES if clear else 1):
        grid, share = _refined(points, lookout, windows, number, place, frequency, settings, rng)
        if grid and share >= most:
            best, most = grid, share
        if most >= _CLEAR_SHARE:
            break
    return best


def _refined(
    points: Float32,
    lookout: Lookout,
    windows: Windows,
    number: int,
    place: Float64,
    frequency: float,
    settings: Settings,
    rng: np.random.Generator,
) -> tuple[Grid | None, float]:
    """The grid of a station from where its narrowest windows say it is, if there is one, and the
    share of points on it: some windows that are drawn lead astray."""
    narrowest_deg = settings.windows_deg[number]
    for window_deg in settings.windows_deg[number::-1]:
        about_m = _ABOUT_M * narrowest_deg / window_deg
        place, frequency = climbed(windows, place, frequency, window_deg, about_m)
        wider = windows_about(lookout, place, window_deg, settings, rng)
        if wider is None:
            return None, 0.0
        windows = wider
    place, frequency = agreeing(windows, place, frequency)
    fits = fitted(windows, place, frequency)
    if max(agreement for _, agreement in fits) < settings.least_agreement / np.sqrt(
        len(windows.points)
    ):
        return None, 0.0
    sample = points[drawn(len(points), settings.polish_points, rng)]
    sample = sample[np.abs(angles(sample, place)[0]) < HIGHEST_DEG]
    grids = each(lambda fit: polished(fit[0], sample, settings), fits)
    grids = [grid for grid in grids if grid.is_as_fine_as(settings.step_deg)]
    shares = [float((grid.off(sample) < settings.most_off / 4).mean()) for grid in grids]
    best = int(np.argmax(shares)) if shares else -1
    return (grids[best], shares[best]) if shares else (None, 0.0)
