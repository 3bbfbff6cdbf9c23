"""Windows: points of like direction and range as a place sees them, and the place they tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Float64
from tourgen.sorting import distinct
from tourgen.stages.ownership.settings import Settings

TURN = 2j * np.pi
HIGHEST_DEG = 75.0
"""Windows nearer the zenith hold all azimuths."""
_SAMPLE = 600_000
_LARGEST_SAMPLE = 6_000_000
_BLOCK = 1 << 20
_ROWS, _COLUMNS = 181, 361
_BLOCK_DEG = 3
"""Of directions that are looked at, or not, as one: wider than the windows that want so many."""
_SEVERAL = 10
_LEAST_STEPS = 4
"""Of a grid in a window: less is its own width."""

Mask = npt.NDArray[np.bool_]
Complex = npt.NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Windows:
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
        return np.add.reduceat(np.exp(TURN * frequency * angle_deg), self.first)

    def answer(self, angle_deg: Float64, frequency: float) -> float:
        """How regular the windows are at a frequency, each for itself: 1 if not at all."""
        return float((np.abs(self.sums(angle_deg, frequency)) ** 2 / self.size).mean())


def angles(points: Float32 | Float64, place: Float64) -> tuple[Float64, Float64, Float64]:
    """Elevation and azimuth in degrees, and range, of (n, 3) points."""
    way = points - place
    flat = np.hypot(way[:, 0], way[:, 1])
    return (
        np.degrees(np.arctan2(way[:, 2], flat)),
        np.degrees(np.arctan2(way[:, 1], way[:, 0])),
        np.hypot(flat, way[:, 2]),
    )


class Lookout:
    """A cloud as it is seen from about a place, to draw points from."""

    def __init__(self, points: Float32, place: Float64, rng: np.random.Generator) -> None:
        self._points, self._place, self._rng = points, place, rng
        self._patches: dict[int, Float32] = {}

    def sample(self, wanted: int) -> Float32:
        """So many points of all directions; of more than can be held at once only those of some
        directions, the same each time."""
        count = min(wanted, len(self._points))
        if count <= _LARGEST_SAMPLE:
            return self._points[drawn(len(self._points), wanted, self._rng)]
        if wanted not in self._patches:
            self._patches[wanted] = self._patch(_LARGEST_SAMPLE / count, count / len(self._points))
        return self._patches[wanted]

    def _patch(self, directions: float, share: float) -> Float32:
        """A share of the points of a share of all directions."""
        shape = -(-_ROWS // _BLOCK_DEG), -(-_COLUMNS // _BLOCK_DEG)
        looked_at = self._rng.random(shape) < directions
        looked_at = looked_at.repeat(_BLOCK_DEG, axis=0).repeat(_BLOCK_DEG, axis=1)
        found = []
        for first in range(0, len(self._points), _BLOCK):
            block = self._points[first : first + _BLOCK]
            kept = np.flatnonzero(_looked_at(block, self._place, looked_at))
            if share < 1:
                kept = kept[self._rng.random(len(kept)) < share]
            found.append(block[kept])
        return np.concatenate(found)


@compiled
def _looked_at(points: Float32, place: Float64, cells: Mask) -> Mask:
    """(n,) whether the cell of a degree that each of (n, 3) points lies in is looked at."""
    found = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        x, y, z = points[i, 0] - place[0], points[i, 1] - place[1], points[i, 2] - place[2]
        row = int(np.degrees(np.arctan2(z, np.hypot(x, y))) + 90)
        column = int(np.degrees(np.arctan2(y, x)) + 180)
        found[i] = cells[row, column]
    return found


def windows_about(
    lookout: Lookout,
    place: Float64,
    window_deg: float,
    settings: Settings,
    rng: np.random.Generator,
) -> Windows | None:
    """Windows of points that can be seen from a place; None where there are too few."""
    sample = lookout.sample(int(_SAMPLE * (settings.windows_deg[0] / window_deg) ** 2))
    sample, elevation, azimuth, reach = _in_front(sample, place)
    half = window_deg / 2
    chosen: list[npt.NDArray[np.int64]] = []
    for seed in rng.permutation(len(sample))[: 4 * settings.windows]:
        up = elevation[seed]
        low, high = np.searchsorted(elevation, up + np.array([-half, half]))
        aside = (azimuth[low:high] - azimuth[seed] + 180) % 360 - 180
        alike = np.abs(aside) * np.cos(np.radians(up)) < half
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
    return Windows(sample[np.concatenate(chosen)].astype(np.float64), first, size)


def drawn(count: int, wanted: int, rng: np.random.Generator) -> npt.NDArray[np.int64]:
    """Positions of so many of ``count`` points, or of nearly so many; all where they are fewer.

    A permutation of 150 million would take more than a gigabyte.
    """
    if wanted > count / _SEVERAL:
        return rng.permutation(count)[:wanted]
    return distinct(rng.integers(0, count, wanted))


def _cells(elevation: Float64, azimuth: Float64) -> npt.NDArray[np.int64]:
    """(n,) cell of a degree that directions lie in."""
    rows = np.floor(elevation + 90).astype(np.int64)
    return np.asarray(rows * _COLUMNS + np.floor(azimuth + 180).astype(np.int64))


def _in_front(points: Float32, place: Float64) -> tuple[Float32, Float64, Float64, Float64]:
    """The points that no other hides, by elevation, with their angles and range."""
    elevation, azimuth, reach = angles(points, place)
    cell = _cells(elevation, azimuth)
    nearest_m = np.full(_ROWS * _COLUMNS, np.inf)
    np.minimum.at(nearest_m, cell, reach)
    near = reach < 1.08 * nearest_m[cell] + 0.03
    near &= (reach > 0.4) & (np.abs(elevation) < HIGHEST_DEG)
    order = np.flatnonzero(near)[np.argsort(elevation[near])]
    return points[order], elevation[order], azimuth[order], reach[order]


def rough(
    windows: Windows, place: Float64, window_deg: float, settings: Settings
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
    windows: Windows, place: Float64, window_deg: float, settings: Settings
) -> tuple[Float64, Float64]:
    """Frequencies of elevation, and how the windows answer to each."""
    finest, coarsest = settings.step_deg
    coarsest = min(coarsest, window_deg / _LEAST_STEPS)
    bin_deg = finest / 4
    length = 2 ** int(np.ceil(np.log2(8 * window_deg / bin_deg)))
    elevation = angles(windows.points, place)[0]
    window = np.repeat(np.arange(len(windows.first)), windows.size)
    low = np.minimum.reduceat(elevation, windows.first)[window]
    column = np.minimum(((elevation - low) / bin_deg).astype(int), length - 1)
    count = np.zeros((len(windows.first), length), np.float32)
    np.add.at(count, (window, column), 1)
    power = np.abs(np.fft.rfft(count)) ** 2 / windows.size[:, None]
    frequencies = np.fft.rfftfreq(length, bin_deg)
    wanted = (frequencies >= 1 / coarsest) & (frequencies <= 1 / finest)
    return np.asarray(frequencies[wanted], np.float64), power.mean(axis=0)[wanted]


def climbed(
    windows: Windows, place: Float64, frequency: float, window_deg: float, about_m: float
) -> tuple[Float64, float]:
    """To where each window for itself is most regular."""
    step = 0.05 / window_deg

    def missing(x: Float64) -> float:
        elevation, azimuth, _ = angles(windows.points, place + x[:3] / 100)
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


def agreeing(windows: Windows, place: Float64, frequency: float) -> tuple[Float64, float]:
    """To where the windows' elevations agree on one grid, by trying all places around."""
    middle = np.add.reduceat(windows.points, windows.first) / windows.size[:, None]
    elevation, azimuth, reach = angles(middle, place)
    el, az = np.radians(elevation), np.radians(azimuth)
    upward = np.stack([-np.sin(el) * np.cos(az), -np.sin(el) * np.sin(az), np.cos(el)], axis=1)
    pitch_m = np.radians(0.2 / frequency) * float(np.median(reach))
    steps = pitch_m * np.arange(-5, 6)
    moves = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    shift_deg = -np.degrees(moves @ (upward / reach[:, None]).T)
    own = angles(windows.points, place)[0]
    best, most = (np.zeros(3), frequency), -1.0
    for sought in frequency + np.arange(-0.05, 0.05, 0.0025):
        sums = windows.sums(own, sought)
        sums /= np.sqrt(np.maximum(np.abs(sums), 1))
        agreed = np.abs(np.exp(TURN * sought * shift_deg) @ sums)
        if agreed.max() > most:
            best, most = (moves[agreed.argmax()], sought), float(agreed.max())
    return place + best[0], float(best[1])
