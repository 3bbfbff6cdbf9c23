"""Views: a cloud as each station sees it, by direction and range."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64, PointCloud
from tourgen.neighbours import Neighbours
from tourgen.stages.sift.picture import Picture, noise_by_range, picture
from tourgen.stages.sight import depth_buffer

_SIGHT_CELL_DEG = 0.5
_BLOCK = 20_000
_BEAMS = 8
"""Looked for at once, mostly."""
_SMOOTH = 2.0
_ON_PLANE = 2.5
_LEAST_BEAMS = 5
_SURFACE_BEAMS = 10

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class View:
    """The points that one station measured, or may have measured.

    Attributes:
        station: (3,) metres.
        index: (m,) which points of the cloud they are.
        direction: (m, 3) unit vectors from the station.
        range_m: (m,) from the station.
        told: (m,) whether the scan says that this station measured the point.
    """

    station: Float64
    index: npt.NDArray[np.int64]
    direction: Float32
    range_m: Float32
    told: Mask

    def __len__(self) -> int:
        return len(self.index)

    @cached_property
    def beams(self) -> Neighbours:
        """The directions of all points."""
        return Neighbours.of(self.direction, _BEAMS)

    @cached_property
    def beam_m(self) -> Float32:
        """(m,) range of each of ``beams``, as they are sorted."""
        return self.range_m[self.beams.number]

    @cached_property
    def picture(self) -> Picture:
        """What lies in each direction."""
        return picture(self.direction, self.range_m)

    @cached_property
    def cell(self) -> npt.NDArray[np.int64]:
        """(m,) flat cell of the picture."""
        return self.picture.places(self.direction)[0]

    @cached_property
    def residual_m(self) -> Float32:
        """(m,) how far each point lies off its window's plane, along the beam."""
        off = self.picture.inverse(*self.picture.places(self.direction)) - 1 / self.range_m
        return np.asarray(np.abs(off) * self.range_m**2, np.float32)

    @cached_property
    def noise_m(self) -> Float32:
        """(m,) range noise of each point."""
        return self.noise_at(self.range_m)

    def noise_at(self, range_m: npt.NDArray[np.floating]) -> Float32:
        """(n,) range noise at (n,) ranges."""
        return np.asarray(np.interp(range_m, *self._noise), np.float32)

    @cached_property
    def _noise(self) -> Float64:
        return noise_by_range(self.picture.rough.reshape(-1)[self.cell], self.range_m)

    @cached_property
    def smooth(self) -> Mask:
        """(m,) whether a point lies on the plane about it, as all others there do."""
        rough_m = self.picture.rough.reshape(-1)[self.cell] * self.range_m**2
        least = self.noise_m
        return np.asarray((rough_m < _SMOOTH * least) & (self.residual_m < _ON_PLANE * least))

    def beyond_m(self, points: Float32) -> tuple[npt.NDArray[np.int64], Float32]:
        """How far behind each of (n, 3) places the station's beams ended.

        Where they met a smooth surface, it is known how far that lies in the very direction of a
        place; elsewhere the nearest of all beams around counts.

        Returns:
            (n,) flat cell of the picture, -1 outside, and (n,) metres, less than 0 where a beam
            ended before the place.
        """
        way = points - self.station.astype(np.float32)
        distance = np.maximum(np.sqrt(np.einsum("ij,ij->i", way, way)), np.float32(1e-6))
        way /= distance[:, None]
        cell, offset = self.picture.places(way)
        known = self.picture.beams.reshape(-1)[cell] >= _LEAST_BEAMS
        cell[~known] = -1
        beyond = self.picture.nearest_m.reshape(-1)[cell] - distance
        beyond[cell < 0] = -np.inf
        inverse = self.picture.inverse(cell, offset)
        at = np.flatnonzero((cell >= 0) & (inverse > 0) & (inverse * distance < 1))
        reach = 1 / inverse[at]
        rough_m = self.picture.rough.reshape(-1)[cell[at]] * reach**2
        flat = rough_m < _SMOOTH * self.noise_at(reach)
        flat &= self.picture.beams.reshape(-1)[cell[at]] >= _SURFACE_BEAMS
        at, reach = at[flat], reach[flat]
        cosine = 1 / np.hypot(1, self.picture.slope(cell[at], way[at]))
        further = (reach - distance[at]) * np.minimum(1, 2 * cosine)
        beyond[at] = np.maximum(beyond[at], further)
        return cell, beyond

    def around(self, at: npt.NDArray[np.int64], count: int) -> Surroundings:
        """The points that may be among the nearest ``count`` of some, in direction."""
        here = np.zeros(self.picture.beams.shape, np.bool_)
        here.reshape(-1)[self.cell[at]] = True
        wide = 2 * int(np.ceil(np.sqrt(count) / 2)) + 1
        here = binary_dilation(here, np.ones((1, wide), np.bool_))
        here = binary_dilation(here, np.ones((wide, 1), np.bool_))
        near = np.flatnonzero(here.reshape(-1)[self.cell])
        near = near[np.argsort(self.cell[near], kind="stable")]  # in memory as in space
        return Surroundings(self, near if len(near) > count else np.arange(len(self)))

    def blocks(self, at: npt.NDArray[np.int64]) -> Iterator[npt.NDArray[np.int64]]:
        """``at`` in parts that fit in little memory."""
        for start in range(0, len(at), _BLOCK):
            yield at[start : start + _BLOCK]


class Surroundings:
    """Some points of a view, to look for neighbours among."""

    def __init__(self, view: View, at: npt.NDArray[np.int64]) -> None:
        """Of the points ``at``."""
        self._view, self._at = view, at
        self._tree = cKDTree(view.direction[at])

    def neighbours(self, at: npt.NDArray[np.int64], count: int) -> npt.NDArray[np.int64]:
        """(k, count) the nearest in direction of k points of the view, nearest first; ``count``
        is less than the number of points."""
        nearest = np.arange(1, count + 2)
        near = np.asarray(self._tree.query(self._view.direction[at], k=nearest)[1])
        near = self._at[near]
        # Where several points lie in one direction, the point itself need not come first.
        own = near == at[:, None]
        own[~own.any(axis=1), -1] = True
        return np.asarray(near[~own].reshape(len(at), count))


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
            yield View(station, index, way, range_m, cloud.station[index] == number)


def _in_sight(points: Float32, station: Float64) -> npt.NDArray[np.bool_]:
    buffer = depth_buffer(points, station, _SIGHT_CELL_DEG)
    return buffer.sees(points, np.full(len(points), 0.3, np.float32), margin_m=0.05)
