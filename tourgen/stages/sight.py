"""Sight: what a scanner standing somewhere would see of a cloud.

A spherical depth buffer: for each direction, the nearest point. It answers two questions that
normals and trimming ask: is this point visible from there, and is this place known to be empty,
because a station measured what lies behind it, or nothing at all?
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import minimum_filter

from tourgen.geometry import Float32, Float64


@dataclass(frozen=True, slots=True)
class DepthBuffer:
    """Nearest range by direction.

    Attributes:
        station: (3,) metres.
        cell_deg: Edge of a cell at the horizon.
        range_m: (elevations, azimuths) float32, infinity where nothing was hit.
    """

    station: Float64
    cell_deg: float
    range_m: Float32

    def cells(self, points: Float32) -> tuple[npt.NDArray[np.int64], Float32, Float32]:
        """Flat cell index, range and elevation in degrees of each of (n, 3) points."""
        return _directions(points, self.station, self.cell_deg)

    def sees(
        self, points: Float32, cosine: Float32, margin_m: float = 0.02
    ) -> npt.NDArray[np.bool_]:
        """Mask of the (n, 3) points with nothing in front of them.

        Args:
            points: Metres.
            cosine: (n,) of the angle between the ray and the surface's normal: within one cell a
                slanted surface spans a depth of its own, which is not in front of it.
            margin_m: How much nearer something must be to count as in front.
        """
        cell, distance, _ = self.cells(points)
        slant = np.minimum(np.sqrt(1 - cosine**2) / np.maximum(np.abs(cosine), 1e-3), 8.0)
        span_m = distance * np.float32(np.radians(self.cell_deg)) * slant
        return np.asarray(distance - span_m - margin_m <= self.range_m.reshape(-1)[cell])


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """What stations know to be empty.

    Attributes:
        buffers: One a station; each cell holds the nearest of its own and the cells around.
        lowest_deg: Lower edge of the scanners' field of view.
        margin_m: How far in front of what was measured a place is known to be empty.
    """

    buffers: tuple[DepthBuffer, ...]
    lowest_deg: float
    margin_m: float

    def holds(self, points: Float32) -> npt.NDArray[np.bool_]:
        """Mask of the (n, 3) places where a surface would have been measured and was not."""
        free = np.zeros(len(points), bool)
        for buffer in self.buffers:
            cell, distance, elevation = buffer.cells(points)
            reach_m = buffer.range_m.reshape(-1)[cell]
            free |= (distance + self.margin_m < reach_m) & (elevation > self.lowest_deg)
        return free

    def leads_out(self, points: Float32) -> npt.NDArray[np.bool_]:
        """Mask of the (n, 3) places in whose direction a station measured nothing at all."""
        out = np.zeros(len(points), bool)
        for buffer in self.buffers:
            cell, _, elevation = buffer.cells(points)
            out |= np.isinf(buffer.range_m.reshape(-1)[cell]) & (elevation > self.lowest_deg)
        return out


def free_space(
    points: Float32, stations: Float64, cell_deg: float, lowest_deg: float, margin_m: float
) -> FreeSpace:
    """What (s, 3) stations that measured (n, 3) points know to be empty."""
    buffers = []
    for station in stations:
        buffer = depth_buffer(points, station, cell_deg)
        nearest = minimum_filter(buffer.range_m, size=3, mode=("nearest", "wrap"))
        buffers.append(DepthBuffer(station, cell_deg, nearest))
    return FreeSpace(tuple(buffers), lowest_deg, margin_m)


def depth_buffer(points: Float32, station: Float64, cell_deg: float) -> DepthBuffer:
    """Render (n, 3) points as seen from a station."""
    cell, distance, _ = _directions(points, station, cell_deg)
    rows, columns = _shape(cell_deg)
    nearest = np.full(rows * columns, np.inf, np.float32)
    np.minimum.at(nearest, cell, distance)
    return DepthBuffer(station, cell_deg, nearest.reshape(rows, columns))


def _shape(cell_deg: float) -> tuple[int, int]:
    return round(180 / cell_deg), round(360 / cell_deg)


def _directions(
    points: Float32, station: Float64, cell_deg: float
) -> tuple[npt.NDArray[np.int64], Float32, Float32]:
    offset = points - station.astype(np.float32)
    horizontal = np.hypot(offset[:, 0], offset[:, 1])
    distance = np.hypot(horizontal, offset[:, 2])
    elevation = np.degrees(np.arctan2(offset[:, 2], horizontal))
    azimuth = np.degrees(np.arctan2(offset[:, 1], offset[:, 0]))
    rows, columns = _shape(cell_deg)
    row = np.minimum(((elevation + 90) / cell_deg).astype(np.int64), rows - 1)
    column = ((azimuth + 180) / cell_deg).astype(np.int64) % columns
    return row * columns + column, distance, elevation
