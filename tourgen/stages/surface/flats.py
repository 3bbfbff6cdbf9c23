"""Flats: the planes of walls, floors and boards, grown over *surfels*.

A surfel is the mean of a few neighbouring tangent planes. From the calmest one on, those that hang
together with it and lie on one plane are taken, and the plane is fitted anew (region growing with
refits: Poppinga, Vaskevicius, Birk and Pathak 2008).

What bends is no plane: a patch is refused where a paraboloid fits it better by more than the noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.geometry import Float64, Int32
from tourgen.neighbours import Neighbours
from tourgen.stages.mesh_arrays import components
from tourgen.stages.surface.tangent_planes import TangentPlanes
from tourgen.symmetric import axes_of
from tourgen.voxels import grouped, voxels

_SURFEL = 2.5
"""Edge of the voxels whose tangent planes are averaged, in spacings."""
_COHERENT = 0.985
"""Length of the mean of a surfel's normals, at least."""
_NEIGHBOURS = 12
_REACH = 2.2
"""How far apart neighbouring surfels may lie, in their edges."""
_ALIKE = np.cos(np.radians(9.0))
_OFF = 1.6
"""How far off its plane a surfel may lie, in standard deviations of the points."""
_LEAST_AREA_M2 = 0.004
_LEAST_SURFELS = 6
BENT = 0.45
"""What a paraboloid may explain of a patch, root mean square, in standard deviations."""
_NARROW = 0.5
"""Standard deviation across of a strip's surfels, in their edges, at most."""
_ROUNDS = 4

Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Surfels:
    """Means of neighbouring tangent planes.

    Attributes:
        points: (m, 3) metres.
        normals: (m, 3) unit.
        edge_m: Of the voxels.
        of: (n,) number of the surfel that each tangent plane is of, -1 where of none.
    """

    points: Float64
    normals: Float64
    edge_m: float
    of: Ints


@dataclass(frozen=True, slots=True)
class Flats:
    """Planes of a room, and what lies on them.

    Attributes:
        normals: (p, 3) unit, toward the free space.
        offsets_m: (p,) along them.
        narrow: (p,) mask of those no wider than a surfel: a board's edge, or a rail taken for one.
        of: (n,) number of the plane that each tangent plane lies on, -1 where on none.
    """

    normals: Float64
    offsets_m: Float64
    narrow: Mask
    of: Ints

    @property
    def broad(self) -> Mask:
        """(n,) which tangent planes lie on a flat that is no mere strip."""
        return np.asarray((self.of >= 0) & ~np.append(self.narrow, True)[self.of])


def surfels_of(planes: TangentPlanes, spacing_m: float) -> Surfels:
    """Mean tangent plane of each voxel and main direction of its normals.

    Args:
        planes: n tangent planes.
        spacing_m: Distance between neighbouring points in the middle of the room.
    """
    edge_m = _SURFEL * spacing_m
    axis = np.abs(planes.normals).argmax(axis=1)
    side = 2 * axis + (np.take_along_axis(planes.normals, axis[:, None], 1)[:, 0] > 0)
    order, starts = grouped(voxels(planes.points, edge_m)[0] * 6 + side)
    count = np.diff(starts, append=len(order))
    group = np.empty(len(order), np.int64)
    group[order] = np.repeat(np.arange(len(starts)), count)
    point, normal = (
        np.stack([np.bincount(group, values[:, k]) for k in range(3)], axis=1) / count[:, None]
        for values in (planes.points, planes.normals)
    )
    length = np.linalg.norm(normal, axis=1)
    sound = (length > _COHERENT) & (count > 1)
    number = np.where(sound, np.cumsum(sound) - 1, -1)
    return Surfels(point[sound], normal[sound] / length[sound, None], edge_m, number[group])


def grown(surfels: Surfels, noise_m: float) -> Flats:
    """Grow planes, in each part of the surface that runs on without a crease for itself.

    Args:
        surfels: m of them.
        noise_m: Standard deviation of the points along the surface's normal.

    Returns:
        The flats, with the surfels on them.
    """
    first, second, calm = _neighbours(surfels, _OFF * noise_m)
    count = len(surfels.points)
    part = components(np.stack([first, second], axis=1), count)
    parts = int(part.max(initial=-1)) + 1
    order = np.argsort(part, kind="stable")
    starts = np.searchsorted(part[order], np.arange(parts + 1))
    of_pair = np.argsort(part[first], kind="stable")
    pair_starts = np.searchsorted(part[first][of_pair], np.arange(parts + 1))
    number = np.empty(count, np.int64)
    label = np.full(count, -1)
    normals: list[Float64] = []
    offsets: list[float] = []
    narrow: list[bool] = []
    for k in range(parts):
        own = order[starts[k] : starts[k + 1]]
        if not _large(len(own), surfels.edge_m):
            continue
        number[own] = np.arange(len(own))
        pairs = of_pair[pair_starts[k] : pair_starts[k + 1]]
        region = _Region(
            surfels.points[own], surfels.normals[own], number[first[pairs]], number[second[pairs]]
        )
        for members, normal, offset in region.planes(calm[own], surfels.edge_m, noise_m):
            label[own[members]] = len(normals)
            normals.append(normal)
            offsets.append(offset)
            apart = region.points[members] - region.points[members].mean(axis=0)
            width_m = np.linalg.svd(apart, compute_uv=False)
            narrow.append(bool(width_m[1] < _NARROW * surfels.edge_m * np.sqrt(len(members))))
    return Flats(
        np.reshape(normals, (-1, 3)), np.asarray(offsets, float), np.asarray(narrow, bool), label
    )


def _neighbours(surfels: Surfels, off_m: float) -> tuple[Ints, Ints, Float64]:
    """Pairs of surfels that may be of one plane, sorted, and how much those of each differ."""
    points, normals = surfels.points, surfels.normals
    count = _NEIGHBOURS + 1
    near, _ = Neighbours.of(points, count).nearest(points, count, _REACH * surfels.edge_m)
    return _alike(points, normals, near[:, 1:], 2 * off_m)


@compiled
def _alike(
    points: Float64, normals: Float64, near: Int32, most_m: float
) -> tuple[Ints, Ints, Float64]:
    """See ``_neighbours``; a loop, since whole arrays of pairs took most memory of a build."""
    first, second = np.empty(near.size, np.int64), np.empty(near.size, np.int64)
    calm = np.full(len(points), np.inf)
    found = 0
    for i in range(len(points)):
        number, differ = 0, 0.0
        for j in near[i]:
            if j < 0:
                break
            turn = off = 0.0
            for k in range(3):
                turn += normals[i, k] * normals[j, k]
                off += (points[j, k] - points[i, k]) * (normals[i, k] + normals[j, k])
            if turn > _ALIKE and abs(off) / 2 < most_m:
                first[found], second[found] = i, j
                found += 1
                number += 1
                differ += 1 - turn
        if number > _NEIGHBOURS // 4:
            calm[i] = differ / number
    return first[:found].copy(), second[:found].copy(), calm


def _large(count: int, edge_m: float) -> bool:
    return count >= _LEAST_SURFELS and count * edge_m**2 >= _LEAST_AREA_M2


@dataclass(frozen=True, slots=True)
class _Region:
    """Surfels that hang together, and which pairs of them do.

    Attributes:
        points: (m, 3) metres.
        normals: (m, 3) unit.
        first: (e,) sorted, one of each pair, either way round.
        second: (e,) the other.
    """

    points: Float64
    normals: Float64
    first: Ints
    second: Ints

    def planes(
        self, calm: Float64, edge_m: float, noise_m: float
    ) -> Iterator[tuple[Ints, Float64, float]]:
        """The surfels, normal and offset of each plane, from the calmest surfel on."""
        count = len(calm)
        free = np.ones(count, bool)
        untried = np.isfinite(calm)
        starts = np.searchsorted(self.first, np.arange(count + 1))
        queue, mark = np.empty(count, np.int64), np.zeros(count, np.int64)
        rounds = 0
        for seed in np.argsort(calm, kind="stable"):
            if not (untried[seed] and free[seed]):
                continue
            near = self.second[starts[seed] : starts[seed + 1]]
            members = np.append(near[free[near]], seed)
            for _ in range(_ROUNDS):
                rounds += 1
                found = _hanging(
                    self.points,
                    self.normals,
                    starts,
                    self.second,
                    *self._fitted(members),
                    seed,
                    free,
                    _OFF * noise_m,
                    rounds,
                    queue,
                    mark,
                )
                members = queue[:found].copy()
                if len(members) < _LEAST_SURFELS:
                    break
            untried[members] = untried[seed] = False
            if not _large(len(members), edge_m):
                continue
            normal, offset = self._fitted(members)
            if _bends(self.points[members], normal, offset, BENT * noise_m):
                continue
            free[members] = False
            yield members, normal, offset

    def _fitted(self, members: Ints) -> tuple[Float64, float]:
        """Unit normal and offset of the plane of some surfels, by least squares."""
        normal = np.empty(3)
        offset = _plane(self.points, self.normals, members, normal)
        return normal, offset


@compiled
def _plane(points: Float64, normals: Float64, members: Ints, normal: Float64) -> float:
    """Write the unit normal of some surfels' plane; its offset along it."""
    count = len(members)
    middle, mean = np.zeros(3), np.zeros(3)
    for i in members:
        middle += points[i]
        mean += normals[i]
    middle /= count
    normal[:] = mean / np.sqrt((mean * mean).sum())
    if count >= _LEAST_SURFELS:
        xx = xy = xz = yy = yz = zz = 0.0
        for i in members:
            x, y, z = points[i, 0] - middle[0], points[i, 1] - middle[1], points[i, 2] - middle[2]
            xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
            yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
        size, axes = np.empty(3), np.empty((3, 3))
        axes_of(xx, xy, xz, yy, yz, zz, size, axes)
        normal[:] = axes[0] if (axes[0] * mean).sum() > 0 else -axes[0]
    return float(middle[0] * normal[0] + middle[1] * normal[1] + middle[2] * normal[2])


@compiled
def _hanging(
    points: Float64,
    normals: Float64,
    starts: Ints,
    second: Ints,
    normal: Float64,
    offset: float,
    seed: int,
    free: Mask,
    off_m: float,
    rounds: int,
    queue: Ints,
    mark: Ints,
) -> int:
    """Write to ``queue`` the free surfels on a plane that hang together with the seed; how many."""
    found, done = 1, 0
    queue[0], mark[seed] = seed, rounds
    if not _on(points[seed], normals[seed], normal, offset, off_m):
        return found
    while done < found:
        i = queue[done]
        done += 1
        for j in second[starts[i] : starts[i + 1]]:
            if free[j] and mark[j] != rounds:
                mark[j] = rounds
                if _on(points[j], normals[j], normal, offset, off_m):
                    queue[found] = j
                    found += 1
    return found


@compiled
def _on(point: Float64, own: Float64, normal: Float64, offset: float, off_m: float) -> bool:
    """Whether a surfel lies on a plane and looks its way."""
    height = point[0] * normal[0] + point[1] * normal[1] + point[2] * normal[2] - offset
    alike = own[0] * normal[0] + own[1] * normal[1] + own[2] * normal[2]
    return bool(abs(height) < off_m and alike > _ALIKE)


def _bends(points: Float64, normal: Float64, offset: float, most_m: float) -> bool:
    """Whether a paraboloid explains of the heights over a plane more than the noise."""
    height = points @ normal - offset
    across = np.linalg.svd(normal[None])[2][1:]
    u, v = ((points - points.mean(axis=0)) @ across.T).T
    scale = max(float(np.abs([u, v]).max()), 1e-9)
    u, v = u / scale, v / scale
    terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1)
    found = terms @ np.linalg.lstsq(terms, height, rcond=None)[0]
    return bool(np.sqrt(np.square(found).mean()) > most_m)
