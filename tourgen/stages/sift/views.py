"""Views: a cloud as each station sees it, by direction and range."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64, PointCloud
from tourgen.stages.sight import depth_buffer

_SIGHT_CELL_DEG = 0.5
_BLOCK = 100_000


@dataclass(frozen=True, slots=True)
class View:
    """The points that one station measured, or may have measured.

    Attributes:
        station: (3,) metres.
        index: (m,) which points of the cloud they are.
        direction: (m, 3) unit vectors from the station.
        range_m: (m,) from the station.
        tree: Over the directions.
    """

    station: Float64
    index: npt.NDArray[np.int64]
    direction: Float32
    range_m: Float32
    tree: cKDTree

    def __len__(self) -> int:
        return len(self.index)

    def neighbours(self, at: npt.NDArray[np.int64], count: int) -> npt.NDArray[np.int64]:
        """(k, count) the nearest in direction of k points of the view, nearest first."""
        nearest = np.arange(1, count + 2)
        near = np.asarray(self.tree.query(self.direction[at], k=nearest, workers=-1)[1])
        # Where several points lie in one direction, the point itself need not come first.
        own = near == at[:, None]
        own[~own.any(axis=1), -1] = True
        return np.asarray(near[~own].reshape(len(at), count))

    def blocks(self, at: npt.NDArray[np.int64]) -> Iterator[npt.NDArray[np.int64]]:
        """``at`` in parts that fit in little memory."""
        for start in range(0, len(at), _BLOCK):
            yield at[start : start + _BLOCK]


def views(cloud: PointCloud, stations: Float64) -> Iterator[View]:
    """The view of each station that has one.

    A point that tells which station measured it is in the view of that one alone, another one in
    the view of every station that has nothing in front of it.
    """
    unknown = np.flatnonzero((cloud.station < 0) | (cloud.station >= len(stations)))
    for number, station in enumerate(stations):
        index = np.flatnonzero(cloud.station == number)
        if len(unknown):
            seen = unknown[_in_sight(cloud.points, station)[unknown]]
            index = np.sort(np.concatenate([index, seen]))
        way = cloud.points[index] - station.astype(np.float32)
        range_m = np.sqrt(np.einsum("ij,ij->i", way, way))
        away = range_m > 1e-3  # what lies in the scanner itself has no direction
        index, way, range_m = index[away], way[away], range_m[away]
        way /= range_m[:, None]
        if len(index):
            yield View(station, index, way, range_m, cKDTree(way))


def _in_sight(points: Float32, station: Float64) -> npt.NDArray[np.bool_]:
    buffer = depth_buffer(points, station, _SIGHT_CELL_DEG)
    return buffer.sees(points, np.full(len(points), 0.3, np.float32), margin_m=0.05)
