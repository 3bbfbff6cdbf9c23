"""Tubes: what is drawn of rods, straight or bent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Float64, Mesh

RADII_M = (0.005, 0.025)
"""The thinnest and the thickest rod."""
ON = 3.0
"""How far off its tube a point of a rod may lie, in deviations."""
WIDTH_TRUST = 0.5
"""By what part the width of the points that tell a rod may be wrong."""
_FREE = 1.1
"""A radius as near to the thinnest or the thickest is none that the points ask for."""
_MEMBERS = 0.7
"""The part of the points that must lie on the tube."""
_OFF = 1.6
"""How far off it they may lie, root mean square, in deviations."""
_AROUND = 16

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Rod:
    """A tube about a line.

    Attributes:
        axis: (k, 3) places of the line in a row, metres; two where it is straight.
        radius_m: Of the tube.
    """

    axis: Float64
    radius_m: float

    @property
    def length_m(self) -> float:
        """Of the axis."""
        return float(self._along_m[-1])

    @property
    def _along_m(self) -> Float64:
        """(k,) how far along each place of the axis lies."""
        steps = np.linalg.norm(np.diff(self.axis, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def places(self, along_m: Float64) -> Float64:
        """(n, 3) places of the axis; beyond its ends it goes on straight."""
        at_m = self._along_m
        piece = np.clip(np.searchsorted(at_m, along_m) - 1, 0, len(at_m) - 2)
        share = (along_m - at_m[piece]) / (at_m[piece + 1] - at_m[piece])
        start, stop = self.axis[piece], self.axis[piece + 1]
        return np.asarray(start + share[:, None] * (stop - start))

    def cut(self, from_m: float, to_m: float) -> Rod:
        """The rod between two places of its axis, or as far as beyond its ends."""
        at_m = self._along_m[1:-1]
        inner = self.axis[1:-1][(at_m > from_m) & (at_m < to_m)]
        ends = self.places(np.array([from_m, to_m]))
        return Rod(np.concatenate([ends[:1], inner, ends[1:]]), self.radius_m)

    def of(self, points: Float32 | Float64) -> tuple[Float64, Float64]:
        """How far along the axis each of (n, 3) points lies, and how far off the tube.

        Both go on straight beyond the ends.
        """
        near = np.zeros(len(points), np.int64)
        if len(self.axis) > 2:
            near[:] = cKDTree(self.axis).query(points)[1]
        along_m, off_m = np.empty((2, len(points)))
        _lie(points, self.axis, self._along_m, near, along_m, off_m)
        return along_m, off_m - self.radius_m


@compiled
def _lie(
    points: Float32 | Float64,
    axis: Float64,
    at_m: Float64,
    near: Ints,
    along_m: Float64,
    off_m: Float64,
) -> None:
    """Write where points lie along an axis, and how far off, by the pieces at their nearest places.

    Args:
        points: (n, 3) metres.
        axis: (k, 3)
        at_m: (k,) how far along each place of the axis lies.
        near: (n,) the place nearest to each point.
        along_m: (n,) is filled.
        off_m: (n,) is filled.
    """
    last = len(axis) - 2
    for i in range(len(points)):
        off_m[i] = np.inf
        for piece in range(max(near[i] - 1, 0), min(near[i], last) + 1):
            length = at_m[piece + 1] - at_m[piece]
            reach = square = 0.0
            for k in range(3):
                apart = points[i, k] - axis[piece, k]
                square += apart * apart
                reach += apart * (axis[piece + 1, k] - axis[piece, k]) / length
            held = reach if piece == 0 else max(reach, 0.0)
            held = held if piece == last else min(held, length)
            off = np.sqrt(max(square - reach * reach, 0.0) + (reach - held) ** 2)
            if off < off_m[i]:
                off_m[i], along_m[i] = off, at_m[piece] + held


def fits(radius_m: float, off_m: Float64, noise_m: float) -> bool:
    """Whether points are those of a rod, by how far off its tube each of them lies."""
    low, high = RADII_M
    on = off_m[np.abs(off_m) < ON * noise_m]
    return bool(
        low * _FREE < radius_m < high / _FREE
        and len(on) >= _MEMBERS * len(off_m)
        and np.sqrt(np.square(on).mean()) < _OFF * noise_m
    )


def behind(axis: Float64, normals: Float32) -> Float64:
    """(2, 3) unit, square to an axis: away from the side that was seen, and beside that."""
    across = np.linalg.svd(axis[None])[2][1:]
    inward = -(normals.mean(axis=0) @ across.T)
    inward /= max(float(np.linalg.norm(inward)), 1e-9)
    return np.asarray(np.array([inward, (-inward[1], inward[0])]) @ across)


def with_tubes(mesh: Mesh, found: tuple[Rod, ...], step_m: float) -> Mesh:
    """A mesh, and rods as closed tubes beside it.

    Args:
        mesh: Faces counter-clockwise seen from the free space.
        found: Metres from the mesh's origin.
        step_m: Length of a tube's faces.
    """
    tubes = [_tube(rod, step_m) for rod in found]
    counts = np.cumsum([len(mesh.vertices)] + [len(vertices) for vertices, _ in tubes])
    return Mesh(
        mesh.origin,
        np.concatenate([mesh.vertices, *(vertices for vertices, _ in tubes)]),
        np.concatenate(
            [mesh.faces]
            + [faces + np.int32(k) for (_, faces), k in zip(tubes, counts, strict=False)]
        ),
    )


def _tube(rod: Rod, step_m: float) -> tuple[Float32, npt.NDArray[np.int32]]:
    """Vertices and faces of a closed tube."""
    rings = max(2, int(np.ceil(rod.length_m / step_m)) + 1)
    centre = rod.places(np.linspace(0, rod.length_m, rings))
    angle = np.arange(_AROUND) * (2 * np.pi / _AROUND)
    circle = rod.radius_m * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    around = centre[:, None] + np.einsum("ak,rkj->raj", circle, _across(centre))
    vertices = np.concatenate([around.reshape(-1, 3), centre[[0, -1]]])
    low = np.arange(_AROUND)
    high = np.roll(low, -1)
    wall = np.concatenate(
        [np.stack([low, high, high + _AROUND]), np.stack([low, high + _AROUND, low + _AROUND])], 1
    ).T
    walls = (wall[None] + _AROUND * np.arange(rings - 1)[:, None, None]).reshape(-1, 3)
    bottom, top = rings * _AROUND, rings * _AROUND + 1
    last = (rings - 1) * _AROUND
    caps = np.concatenate(
        [
            np.stack([high, low, np.full(_AROUND, bottom)], axis=1),
            np.stack([last + low, last + high, np.full(_AROUND, top)], axis=1),
        ]
    )
    return vertices.astype(np.float32), np.concatenate([walls, caps]).astype(np.int32)


def _across(centre: Float64) -> Float64:
    """(r, 2, 3) two directions square to a line at each of its (r, 3) places, without twist."""
    ways = np.gradient(centre, axis=0)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    first = np.linalg.svd(ways[:1])[2][1]
    found = []
    for way in ways:
        first = first - (first @ way) * way
        first /= np.linalg.norm(first)
        found.append((first, np.cross(way, first)))
    return np.array(found)
