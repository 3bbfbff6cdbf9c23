"""Features: creases and corners drawn sharp where marching cubes would cut them off.

After Kobbelt, Botsch, Schwanecke and Seidel (2001): where the normals along a loop of vertices on
the edges of a cell spread, the surface has a crease inside, or a corner. The point that lies
nearest to the tangent planes of all of them (least squares; along a crease, where that leaves one
direction free, nearest to their middle) becomes a vertex, the loop a fan around it. Where two such
fans meet across the face of two cells, the edge between them is turned to join their middles: so
the crease becomes a line of edges.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Float64, Int32

_SPREAD_DEG = 28.0
"""Normals along a loop that differ by more make a crease."""
_RANK = 0.12
"""Of the squared singular values, over the largest: from it on a direction is held."""
_FARTHEST = 1.0
"""A feature farther from the middle of its loop, in cells, is none."""
_OFF = 0.15
"""One farther from its planes, in cells, root mean square, is none."""

Mask = npt.NDArray[np.bool_]


def fans(loops: Int32) -> Int32:
    """(f, 3) faces of (l, 7) loops, each a fan from its first vertex; -1 ends a loop."""
    faces = np.empty(((loops[:, 2:] >= 0).sum(), 3), np.int32)
    _fan(loops, faces)
    return faces


@compiled
def _fan(loops: Int32, faces: Int32) -> None:
    found = 0
    for i in range(len(loops)):
        for last in range(2, loops.shape[1]):
            if loops[i, last] < 0:
                break
            faces[found, 0] = loops[i, 0]
            faces[found, 1], faces[found, 2] = loops[i, last - 1], loops[i, last]
            found += 1


def with_features(
    vertices: Float32, loops: Int32, normals: Float32, cell_m: float
) -> tuple[Float32, Int32]:
    """Faces of loops, those with a feature around a vertex of their own.

    Args:
        vertices: (v, 3) on the edges of the grid, metres.
        loops: (l, 7) their numbers around each loop, counter-clockwise, -1 after its end.
        normals: (v, 3) unit, NaN where unknown.
        cell_m: Edge of the grid's cells.

    Returns:
        The vertices and those of features after them, and (f, 3) faces.
    """
    bent = np.empty(len(loops), np.bool_)
    _mark_bent(loops, normals, np.float32(np.cos(np.radians(_SPREAD_DEG))), bent)
    chosen = np.flatnonzero(bent)
    places, sound = _places(vertices, loops[chosen], normals, cell_m)
    chosen, places = chosen[sound], places[sound]
    plain = np.ones(len(loops), bool)
    plain[chosen] = False
    middle = len(vertices) + np.arange(len(chosen), dtype=np.int32)
    vertices = np.concatenate([vertices, places])
    around = _turned(_around(loops[chosen], middle), vertices, normals)
    return vertices, np.concatenate([fans(loops[plain]), around])


@compiled
def _mark_bent(loops: Int32, normals: Float32, least: np.float32, bent: Mask) -> None:
    """Write which loops have normals that spread: where one is unknown, none do."""
    for i in range(len(loops)):
        alike = np.float32(1)
        known = True
        for a in range(loops.shape[1]):
            one = loops[i, a]
            if one < 0:
                break
            known = known and not np.isnan(normals[one, 0])
            for b in range(a):
                other = loops[i, b]
                turn = normals[one, 0] * normals[other, 0]
                turn += normals[one, 1] * normals[other, 1]
                alike = min(alike, turn + normals[one, 2] * normals[other, 2])
        bent[i] = known and alike < least


def _places(
    vertices: Float32, loops: Int32, normals: Float32, cell_m: float
) -> tuple[Float32, Mask]:
    """Where the feature of each loop lies, and whether there is one."""
    there = (loops >= 0)[:, :, None]
    count = there.sum(axis=1)
    at = np.where(there, vertices[loops], 0).astype(np.float64)
    normal = np.where(there, normals[loops], 0).astype(np.float64)
    middle = at.sum(axis=1) / count
    height = np.einsum("lij,lij->li", normal, np.where(there, at - middle[:, None], 0))
    shift = _nearest(normal, height)
    off = np.square(np.einsum("lij,lj->li", normal, shift) - height).sum(axis=1) / count[:, 0]
    sound = np.linalg.norm(shift, axis=1) < _FARTHEST * cell_m
    sound &= off < (_OFF * cell_m) ** 2
    return (middle + shift).astype(np.float32), sound


def _nearest(normal: Float64, height: Float64) -> Float64:
    """(l, 3) the least shift that brings a place nearest to (l, 7) planes."""
    square = np.einsum("lij,lik->ljk", normal, normal)
    strength, axes = np.linalg.eigh(square)
    held = strength > _RANK * strength[:, 2:]
    wanted = np.einsum("lij,li->lj", normal, height)
    along = np.einsum("lji,lj->li", axes, wanted)
    along = np.where(held, along / np.where(held, strength, 1), 0)
    return np.asarray(np.einsum("lij,lj->li", axes, along))


def _around(loops: Int32, middle: Int32) -> Int32:
    """(f, 3) fans of loops around their middles, which come last in each face."""
    found = [np.empty((0, 3), np.int32)]
    length = (loops >= 0).sum(axis=1)
    for first in range(loops.shape[1]):
        some = length > first
        second = np.where(length[some] == first + 1, 0, first + 1)
        ends = loops[some, first], loops[some, second], middle[some]
        found.append(np.stack(ends, axis=1).astype(np.int32))
    return np.concatenate(found)


def _turned(faces: Int32, vertices: Float32, normals: Float32) -> Int32:
    """Join the middles of two fans that share an edge, unless a face would turn over."""
    low, high = faces[:, :2].min(axis=1), faces[:, :2].max(axis=1)
    order = np.lexsort((high, low))
    same = (low[order[1:]] == low[order[:-1]]) & (high[order[1:]] == high[order[:-1]])
    one, other = faces[order[:-1][same]], faces[order[1:][same]]
    a, b, here, across = one[:, 0], one[:, 1], one[:, 2], other[:, 2]
    at_a, at_b = np.stack([a, across, here], axis=1), np.stack([across, b, here], axis=1)
    sound = _looks_as(at_a, vertices, normals[a]) & _looks_as(at_b, vertices, normals[b])
    kept = np.ones(len(faces), bool)
    kept[order[:-1][same][sound]] = kept[order[1:][same][sound]] = False
    return np.concatenate([faces[kept], at_a[sound], at_b[sound]])


def _looks_as(faces: Int32, vertices: Float32, normals: Float32) -> Mask:
    """Mask of the faces that look within a right angle of given normals."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(np.einsum("ij,ij->i", np.cross(b - a, c - a), normals) > 0)
