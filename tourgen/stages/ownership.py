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

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64

VERSION = 4
_TURN = 2j * np.pi
_HIGHEST_DEG = 75.0
"""Windows nearer the zenith hold all azimuths."""
_BLOCK = 1_000_000
_SAMPLE = 600_000
_LARGEST_SAMPLE = 6_000_000
_LEAST_STEPS = 4
"""Of a grid in a window: less is its own width."""
_ABOUT_M = 0.03
"""How uncertain a place is that was found by its blind disc."""

Complex = npt.NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Settings:
    """What to look for.

    Attributes:
        step_deg: Finest and coarsest step of a scanner's grid.
        windows_deg: Edges of the windows whose points are compared. A window of some 20 steps
            forgives a place that is some centimetres off, a wider one tells it better: each edge
            is tried in turn for the frequency, then those before it for the place.
        windows: Number of windows.
        window_points: Points taken from a window.
        rise_m: How far above or below the place given a station may have stood.
        least_answer: Windows of random points answer 1 on average; a grid answers this at least.
        clear_answer: No narrower windows are tried where they answer this.
        least_agreement: Mean cosine of all phases over that which random points reach.
        most_off: A point farther off the grid than this, in steps, is not the station's.
        least_matched: Least share of the points that must lie on a grid.
        polish_points: Points of the cloud drawn for the last fit.
    """

    step_deg: tuple[float, float] = (0.02, 2.0)
    windows_deg: tuple[float, ...] = (5.0, 1.6, 0.5)
    windows: int = 150
    window_points: int = 100
    rise_m: float = 0.16
    least_answer: float = 2.0
    clear_answer: float = 10.0
    least_agreement: float = 5.0
    most_off: float = 0.08
    least_matched: float = 0.9
    polish_points: int = 100_000


@dataclass(frozen=True, slots=True)
class Ownership:
    """What the grids tell.

    Attributes:
        station: (n,) int16, the station that measured each point; -1 throughout where that
            cannot be told.
        stations: (s, 3) float64, their places, metres; as given where no grid was found.
    """

    station: npt.NDArray[np.int16]
    stations: Float64


@dataclass(frozen=True, slots=True)
class _Grid:
    """A station's beams: phase = frequency (1/deg) * angle (deg) + offset, whole on the grid.

    Attributes:
        place: (3,) metres.
        tilt_deg: (2,) turn about the x and y axes.
        elevation: Frequency and offset.
        azimuth: Frequency and offset.
    """

    place: Float64
    tilt_deg: Float64
    elevation: Float64
    azimuth: Float64

    def phases(self, points: Float32 | Float64) -> tuple[Float64, Float64]:
        """In elevation and azimuth, of (n, 3) points."""
        elevation, azimuth, _ = _angles(points, self.place)
        x, y = self.tilt_deg
        sine, cosine = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
        lean = np.tan(np.radians(np.clip(elevation, -89.5, 89.5)))
        level = elevation + x * cosine + y * sine
        around = azimuth + lean * (x * sine - y * cosine)
        return (
            self.elevation[0] * level + self.elevation[1],
            self.azimuth[0] * around + self.azimuth[1],
        )

    def off(self, points: Float32) -> Float32:
        """How far off the grid each of (n, 3) points lies, in steps."""
        elevation, azimuth = self.phases(points)
        off = np.hypot(elevation - np.rint(elevation), azimuth - np.rint(azimuth))
        return off.astype(np.float32)

    def is_as_fine_as(self, step_deg: tuple[float, float]) -> bool:
        """Whether its steps lie within these: one whose steps grow without end fits all points."""
        finest, coarsest = step_deg
        steps = np.array([self.elevation[0], self.azimuth[0]])
        return bool(np.all((steps >= 1 / coarsest) & (steps <= 1 / finest)))

    def moved(self, x: Float64) -> _Grid:
        """A grid near by: x in steps as large as its parameters are uncertain."""
        return _Grid(
            self.place + x[:3] / 1000,
            self.tilt_deg + x[3:5] / 100,
            self.elevation + x[5:7] / (1000, 10),
            self.azimuth + x[7:9] / (1000, 10),
        )


@dataclass(frozen=True, slots=True)
class _Windows:
    """Points in w windows of like direction and range, one after the other.

    Attributes:
        points: (n, 3) float64, metres.
        first: (w,) where each window begins.
        size: (w,) its points.
    """

    points: Float64
    first: npt.NDArray[np.int64]
    size: npt.NDArray[np.int64]

    def sums(self, angle_deg: Float64, frequency: float) -> Complex:
        """(w,) sum of the phases of each window, as unit vectors."""
        return np.add.reduceat(np.exp(_TURN * frequency * angle_deg), self.first)

    def answer(self, angle_deg: Float64, frequency: float) -> float:
        """How regular the windows are at a frequency, each for itself: 1 if not at all."""
        return float((np.abs(self.sums(angle_deg, frequency)) ** 2 / self.size).mean())


def ownership(points: Float32, stations: Float64, settings: Settings) -> Ownership:
    """Find the grids of stations in a merged cloud.

    Args:
        points: (n, 3) metres, z up, as merged: not averaged.
        stations: (s, 3) metres, known to some centimetres.
        settings: See ``Settings``.

    Returns:
        The stations' exact places where the grid of each is found, else those given; and the owner
        of each point where moreover nearly all points lie on a grid. The few that lie on none
        follow the nearest that does.
    """
    rng = np.random.default_rng(0)
    nobody = np.full(len(points), -1, np.int16)
    found = []
    for place in stations:
        grid = _grid(points, place, settings, rng)
        if grid is None:
            return Ownership(nobody, stations)
        found.append(grid)
    if not found:
        return Ownership(nobody, stations)
    places = np.array([grid.place for grid in found])
    owner = _nearest_grid(points, found, settings.most_off)
    known = owner >= 0
    if known.mean() < settings.least_matched:
        return Ownership(nobody, places)
    if not known.all():
        _, near = cKDTree(points[known]).query(points[~known], workers=-1)
        owner[~known] = owner[known][near]
    return Ownership(owner, places)


def _nearest_grid(points: Float32, grids: list[_Grid], most_off: float) -> npt.NDArray[np.int16]:
    """Number of the grid that each point lies on, -1 where it lies on none."""
    owner = np.full(len(points), -1, np.int16)
    for start in range(0, len(points), _BLOCK):
        block = points[start : start + _BLOCK]
        best = np.full(len(block), most_off, np.float32)
        for number, grid in enumerate(grids):
            off = grid.off(block)
            nearer = off < best
            best[nearer] = off[nearer]
            owner[start : start + _BLOCK][nearer] = number
    return owner


def _grid(
    points: Float32, place: Float64, settings: Settings, rng: np.random.Generator
) -> _Grid | None:
    """The grid of the station near a place, or None."""
    tries: list[tuple[float, int, _Windows, Float64, float]] = []
    for number, window_deg in enumerate(settings.windows_deg):
        windows = _windows(points, place, window_deg, settings, rng)
        if windows is not None:
            there, frequency, answer = _rough(windows, place, window_deg, settings)
            tries.append((answer, number, windows, there, frequency))
            if answer >= settings.clear_answer:
                break
    if not tries:
        return None
    answer, number, windows, place, frequency = max(tries, key=lambda each: each[0])
    if answer < settings.least_answer:
        return None
    narrowest_deg = settings.windows_deg[number]
    for window_deg in settings.windows_deg[number::-1]:
        about_m = _ABOUT_M * narrowest_deg / window_deg
        place, frequency = _climbed(windows, place, frequency, window_deg, about_m)
        windows = _windows(points, place, window_deg, settings, rng)
        if windows is None:
            return None
    place, frequency = _agreeing(windows, place, frequency)
    fits = _fitted(windows, place, frequency)
    if max(agreement for _, agreement in fits) < settings.least_agreement / np.sqrt(
        len(windows.points)
    ):
        return None
    sample = points[rng.permutation(len(points))[: settings.polish_points]]
    sample = sample[np.abs(_angles(sample, place)[0]) < _HIGHEST_DEG]
    polished = (_polished(grid, sample, settings) for grid, _ in fits)
    grids = [grid for grid in polished if grid.is_as_fine_as(settings.step_deg)]
    return max(
        grids,
        key=lambda grid: int((grid.off(sample) < settings.most_off / 4).sum()),
        default=None,
    )


# ------------------------------------------------------------------ windows


def _angles(points: Float32 | Float64, place: Float64) -> tuple[Float64, Float64, Float64]:
    """Elevation and azimuth in degrees, and range, of (n, 3) points."""
    way = points - place
    flat = np.hypot(way[:, 0], way[:, 1])
    return (
        np.degrees(np.arctan2(way[:, 2], flat)),
        np.degrees(np.arctan2(way[:, 1], way[:, 0])),
        np.hypot(flat, way[:, 2]),
    )


def _windows(
    points: Float32,
    place: Float64,
    window_deg: float,
    settings: Settings,
    rng: np.random.Generator,
) -> _Windows | None:
    """Windows of points that can be seen from a place; None where there are too few."""
    wanted = int(min(_SAMPLE * (settings.windows_deg[0] / window_deg) ** 2, _LARGEST_SAMPLE))
    sample = points[rng.permutation(len(points))[:wanted]]
    elevation, azimuth, reach = _angles(sample, place)
    near = _nearest(elevation, azimuth, reach)
    order = np.flatnonzero(near)[np.argsort(elevation[near])]
    sample, elevation, azimuth, reach = (
        sample[order],
        elevation[order],
        azimuth[order],
        reach[order],
    )
    half = window_deg / 2
    chosen: list[npt.NDArray[np.int64]] = []
    for seed in rng.permutation(len(sample))[: 4 * settings.windows]:
        low, high = np.searchsorted(elevation, elevation[seed] + (-half, half))
        aside = (azimuth[low:high] - azimuth[seed] + 180) % 360 - 180
        alike = np.abs(aside) * np.cos(np.radians(elevation[seed])) < half
        alike &= np.abs(reach[low:high] / reach[seed] - 1) < 0.1
        window = low + np.flatnonzero(alike)
        if len(window) >= settings.window_points // 3:
            chosen.append(rng.permutation(window)[: settings.window_points])
        if len(chosen) == settings.windows:
            break
    if len(chosen) < settings.windows // 5:
        return None
    size = np.array([len(each) for each in chosen])
    first = np.concatenate([[0], np.cumsum(size)[:-1]])
    return _Windows(sample[np.concatenate(chosen)].astype(np.float64), first, size)


def _nearest(elevation: Float64, azimuth: Float64, reach: Float64) -> npt.NDArray[np.bool_]:
    """Mask of what no other point hides, by cells of a degree."""
    cell = np.floor(elevation + 90).astype(int) * 361 + np.floor(azimuth + 180).astype(int)
    nearest = np.full(181 * 361, np.inf)
    np.minimum.at(nearest, cell, reach)
    return np.asarray(
        (reach < 1.08 * nearest[cell] + 0.03) & (reach > 0.4) & (np.abs(elevation) < _HIGHEST_DEG)
    )


# ------------------------------------------------------------------ steps of the search


def _rough(
    windows: _Windows, place: Float64, window_deg: float, settings: Settings
) -> tuple[Float64, float, float]:
    """The best height, its grid's frequency, and how the windows answer."""
    rises = np.arange(-settings.rise_m, settings.rise_m + 1e-9, 0.02)
    spectra = [
        _spectrum(windows, place + np.array([0, 0, rise]), window_deg, settings) for rise in rises
    ]
    best = int(np.argmax([answer.max() for _, answer in spectra]))
    frequencies, answer = spectra[best]
    top = int(answer.argmax())
    fundamental = float(frequencies[top])
    for part in (4, 3, 2):  # a grid answers at multiples of its frequency as well
        near = np.abs(frequencies - frequencies[top] / part) < 0.2 / window_deg
        if near.any() and answer[near].max() > 0.75 * answer[top]:
            fundamental = float(frequencies[near][answer[near].argmax()])
            break
    return place + np.array([0, 0, rises[best]]), fundamental, float(answer[top])


def _spectrum(
    windows: _Windows, place: Float64, window_deg: float, settings: Settings
) -> tuple[Float64, Float64]:
    """Frequencies of elevation, and how the windows answer to each."""
    finest, coarsest = settings.step_deg
    coarsest = min(coarsest, window_deg / _LEAST_STEPS)
    bin_deg = finest / 4
    length = 2 ** int(np.ceil(np.log2(8 * window_deg / bin_deg)))
    elevation = _angles(windows.points, place)[0]
    window = np.repeat(np.arange(len(windows.first)), windows.size)
    low = np.minimum.reduceat(elevation, windows.first)[window]
    column = np.minimum(((elevation - low) / bin_deg).astype(int), length - 1)
    count = np.zeros((len(windows.first), length), np.float32)
    np.add.at(count, (window, column), 1)
    power = np.abs(np.fft.rfft(count)) ** 2 / windows.size[:, None]
    frequencies = np.fft.rfftfreq(length, bin_deg)
    wanted = (frequencies >= 1 / coarsest) & (frequencies <= 1 / finest)
    return np.asarray(frequencies[wanted], np.float64), power.mean(axis=0)[wanted]


def _climbed(
    windows: _Windows, place: Float64, frequency: float, window_deg: float, about_m: float
) -> tuple[Float64, float]:
    """To where each window for itself is most regular."""
    step = 0.05 / window_deg

    def missing(x: Float64) -> float:
        elevation, azimuth, _ = _angles(windows.points, place + x[:3] / 100)
        sought = frequency + x[3] * step
        return -windows.answer(elevation, sought) - windows.answer(azimuth, sought)

    simplex = np.concatenate([np.zeros((1, 4)), np.diag([*[about_m * 100] * 3, 3.0])])
    x = minimize(
        missing,
        np.zeros(4),
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": 0.05, "fatol": 1e-3, "maxfev": 300},
    ).x
    return np.asarray(place + x[:3] / 100), float(frequency + x[3] * step)


def _agreeing(windows: _Windows, place: Float64, frequency: float) -> tuple[Float64, float]:
    """To where the windows' elevations agree on one grid, by trying all places around."""
    middle = np.add.reduceat(windows.points, windows.first) / windows.size[:, None]
    elevation, azimuth, reach = _angles(middle, place)
    el, az = np.radians(elevation), np.radians(azimuth)
    upward = np.stack([-np.sin(el) * np.cos(az), -np.sin(el) * np.sin(az), np.cos(el)], axis=1)
    pitch_m = np.radians(0.2 / frequency) * float(np.median(reach))
    steps = pitch_m * np.arange(-5, 6)
    moves = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    shift_deg = -np.degrees(moves @ (upward / reach[:, None]).T)
    own = _angles(windows.points, place)[0]
    best, most = (np.zeros(3), frequency), -1.0
    for sought in frequency + np.arange(-0.05, 0.05, 0.0025):
        sums = windows.sums(own, sought)
        sums /= np.sqrt(np.maximum(np.abs(sums), 1))
        agreed = np.abs(np.exp(_TURN * sought * shift_deg) @ sums)
        if agreed.max() > most:
            best, most = (moves[agreed.argmax()], sought), float(agreed.max())
    return place + best[0], float(best[1])


def _fitted(windows: _Windows, place: Float64, frequency: float) -> list[tuple[_Grid, float]]:
    """The grids that most points may be on, and how well they are: from 0 to 1."""
    elevation, azimuth, _ = _angles(windows.points, place)
    fits = []
    for sought in _clearest(azimuth, frequency + np.arange(-0.08, 0.08, 0.0004)):
        start = _Grid(
            place,
            np.zeros(2),
            np.array([frequency, _offset(elevation, frequency)]),
            np.array([sought, _offset(azimuth, sought)]),
        )
        fits.append(_sharpened(start, windows.points))
    return fits


def _clearest(angle_deg: Float64, frequencies: Float64) -> list[float]:
    """The frequencies of the three highest peaks."""
    angle_deg = angle_deg[:: max(1, len(angle_deg) // 5000)]
    power = np.abs(np.exp(_TURN * np.outer(frequencies, angle_deg)).mean(axis=1))
    peak = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])) + 1
    return [float(f) for f in frequencies[peak[np.argsort(-power[peak])[:3]]]]


def _offset(angle_deg: Float64, frequency: float) -> float:
    return float(-np.angle(np.exp(_TURN * frequency * angle_deg).mean()) / (2 * np.pi))


def _sharpened(grid: _Grid, points: Float64) -> tuple[_Grid, float]:
    """Climb to the best agreement, the harmonics one after the other as it grows sharp."""
    for harmonic in (1, 1, 2, 4):
        now = np.concatenate(grid.phases(points))
        slope = _slope(grid, points, now)
        turn = 2 * np.pi * harmonic

        def missing(
            x: Float64, now: Float64 = now, slope: Float64 = slope, turn: float = turn
        ) -> tuple[float, Float64]:
            phase = turn * (now + x @ slope)
            return -float(np.cos(phase).mean()), turn * (slope @ np.sin(phase)) / len(phase)

        found = minimize(missing, np.zeros(9), jac=True, method="BFGS", options={"maxiter": 40})
        grid = grid.moved(found.x)
    return grid, float(np.cos(2 * np.pi * np.concatenate(grid.phases(points))).mean())


def _polished(grid: _Grid, sample: Float32, settings: Settings) -> _Grid:
    """The grid fitted by least squares to points from everywhere that lie on it."""
    for play in (3.0, 2.0, 1.0, 0.5, 0.25):
        mine = sample[grid.off(sample) < play * settings.most_off].astype(np.float64)
        now = np.concatenate(grid.phases(mine))
        slope = _slope(grid, mine, now)
        step, *_ = np.linalg.lstsq(slope.T, np.rint(now) - now, rcond=None)
        grid = grid.moved(np.asarray(step, np.float64))
    return grid


def _slope(grid: _Grid, points: Float64, now: Float64) -> Float64:
    """(9, 2 n) how the phases change with each parameter."""
    return np.stack([np.concatenate(grid.moved(step).phases(points)) - now for step in np.eye(9)])
