"""Sight: what a scanner standing somewhere would see of a cloud.

A spherical depth buffer: for each direction, the nearest point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

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
