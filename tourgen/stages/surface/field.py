"""The field: how far in front of the nearest tangent planes places lie; see ``signed_distance``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.geometry import Float32
from tourgen.stages.surface.growing import distinct
from tourgen.stages.surface.marching_cubes import Keys, corner_of, key_of
from tourgen.stages.surface.tangent_planes import TangentPlanes

_CHUNK = 1 << 17
_ACROSS = 0.1
"""Share of the weight across a crease from which on it is one."""
_DENSEST, _SPARSEST = 0.5, 2.0
"""The part of the room's spacing that a region's own counts for, at least and at most."""
_FADE = 0.3
"""Last part of a plane's reach over which another surface may take over."""
_MARGIN = 0.2
"""How far the grid goes on around the points, in their extent: a surface that closes gaps may."""


@dataclass(frozen=True, slots=True)
class _Sides:
    """The planes near n places, on the side of the nearest one and across a crease from it.

    Attributes:
        far: (n,) how far off the nearest plane's point lies, in its reach.
        here: (n,) distance to those like the nearest.
        across: (n,) distance to the others.
        normals: (2, n, 3) mean normal of either side, not of unit length.
        share: (n,) how much of a crease there is, 0 to 1.
        edge: (n,) whether it is an edge, no corner.
    """

    far: Float32
    here: Float32
    across: Float32
    normals: Float32
    share: Float32
    edge: npt.NDArray[np.bool_]


class Field:
    """The distance at the corners of a grid.

    Attributes:
        low: (3,) float32, place of the corner (0, 0, 0), metres.
        cell_m: Edge of a cell.
        seeds: Keys of the cells with points.
    """

    def __init__(
        self,
        planes: TangentPlanes,
        cell_m: float,
        spacing_m: float,
        reach: float,
        crease_deg: float,
        blend: int,
    ) -> None:
        own_m = np.clip(planes.spacing_m, _DENSEST * spacing_m, _SPARSEST * spacing_m)
        self._planes = planes
        self._reach_m = np.float32(reach) * own_m + np.float32(planes.noise_m)
        self._alike = np.float32(np.cos(np.radians(2 * crease_deg)))
        self._count = min(blend + 1, len(planes.points))
        self._tree = cKDTree(planes.points)
        self.cell_m = np.float32(cell_m)
        low = planes.points.min(axis=0)
        extent_m = np.float32((planes.points.max(axis=0) - low).max())
        self.low = low - self._reach_m.max() - 2 * self.cell_m - np.float32(_MARGIN) * extent_m
        self.seeds = self.cells(planes.points)

    def places(self, key: Keys) -> Float32:
        """(n, 3) of (n,) corners, metres."""
        return np.asarray(corner_of(key).astype(np.float32) * self.cell_m + self.low)

    def cells(self, places: Float32) -> Keys:
        """Keys of the cells that hold places, each once."""
        return distinct(key_of(((places - self.low) / self.cell_m).astype(np.int32)))

    def distance(self, key: Keys) -> Float32:
        """(n,) distances at (n,) corners, NaN where unknown."""
        parts = [self._distance(key[at : at + _CHUNK]) for at in range(0, len(key), _CHUNK)]
        return np.concatenate([np.empty(0, np.float32), *parts])

    def normal(self, places: Float32) -> Float32:
        """(n, 3) unit normals at (n, 3) places on the surface, NaN where unknown."""
        parts = [self._normal(places[at : at + _CHUNK]) for at in range(0, len(places), _CHUNK)]
        return np.concatenate([np.empty((0, 3), np.float32), *parts])

    def faded(self, key: Keys) -> tuple[Float32, Float32]:
        """(n,) distances at (n,) corners, and how much they are worth, 1 to 0 where unknown."""
        sides = self._sides(self.places(key))
        return _between(sides), np.clip((1 - sides.far) / np.float32(_FADE), 0, 1)

    def _distance(self, key: Keys) -> Float32:
        sides = self._sides(self.places(key))
        return np.where(sides.far < 1, _between(sides), np.float32(np.nan))

    def _normal(self, places: Float32) -> Float32:
        """Of that side of a crease on whose planes the place lies."""
        sides = self._sides(places)
        other = (sides.share > 0) & (np.abs(sides.across) < np.abs(sides.here))
        normal = np.where(other[:, None], sides.normals[1], sides.normals[0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-6)
        return np.where((sides.far < 1)[:, None], normal, np.float32(np.nan))

    def _sides(self, place: Float32) -> _Sides:
        rank = np.arange(1, self._count + 1)
        distance, index = self._tree.query(place, k=rank, workers=-1)
        away, near = np.asarray(distance, np.float32), np.asarray(index)
        points, normals = self._planes.points[near], self._planes.normals[near]
        offset = place[:, None] - points
        height = np.einsum("ikj,ikj->ik", offset, normals)
        reach_m = self._reach_m[near[:, 0]]
        foot_m2 = np.square(away[:, 0]) - np.square(height[:, 0])
        far = np.sqrt(np.maximum(foot_m2, np.square(height[:, 0]))) / reach_m
        weight = np.square(1 - np.square(away / np.maximum(away[:, -1:], 1e-9)))
        weight[:, 0] += np.float32(1e-6)  # all may be equally far
        weight /= weight.sum(axis=1, keepdims=True)
        alike = np.einsum("ij,ikj->ik", normals[:, 0], normals) > self._alike
        mine, others = weight * alike, weight * ~alike
        here, normal = _over_round(mine, normals, offset, height)
        across, beyond = _over_round(others, normals, offset, height)
        between = points - points[:, :1]
        rise = np.einsum("ij,ikj->ik", normals[:, 0], between)
        rise -= np.einsum("ikj,ikj->ik", normals, between)
        edge = (others * rise).sum(axis=1) < 0
        share = np.minimum(others.sum(axis=1) / np.float32(_ACROSS), 1)
        return _Sides(far, here, across, np.stack([normal, beyond]), share, edge)


def _between(sides: _Sides) -> Float32:
    """At an edge or a thin wall a place is in front of one side, in a corner of both."""
    here, across = sides.here, sides.across
    both = np.where(sides.edge, np.maximum(here, across), np.minimum(here, across))
    return np.asarray(here + sides.share * (both - here), np.float32)


def _over_round(
    weight: Float32, normals: Float32, offset: Float32, height: Float32
) -> tuple[Float32, Float32]:
    """Mean height over planes, along the middle between each plane's normal and their mean.

    Planes that touch a sphere lie outside it; so taken, heights over them are those over it.
    """
    mean = np.einsum("ik,ikj->ij", weight, normals)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-6)
    middle = (height + np.einsum("ij,ikj->ik", mean, offset)) / 2
    total = np.maximum(weight.sum(axis=1), 1e-9)
    return np.asarray((weight * middle).sum(axis=1) / total, np.float32), mean
