"""Marching cubes over the cells of a sparse grid (Lorensen and Cline 1987).

The published table leaves holes where two cells cut the face between them in different ways.
Here the table is made, not typed: on every face of the cube the surface cuts off the corners in
front of it, each alone, so that both cells of a face agree whatever lies around (the rule of
Montani, Scateni and Scopigno 1994). A cell with a corner of unknown value stays open.

The surface enters a cell as one or more loops of vertices on its edges. A loop is cut into a fan of
triangles, or, where normals tell that a crease runs through it, given a vertex on the crease: see
``features``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import product

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Float64, Int32, Mesh
from tourgen.stages.surface.features import fans, with_features

Keys = npt.NDArray[np.int64]

AXIS_BITS = 21
"""Bits of a grid coordinate in a key."""
STEPS = (1 << 2 * AXIS_BITS, 1 << AXIS_BITS, 1)
"""From a corner's key to the next one's along each axis."""
CELL_CORNERS: Keys = np.array(
    [(c & 1) * STEPS[0] + (c >> 1 & 1) * STEPS[1] + (c >> 2) for c in range(8)]
)
"""From a cell's lowest corner to each; bit 0 of a corner's number is x, 1 y, 2 z."""
AROUND: Keys = np.array([np.dot(way, STEPS) for way in product((-1, 0, 1), repeat=3)])
"""From a corner's key to those of all within a cell of it, itself included."""
_EDGES = [(c, c | 1 << axis) for axis in range(3) for c in range(8) if not c >> axis & 1]
_MOST_LOOPS = 4
_LONGEST_LOOP = 7
_NO_LOOPS: Int32 = np.empty((0, _LONGEST_LOOP), np.int32)
_LEAST_SHARE = 1e-3
"""How near a vertex may come to a corner, in edges: nearer, its faces have no area."""


def key_of(corner: npt.NDArray[np.integer]) -> Keys:
    """(..., 3) grid coordinates, from 0 to 2 million, as one sortable number each."""
    x, y, z = (corner[..., axis].astype(np.int64) for axis in range(3))
    return (x << 2 * AXIS_BITS) | (y << AXIS_BITS) | z


def corner_of(key: Keys) -> Int32:
    """(n, 3) grid coordinates of (n,) keys."""
    mask = (1 << AXIS_BITS) - 1
    parts = (key >> 2 * AXIS_BITS, key >> AXIS_BITS & mask, key & mask)
    return np.stack(parts, axis=-1).astype(np.int32)


def most_cells() -> int:
    """Along an axis, those beside the room included."""
    return (1 << AXIS_BITS) - 64


def marching_cubes(
    key: Keys,
    value: Float32,
    low: Float32,
    cell_m: float,
    origin: Float64,
    *,
    steepest: float = np.inf,
    normals: Callable[[Float32], Float32] | None = None,
) -> Mesh:
    """The surface where ``value`` is zero.

    Args:
        key: (n,) of the corners, sorted, each once; see ``key_of``.
        value: (n,) of each corner, positive in the free space; NaN where it is unknown.
        low: (3,) place of the corner (0, 0, 0), metres from ``origin``.
        cell_m: Edge of a cell.
        origin: Of the mesh.
        steepest: Cells along whose edges the value changes its sign by more, over the way, stay
            open: it jumps there.
        normals: Tells the unit normals, toward the free space, at (v, 3) places on the surface, NaN
            where they are unknown; with them creases are drawn sharp.

    Returns:
        Faces counter-clockwise seen from where the value is positive; cells share vertices.
        No faces where nothing crosses zero.
    """
    vertices, loops = _through_cells(key, value, low, cell_m, np.float32(steepest * cell_m))
    if normals is None:
        faces = fans(loops)
    else:
        vertices, faces = with_features(vertices, loops, normals(vertices), cell_m)
    used, faces = _used(faces, len(vertices))
    return Mesh(origin, vertices[used], faces)


def _through_cells(
    key: Keys, value: Float32, low: Float32, cell_m: float, most_m: np.float32
) -> tuple[Float32, Int32]:
    """Vertices on the edges of cells, and (l, 7) their numbers around each loop through a cell."""
    after = _next(key)
    vertex_of, vertices = _vertices(key, value, after, low, cell_m)
    asked = value, after, vertex_of, most_m, *_table()
    loops = np.empty((_cut(*asked, _NO_LOOPS), _LONGEST_LOOP), np.int32)
    _cut(*asked, loops)
    return vertices, loops


@compiled
def beside(key: Keys, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """(n,) which of (n,) sorted corners lie within a cell of a chosen one, these included."""
    found = np.zeros(len(key), np.bool_)
    for way in AROUND:
        j = 0
        for i in range(len(key)):
            if not chosen[i]:
                continue
            while j < len(key) and key[j] < key[i] + way:
                j += 1
            if j < len(key) and key[j] == key[i] + way:
                found[j] = True
    return found


@compiled
def _next(key: Keys) -> Int32:
    """(n, 3) position of the next corner from each along each axis, -1 where it is not there."""
    after = np.full((len(key), 3), -1, np.int32)
    for axis in range(3):
        step = STEPS[axis]
        j = 0
        for i in range(len(key)):
            while j < len(key) and key[j] < key[i] + step:
                j += 1
            if j < len(key) and key[j] == key[i] + step:
                after[i, axis] = j
    return after


@compiled
def _cut(
    value: Float32,
    after: Int32,
    vertex_of: Int32,
    most: np.float32,
    table: Int32,
    edge_corner: Int32,
    edge_axis: Int32,
    loops: Int32,
) -> int:
    """Write the vertices of each loop, -1 after its end, where there is room; how many there are.

    Cells of which a corner is unknown, or along one of whose edges the value jumps across zero,
    have none.
    """
    corner = np.empty(8, np.int32)
    found = 0
    for i in range(len(value)):
        corner[0] = i
        case = 0
        for c in range(8):
            if c:
                axis = 2 if c > 3 else 1 if c > 1 else 0
                corner[c] = after[corner[c - (1 << axis)], axis]
            if corner[c] < 0 or np.isnan(value[corner[c]]):
                case = 0
                break
            case |= (value[corner[c]] > 0) << c
        if case in (0, 255) or _jumps(value, corner, case, most, edge_corner, edge_axis):
            continue
        for loop in table[case]:
            if loop[0] < 0:
                break
            if found < len(loops):
                for k in range(len(loop)):
                    edge = loop[k]
                    at = corner[edge_corner[edge]]
                    loops[found, k] = vertex_of[at, edge_axis[edge]] if edge >= 0 else -1
            found += 1
    return found


@compiled
def _jumps(
    value: Float32,
    corner: Int32,
    case: int,
    most: np.float32,
    edge_corner: Int32,
    edge_axis: Int32,
) -> bool:
    """Whether along an edge of a cell the value jumps across zero."""
    for edge in range(len(edge_corner)):
        a = edge_corner[edge]
        b = a | 1 << edge_axis[edge]
        crosses = (case >> a & 1) != (case >> b & 1)
        if crosses and abs(value[corner[a]] - value[corner[b]]) > most:
            return True
    return False


def _vertices(
    key: Keys, value: Float32, after: Int32, low: Float32, cell_m: float
) -> tuple[Int32, Float32]:
    """(n, 3) number of the vertex on the edge from each corner along each axis, and (v, 3)."""
    number = np.empty(after.shape, np.int32)
    vertices = np.empty((_count_crossed(value, after, number), 3), np.float32)
    _place(key, value, after, number, low, np.float32(cell_m), vertices)
    return number, vertices


@compiled
def _count_crossed(value: Float32, after: Int32, number: Int32) -> int:
    """Write the number of the vertex on each edge, -1 where the surface does not cross it."""
    count = 0
    for i in range(len(value)):
        for axis in range(3):
            j = after[i, axis]
            number[i, axis] = -1
            if j < 0 or np.isnan(value[i]) or np.isnan(value[j]):
                continue
            if (value[i] <= 0) != (value[j] <= 0):
                number[i, axis] = count
                count += 1
    return count


@compiled
def _place(
    key: Keys,
    value: Float32,
    after: Int32,
    number: Int32,
    low: Float32,
    cell_m: np.float32,
    vertices: Float32,
) -> None:
    """Write where the vertices lie."""
    mask = (1 << AXIS_BITS) - 1
    at = np.empty(3, np.float32)
    for i in range(len(value)):
        at[0] = key[i] >> 2 * AXIS_BITS
        at[1] = key[i] >> AXIS_BITS & mask
        at[2] = key[i] & mask
        for axis in range(3):
            if number[i, axis] < 0:
                continue
            here, there = value[i], value[after[i, axis]]
            share = min(max(here / (here - there), _LEAST_SHARE), 1 - _LEAST_SHARE)
            for k in range(3):
                place = at[k] + np.float32(share) if k == axis else at[k]
                vertices[number[i, axis], k] = place * cell_m + low[k]


def _used(faces: Int32, count: int) -> tuple[npt.NDArray[np.bool_], Int32]:
    used = np.zeros(count, bool)
    used[faces] = True
    return used, (np.cumsum(used, dtype=np.int32) - 1)[faces]


@cache
def _table() -> tuple[Int32, Int32, Int32]:
    """(256, 4, 7) the edges that each loop joins, by case, -1 for none; (12,) corner and axis.

    Case bit i says that corner i lies in front. Edges are directed segments on the cube's faces,
    the front to the right as seen from outside, joined to loops that begin where a fan may.
    """
    number = {edge: i for i, edge in enumerate(_EDGES)}
    sides = [
        {(axis, a >> axis & 1) for axis in range(3) if a >> axis & 1 == b >> axis & 1}
        for a, b in _EDGES
    ]
    table = np.full((256, _MOST_LOOPS, _LONGEST_LOOP), -1, np.int32)
    for case in range(1, 255):
        after: dict[int, int] = {}
        for face in _cube_faces():
            after |= _segments(face, case, number)
        for slot, loop in enumerate(_loops(after)):
            table[case, slot, : len(loop)] = _from_apex(loop, sides)
    first, second = np.array(_EDGES, np.int32).T
    return table, first, (second - first) // 2


def _cube_faces() -> list[list[int]]:
    """The corners of each face, counter-clockwise seen from outside."""
    faces = []
    for axis in range(3):
        u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        faces.append([corner | 1 << axis for corner in (0, u, u | v, v)])
        faces.append([0, v, u | v, u])
    return faces


def _segments(face: list[int], case: int, number: dict[tuple[int, int], int]) -> dict[int, int]:
    """Where the surface enters and leaves a face: around each run of corners in front."""
    front = [bool(case >> corner & 1) for corner in face]
    edge = [number[min(a, b), max(a, b)] for a, b in zip(face, face[1:] + face[:1], strict=True)]
    found = {}
    for start in range(4):
        if front[start] and not front[start - 1]:
            end = start
            while front[(end + 1) % 4]:
                end += 1
            found[edge[end % 4]] = edge[start - 1]
    return found


def _loops(after: dict[int, int]) -> list[list[int]]:
    loops = []
    while after:
        loop = [next(iter(after))]
        while (following := after.pop(loop[-1])) != loop[0]:
            loop.append(following)
        loops.append(loop)
    return loops


def _from_apex(loop: list[int], sides: list[set[tuple[int, int]]]) -> list[int]:
    """Turn a loop so that a fan from its first vertex has no diagonal on the cube's surface.

    The neighbouring cell could draw the same diagonal, and four faces would share it.
    """
    for turn in range(len(loop)):
        apex, *rest = loop[turn:] + loop[:turn]
        if not any(sides[apex] & sides[edge] for edge in rest[1:-1]):
            return [apex, *rest]
    raise AssertionError(loop)  # no loop of a cube is without such an apex
