"""Grids: a station's beams, fitted to points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from tourgen.geometry import Float32, Float64
from tourgen.stages.ownership.settings import Settings
from tourgen.stages.ownership.windows import TURN, Windows, angles
from tourgen.threads import each


@dataclass(frozen=True, slots=True)
class Grid:
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
        elevation, azimuth, _ = angles(points, self.place)
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

    def moved(self, x: Float64) -> Grid:
        """A grid near by: x in steps as large as its parameters are uncertain."""
        return Grid(
            self.place + x[:3] / 1000,
            self.tilt_deg + x[3:5] / 100,
            self.elevation + x[5:7] / (1000, 10),
            self.azimuth + x[7:9] / (1000, 10),
        )


def fitted(windows: Windows, place: Float64, frequency: float) -> list[tuple[Grid, float]]:
    """The grids that most points may be on, and how well they are: from 0 to 1."""
    elevation, azimuth, _ = angles(windows.points, place)

    def fit(sought: float) -> tuple[Grid, float]:
        start = Grid(
            place,
            np.zeros(2),
            np.array([frequency, _offset(elevation, frequency)]),
            np.array([sought, _offset(azimuth, sought)]),
        )
        return _sharpened(start, windows.points)

    return each(fit, _clearest(azimuth, frequency + np.arange(-0.08, 0.08, 0.0004)))


def _clearest(angle_deg: Float64, frequencies: Float64) -> list[float]:
    """The frequencies of the three highest peaks."""
    angle_deg = angle_deg[:: max(1, len(angle_deg) // 5000)]
    power = np.abs(np.exp(TURN * np.outer(frequencies, angle_deg)).mean(axis=1))
    peak = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])) + 1
    return [float(f) for f in frequencies[peak[np.argsort(-power[peak])[:3]]]]


def _offset(angle_deg: Float64, frequency: float) -> float:
    return float(-np.angle(np.exp(TURN * frequency * angle_deg).mean()) / (2 * np.pi))


def _sharpened(grid: Grid, points: Float64) -> tuple[Grid, float]:
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


def polished(grid: Grid, sample: Float32, settings: Settings) -> Grid:
    """The grid fitted by least squares to points from everywhere that lie on it."""
    for play in (3.0, 2.0, 1.0, 0.5, 0.25):
        mine = sample[grid.off(sample) < play * settings.most_off].astype(np.float64)
        now = np.concatenate(grid.phases(mine))
        slope = _slope(grid, mine, now)
        step, *_ = np.linalg.lstsq(slope.T, np.rint(now) - now, rcond=None)
        grid = grid.moved(np.asarray(step, np.float64))
    return grid


def _slope(grid: Grid, points: Float64, now: Float64) -> Float64:
    """(9, 2 n) how the phases change with each parameter."""
    return np.stack([np.concatenate(grid.moved(step).phases(points)) - now for step in np.eye(9)])
