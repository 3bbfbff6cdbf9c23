"""Winding: on which side of an open surface a place lies, and about how far from where it closes.

The generalised winding number of a surface is the solid angle that it fills, of 4 pi (Jacobson,
Kavan and Sorkine-Hornung 2013). It jumps by one across the surface and is harmonic all around, so
the places half way between its two sides continue the surface across its gaps: what the Poisson
solve of an indicator comes to where it has no points. But it is a sum over faces and no solve: of
any size, told at the places that are asked alone, by as many threads as there are.

The sum goes over a tree of the faces, those far off taken together with their first and second
moments (Barill, Dickson, Schmidt, Levin and Jacobson 2018).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.extent import extent
from tourgen.geometry import Float32, Float64, Int32, Mesh
from tourgen.sorting import order_of
from tourgen.threads import in_parts

_FAR = 2.5
"""Radii off a group of faces from which on it is taken as a whole."""
_BITS = 20
"""Of a coordinate in the order of the faces."""
_STACK = 8 * _BITS
_APART = 2
"""Levels of the tree above its leaves, on which is told what lies half way."""
_MOST = 0.5
"""How far that may lie off its median."""
_PART = 1 << 9
_LEAST = 1e-12
Keys = npt.NDArray[np.int64]


class _Tree(NamedTuple):
    """An octree of the cells that hold faces, nodes level by level, leaves first, the root last.

    Attributes:
        vertices: (v, 3) metres.
        faces: (f, 3) sorted by leaf.
        levels: (l + 1,) the first node of each level, and the one after the root.
        first: (n,) of each node its first child, or its first face.
        last: (n,) the one after its last.
        node: (n, 16) of each node the middle of its area, its radius, the sum of area times
            normal, and the sum of offset from the middle times that.
        area: (n,) of each node.
        level: (n,) what lies half way between both sides about each node, as a mean.
    """

    vertices: Float32
    faces: Int32
    levels: Int32
    first: Int32
    last: Int32
    node: Float32
    area: Float32
    level: Float32


class Winding:
    """An open surface that can be asked where it would close."""

    def __init__(self, mesh: Mesh, cell_m: float) -> None:
        """Of a mesh of at least one face, counter-clockwise seen from the free space.

        Args:
            mesh: It.
            cell_m: Edge of cells that hold a few faces.
        """
        self._tree = _tree(mesh, cell_m)
        self._find_levels()

    def distance(self, places: Float32) -> Float32:
        """(n,) metres, about, that each of (n, 3) places lies in front of where it closes."""
        side, level, slope = self._told(places)
        return np.asarray((side - level) / np.maximum(slope, _LEAST), np.float32)

    def _find_levels(self) -> None:
        """Tell what lies half way between both sides, everywhere."""
        tree = self._tree
        level = min(_APART, len(tree.levels) - 2)
        asked = np.arange(*tree.levels[level : level + 2])
        face = asked
        for _ in range(level + 1):
            face = tree.first[face].astype(np.int64)
        corners = tree.vertices[tree.faces[face]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        double = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), _LEAST)
        before = corners.mean(axis=1) + 0.01 * normal / np.sqrt(double)
        half_way = self._told(before.astype(np.float32))[0] - 0.5
        middle = float(np.median(half_way))
        half_way = np.clip(half_way, middle - _MOST, middle + _MOST)
        tree.level[asked] = half_way
        _spread(asked[-1], tree.levels[1], tree.first, tree.last, tree.area, tree.level)

    def _told(self, places: Float32) -> tuple[Float64, Float64, Float64]:
        """The winding number at some places, what of it lies half way there, and how steep it is,
        a metre."""
        told = np.empty((3, len(places)))

        def tell(first: int, last: int) -> None:
            _tell(*self._tree, places[first:last], told[:, first:last])

        in_parts(tell, len(places), _PART)
        side, level, slope = told
        return side, level, slope


def _tree(mesh: Mesh, cell_m: float) -> _Tree:
    low, high = extent(mesh.vertices)
    cell_m = max(cell_m, float((high - low).max()) / (2**_BITS - 1))
    key = _curve(mesh.vertices, mesh.faces, low, np.float32(cell_m))
    order = order_of(key)
    key, faces = key[order], mesh.faces[order]
    before = 0
    firsts: list[Keys] = []
    lasts: list[Keys] = []
    while not firsts or len(key) > 1:
        begin = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
        firsts.append(begin + before)
        lasts.append(np.append(begin[1:], len(key)) + before)
        before += len(key) if len(firsts) > 1 else 0
        key = key[begin] >> 3
    first, last = (np.concatenate(each).astype(np.int32) for each in (firsts, lasts))
    levels = np.cumsum([0, *map(len, firsts)]).astype(np.int32)
    node, area = np.zeros((len(first), 16), np.float32), np.zeros(len(first), np.float32)
    _gather(mesh.vertices, faces, levels[1], first, last, node, area)
    return _Tree(mesh.vertices, faces, levels, first, last, node, area, np.zeros_like(area))


@compiled
def _spread(
    end: int, leaves: int, first: Int32, last: Int32, area: Float32, level: Float32
) -> None:
    """Give what the nodes of one level have to all below, and its mean to all above."""
    for i in range(end + 1, len(first)):
        total = 0.0
        for child in range(first[i], last[i]):
            total += area[child] * level[child]
        level[i] = total / max(area[i], np.float32(_LEAST))
    for i in range(end, leaves - 1, -1):
        for child in range(first[i], last[i]):
            level[child] = level[i]


@compiled
def _curve(vertices: Float32, faces: Int32, low: Float32, cell_m: np.float32) -> Keys:
    """(f,) where the cell of each face comes along Morton's curve."""
    key = np.zeros(len(faces), np.int64)
    for i in range(len(faces)):
        for axis in range(3):
            middle = np.float32(0)
            for corner in range(3):
                middle += (vertices[faces[i, corner], axis] - low[axis]) / 3
            cell = np.int64(middle / cell_m)
            for bit in range(_BITS):
                key[i] |= (cell >> bit & 1) << (3 * bit + axis)
    return key


@compiled
def _gather(
    vertices: Float32,
    faces: Int32,
    leaves: int,
    first: Int32,
    last: Int32,
    node: Float32,
    area: Float32,
) -> None:
    """Fill in the nodes of a tree."""
    way, middle, moment = np.empty(3), np.empty(3), np.empty((3, 3))
    for i in range(len(node)):
        for turn in range(2):  # the middle is told before what is about it
            if turn:
                node[i, :3] /= max(area[i], np.float32(_LEAST))
            for k in range(first[i], last[i]):
                moment[:] = 0
                if i < leaves:
                    size, reach = _face(vertices, faces[k], way, middle)
                else:
                    size, reach = float(area[k]), float(node[k, 3])
                    for axis in range(3):
                        middle[axis], way[axis] = node[k, axis], node[k, 4 + axis]
                        for other in range(3):
                            moment[axis, other] = node[k, 7 + 3 * axis + other]
                if not turn:
                    area[i] += size
                    for axis in range(3):
                        node[i, axis] += size * middle[axis]
                        node[i, 4 + axis] += way[axis]
                    continue
                square = 0.0
                for axis in range(3):
                    middle[axis] -= node[i, axis]
                    square += middle[axis] ** 2
                    for other in range(3):
                        more = moment[axis, other] + middle[axis] * way[other]
                        node[i, 7 + 3 * axis + other] += more
                node[i, 3] = max(node[i, 3], np.sqrt(square) + reach)


@compiled
def _face(vertices: Float32, face: Int32, way: Float64, middle: Float64) -> tuple[float, float]:
    """Area of a face and how far its corners lie from its middle; its normal, as long as the area
    is, and its middle are written."""
    a, b, c = vertices[face[0]], vertices[face[1]], vertices[face[2]]
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        one = (np.float64(b[i]) - a[i]) * (np.float64(c[j]) - a[j])
        other = (np.float64(b[j]) - a[j]) * (np.float64(c[i]) - a[i])
        way[axis] = (one - other) / 2
        middle[axis] = (np.float64(a[axis]) + b[axis] + c[axis]) / 3
    reach = 0.0
    for corner in (a, b, c):
        square = 0.0
        for axis in range(3):
            square += (corner[axis] - middle[axis]) ** 2
        reach = max(reach, square)
    return np.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2), np.sqrt(reach)


@compiled
def _tell(
    vertices: Float32,
    faces: Int32,
    levels: Int32,
    first: Int32,
    last: Int32,
    node: Float32,
    area: Float32,
    level: Float32,
    places: Float32,
    told: Float64,
) -> None:
    """Write of some places what ``Winding`` has to tell."""
    stack, way, middle = np.empty(_STACK, np.int64), np.empty(3), np.empty(3)
    for i in range(len(places)):
        px, py, pz = np.float64(places[i, 0]), np.float64(places[i, 1]), np.float64(places[i, 2])
        total = gx = gy = gz = weight = mean = 0.0
        stack[0] = len(node) - 1
        height = 1
        while height:
            height -= 1
            number = stack[height]
            n = node[number]
            x, y, z = n[0] - px, n[1] - py, n[2] - pz
            square = x * x + y * y + z * z
            if square > (_FAR * n[3]) ** 2:
                inverse = 1 / square
                near = area[number] * inverse * inverse * inverse
                weight, mean = weight + near, mean + near * level[number]
                cube = inverse * np.sqrt(inverse)
                along = n[4] * x + n[5] * y + n[6] * z
                steep = 3 * along * inverse
                gx += cube * (n[4] - steep * x)
                gy += cube * (n[5] - steep * y)
                gz += cube * (n[6] - steep * z)
                spread = x * (n[7] * x + n[8] * y + n[9] * z)
                spread += y * (n[10] * x + n[11] * y + n[12] * z)
                spread += z * (n[13] * x + n[14] * y + n[15] * z)
                total -= cube * (along + n[7] + n[11] + n[15] - 3 * spread * inverse)
            elif number >= levels[1]:
                for child in range(first[number], last[number]):
                    stack[height] = child
                    height += 1
            else:
                for k in range(first[number], last[number]):
                    size, _ = _face(vertices, faces[k], way, middle)
                    total -= _solid_angle(vertices, faces[k], px, py, pz)
                    x, y, z = middle[0] - px, middle[1] - py, middle[2] - pz
                    inverse = 1 / (x * x + y * y + z * z + size + _LEAST)
                    near = size * inverse * inverse * inverse
                    weight, mean = weight + near, mean + near * level[number]
                    cube = inverse * np.sqrt(inverse)
                    steep = 3 * (way[0] * x + way[1] * y + way[2] * z) * inverse
                    gx += cube * (way[0] - steep * x)
                    gy += cube * (way[1] - steep * y)
                    gz += cube * (way[2] - steep * z)
        told[0, i] = total / (4 * np.pi)
        told[1, i] = mean / max(weight, _LEAST)
        told[2, i] = np.sqrt(gx * gx + gy * gy + gz * gz) / (4 * np.pi)


@compiled
def _solid_angle(vertices: Float32, face: Int32, px: float, py: float, pz: float) -> float:
    """Of a face from a place, positive seen from behind (Van Oosterom and Strackee 1983)."""
    u, v, w = vertices[face[0]], vertices[face[1]], vertices[face[2]]
    ax, ay, az = u[0] - px, u[1] - py, u[2] - pz
    bx, by, bz = v[0] - px, v[1] - py, v[2] - pz
    cx, cy, cz = w[0] - px, w[1] - py, w[2] - pz
    a = np.sqrt(ax * ax + ay * ay + az * az)
    b = np.sqrt(bx * bx + by * by + bz * bz)
    c = np.sqrt(cx * cx + cy * cy + cz * cz)
    above = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    below = a * b * c + (ax * bx + ay * by + az * bz) * c
    below += (bx * cx + by * cy + bz * cz) * a + (cx * ax + cy * ay + cz * az) * b
    return 2 * float(np.arctan2(above, below))
