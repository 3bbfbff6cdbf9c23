"""The field: how far in front of the nearest tangent planes places lie; see ``signed_distance``."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from tourgen.compiled import compiled
from tourgen.extent import extent
from tourgen.geometry import Float32, Int32
from tourgen.neighbours import Grid, Neighbours, nearest_to
from tourgen.sorting import distinct
from tourgen.stages.free_space import FreeSpace
from tourgen.stages.surface.marching_cubes import Keys, corner_of, key_of
from tourgen.stages.surface.tangent_planes import TangentPlanes
from tourgen.threads import in_parts

_PART = 1 << 11
_ACROSS = 0.1
"""Share of the weight across a crease from which on it is one."""
_DENSEST, _SPARSEST = 0.5, 2.0
"""The part of the room's spacing that a region's own counts for, at least and at most."""
_FADE = 0.3
"""Last part of a plane's reach over which another surface may take over."""
_BARE = 0.4
"""From this part of a plane's reach on beams may contradict it: its rim is not known better."""
_DEEPEST = np.float32(3)
"""Cells off the surface up to which a distance is told where another surface is cut back: told
farther, it would jump from deep behind that to in front of the cut, and leave it open."""
_FARTHEST = 0.2
"""How far from every point a surface may go on to close a gap, in the extent of the room. Of a
scene that is open itself, a wall alone, and of what is seen through a window, it would go on
without end."""
_STRAY_PERCENT = 1.0
"""Of the points on either side, that may lie far outside the room."""


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
        free: FreeSpace | None,
    ) -> None:
        own_m = np.clip(planes.spacing_m, _DENSEST * spacing_m, _SPARSEST * spacing_m)
        reach_m = np.float32(reach) * own_m + np.float32(planes.noise_m)
        self._alike = np.float32(np.cos(np.radians(2 * crease_deg)))
        self._count = min(blend + 1, len(planes.points))
        self._free, self._planes = free, planes
        self._nearest = Neighbours.of(planes.points, 1)
        around = Neighbours.of(planes.points, self._count)
        order = around.number
        self._grid, self._normals, self._reach_m = (
            around.grid,
            planes.normals[order],
            reach_m[order],
        )
        self.cell_m = np.float32(cell_m)
        low, high = extent(planes.points)
        within = np.percentile(planes.points, [_STRAY_PERCENT, 100 - _STRAY_PERCENT], axis=0)
        widest_m = self._reach_m.max()
        self._most_m = widest_m + np.float32(_FARTHEST * np.ptp(within, axis=0).max())
        extent_m = np.float32((high - low).max())
        self.low = low - (widest_m + 2 * self.cell_m + np.float32(_FARTHEST) * extent_m)
        self.seeds = self.cells(planes.points)

    def places(self, key: Keys) -> Float32:
        """(n, 3) of (n,) corners, metres."""
        return np.asarray(corner_of(key).astype(np.float32) * self.cell_m + self.low)

    def cells(self, places: Float32) -> Keys:
        """Keys of the cells that hold places, each once."""
        return distinct(key_of(((places - self.low) / self.cell_m).astype(np.int32)))

    def distance(self, key: Keys) -> Float32:
        """(n,) distances at (n,) corners, NaN where unknown."""
        places = self.places(key)
        distance, far, _ = self._at(places, False)
        distance[~(far < 1)] = np.nan
        return self._carved(places, distance, far)

    def carried_on(self, key: Keys, beyond: Beyond) -> Float32:
        """The same, fading into the distance to another surface where it becomes unknown."""
        places = self.places(key)
        distance, far, _ = self._at(places, False)
        trust = np.clip((1 - far) / np.float32(_FADE), 0, 1)
        rest = trust < 1
        most_m = _DEEPEST * self.cell_m
        theirs = np.clip(beyond.distance(places[rest]), -most_m, most_m)
        distance[rest] = trust[rest] * distance[rest] + (1 - trust[rest]) * theirs
        return self._carved(places, distance, far)

    def _carved(self, places: Float32, distance: Float32, far: Float32) -> Float32:
        """(n,) distances, positive too where beams went on through what the planes only claim,
        and unknown behind what no point is near to: there it ends."""
        at = np.flatnonzero((far > _BARE) & (distance <= 0))
        nearest, _ = self._nearest.nearest(places[at], 1, float(self._most_m))
        bare = nearest[:, 0] < 0
        distance[at[bare]] = np.nan
        if self._free is None:
            return distance
        at, nearest = at[~bare], nearest[~bare]
        depth = self._free.depth_m(places[at], self._planes.normals[nearest[:, 0]])
        distance[at] = np.maximum(distance[at], np.minimum(depth, _DEEPEST * self.cell_m))
        return distance

    def normal(self, places: Float32) -> Float32:
        """(n, 3) unit normals at (n, 3) places on the surface, NaN where unknown.

        Of that side of a crease on whose planes the place lies.
        """
        _, _, normal = self._at(places, True)
        return normal

    def _at(self, places: Float32, looks: bool) -> tuple[Float32, Float32, Float32]:
        """(n,) distances, (n,) how far off the nearest plane's point, in its reach; normals."""
        count = len(places)
        distance, far = np.empty((2, count), np.float32)
        normal = np.empty((count if looks else 0, 3), np.float32)

        def tell(first: int, last: int) -> None:
            _tell(
                self._grid,
                self._normals,
                self._reach_m,
                self._count,
                self._alike,
                places[first:last],
                distance[first:last],
                far[first:last],
                normal[first:last],
            )

        in_parts(tell, count, _PART)
        return distance, far, normal


@compiled
def _tell(
    grid: Grid,
    normals: Float32,
    reach_m: Float32,
    count: int,
    alike: np.float32,
    places: Float32,
    distance: Float32,
    far: Float32,
    normal: Float32,
) -> None:
    """Write what the nearest planes tell of some places; normals where there is room for them."""
    points = grid[0]
    # Farther off, either the height over a plane or the way to its point is more than its reach.
    lone = 2 * reach_m.max() ** 2
    index, square = np.empty(count, np.int32), np.empty(count, np.float32)
    height = np.empty(count, np.float32)
    mine, others = np.empty(count, np.float32), np.empty(count, np.float32)
    normal_here, normal_across = np.empty(3, np.float32), np.empty(3, np.float32)
    for i in range(len(places)):
        x, y, z = places[i, 0], places[i, 1], places[i, 2]
        if nearest_to(grid, x, y, z, np.float32(np.inf), lone, index, square) < count:
            distance[i], far[i] = 0, np.inf
            if len(normal):
                normal[i] = np.nan
            continue
        first = index[0]
        last = max(square[count - 1], np.float32(1e-18))
        total = rest = rise = np.float32(0)
        for k in range(count):
            j = index[k]
            nx, ny, nz = normals[j, 0], normals[j, 1], normals[j, 2]
            height[k] = (x - points[j, 0]) * nx + (y - points[j, 1]) * ny + (z - points[j, 2]) * nz
            weight = (1 - square[k] / last) ** 2
            if k == 0:
                weight += np.float32(1e-6)  # all may be equally far
            total += weight
            ax, ay, az = normals[first, 0], normals[first, 1], normals[first, 2]
            if ax * nx + ay * ny + az * nz > alike:
                mine[k], others[k] = weight, 0
            else:
                mine[k], others[k] = 0, weight
                rest += weight
                away = (ax - nx) * (points[j, 0] - points[first, 0])
                away += (ay - ny) * (points[j, 1] - points[first, 1])
                rise += weight * (away + (az - nz) * (points[j, 2] - points[first, 2]))
        foot = max(square[0] - height[0] ** 2, height[0] ** 2)
        far[i] = np.sqrt(foot) / reach_m[first]
        here = _over_round(points, normals, index, height, mine, x, y, z, normal_here)
        share = min(rest / total / np.float32(_ACROSS), np.float32(1))
        across = here
        if rest > 0:
            across = _over_round(points, normals, index, height, others, x, y, z, normal_across)
        # At an edge or a thin wall a place is in front of one side, in a corner of both.
        both = max(here, across) if rise < 0 else min(here, across)
        distance[i] = here + share * (both - here)
        if len(normal):
            beyond = share > 0 and abs(across) < abs(here)
            normal[i] = normal_across if beyond else normal_here
            if not far[i] < 1:
                normal[i] = np.nan


@compiled
def _over_round(
    points: Float32,
    normals: Float32,
    index: Int32,
    height: Float32,
    weight: Float32,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    mean: Float32,
) -> np.float32:
    """Mean height over planes, along the middle between each plane's normal and their mean.

    Planes that touch a sphere lie outside it; so taken, heights over them are those over it. The
    mean normal is written to ``mean``.
    """
    total = mx = my = mz = np.float32(0)
    for k, j in enumerate(index):
        w = weight[k]
        total += w
        mx, my, mz = mx + w * normals[j, 0], my + w * normals[j, 1], mz + w * normals[j, 2]
    length = max(np.sqrt(mx * mx + my * my + mz * mz), np.float32(1e-9))
    mx, my, mz = mx / length, my / length, mz / length
    mean[0], mean[1], mean[2] = mx, my, mz
    over = np.float32(0)
    for k, j in enumerate(index):
        offset = mx * (x - points[j, 0]) + my * (y - points[j, 1]) + mz * (z - points[j, 2])
        over += weight[k] * (height[k] + offset)
    return over / (2 * max(total, np.float32(1e-9)))


class Beyond(Protocol):
    """A surface that goes on where the points end."""

    def distance(self, places: Float32) -> Float32:
        """(n,) metres that each of (n, 3) places lies in front of it."""
        ...
