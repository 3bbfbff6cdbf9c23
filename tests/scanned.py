"""A scanner on a regular grid in a box-shaped room, for tests of what stations see."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from tourgen.geometry import PointCloud

Floats = npt.NDArray[np.float64]
Cast = Callable[[Floats, Floats], Floats]
ROOM = (np.array([-2.5, -2.0, 0.0]), np.array([2.5, 2.0, 2.6]))
EYES = np.array([[-1.5, -0.6, 1.5], [1.4, 0.7, 1.45]])


def inside(low: Floats, high: Floats) -> Cast:
    """Range to the walls of a box that one stands in."""

    def cast(eye: Floats, way: Floats) -> Floats:
        with np.errstate(divide="ignore"):
            wall = np.where(way > 0, (high - eye) / way, (low - eye) / way)
        return np.asarray(np.where(way == 0, np.inf, wall).min(axis=1))

    return cast


def solid(low: Sequence[float], high: Sequence[float]) -> Cast:
    """Range to a box that one stands outside of."""

    def cast(eye: Floats, way: Floats) -> Floats:
        with np.errstate(divide="ignore"):
            a, b = (np.asarray(low) - eye) / way, (np.asarray(high) - eye) / way
        near, far = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
        return np.where((near < far) & (near > 0), near, np.inf)

    return cast


def beams(step_deg: float, heading_deg: float = 0.0) -> Floats:
    """(rows, columns, 3) unit vectors, nothing below -60 degrees."""
    columns = round(360 / step_deg)
    azimuth = np.radians(heading_deg) + 2 * np.pi * np.arange(columns) / columns
    elevation = np.radians(np.arange(-60 + step_deg / 2, 90, step_deg))[:, None]
    flat = np.cos(elevation)
    z = np.broadcast_to(np.sin(elevation), (len(elevation), columns))
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=-1)


def ranges(eye: Floats, way: Floats, *things: Cast) -> Floats:
    """Range of each beam to the nearest thing."""
    flat = way.reshape(-1, 3)
    return np.asarray(np.min([cast(eye, flat) for cast in things], axis=0)).reshape(way.shape[:-1])


def noisy(reach: Floats, rng: np.random.Generator) -> Floats:
    """With the range noise of a good scanner."""
    return reach + rng.normal(scale=0.0015, size=reach.shape)


def cloud_of(parts: Sequence[Floats], *, merged: bool = False) -> PointCloud:
    """One cloud of each station's points."""
    points = np.concatenate(parts).astype(np.float32)
    number = np.repeat(np.arange(len(parts)), [len(part) for part in parts]).astype(np.int16)
    if merged:
        number[:] = -1
    return PointCloud(np.zeros(3), points, np.full((len(points), 3), 128, np.uint8), number)
