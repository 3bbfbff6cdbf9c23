"""What several mesh stages ask of faces, in numpy."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from tourgen.geometry import Int32, Mesh

STEP_M = 2.0**-12
"""Of the grid that published vertices lie on, 0.244 mm: a float32 holds its positions exactly."""


def on_grid(mesh: Mesh) -> Mesh:
    """The mesh with its vertices on the grid, without the faces that have no area there.

    Simplification leaves slivers, some of them the two sides of a spike; what would vanish when
    published is better gone before borders and pictures are made.
    """
    vertices = np.rint(mesh.vertices.astype(np.float64) / STEP_M) * STEP_M
    joined = weld([Mesh(mesh.origin, vertices.astype(np.float32), mesh.faces)])
    apart = np.all(joined.faces != np.roll(joined.faces, 1, axis=1), axis=1)
    return compact(joined, apart)


def compact(mesh: Mesh, keep: npt.NDArray[np.generic]) -> Mesh:
    """The faces that ``keep`` (a mask or positions) selects, without unused vertices."""
    used, faces = np.unique(mesh.faces[keep], return_inverse=True)
    return Mesh(mesh.origin, mesh.vertices[used], faces.reshape(-1, 3).astype(np.int32))


def face_areas(mesh: Mesh) -> npt.NDArray[np.float32]:
    """Area of each face, square metres."""
    return np.asarray(np.linalg.norm(_doubled_normals(mesh), axis=1) / 2, np.float32)


def face_normals(mesh: Mesh) -> npt.NDArray[np.float32]:
    """Unit normal of each face, zero where it has no area."""
    normal = _doubled_normals(mesh)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(normal / np.maximum(length, 1e-20), np.float32)


def vertex_normals(mesh: Mesh) -> npt.NDArray[np.float32]:
    """Unit normal of each vertex, of the faces around it by their areas; zero where none has."""
    of_faces = _doubled_normals(mesh)
    normal = np.stack([_sum_at_vertices(mesh, of_faces[:, axis]) for axis in range(3)], axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(normal / np.maximum(length, 1e-20), np.float32)


def vertex_areas(mesh: Mesh) -> npt.NDArray[np.float64]:
    """A third of the faces around each vertex, square metres."""
    return _sum_at_vertices(mesh, face_areas(mesh) / 3)


def edges(faces: Int32) -> npt.NDArray[np.int64]:
    """(3 f, 2) the directed edges of all faces."""
    return faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)


def _sum_at_vertices(mesh: Mesh, of_faces: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
    count = len(mesh.vertices)
    summed = np.bincount(mesh.faces.reshape(-1), np.repeat(of_faces, 3), minlength=count)
    return np.asarray(summed, np.float64)


def _doubled_normals(mesh: Mesh) -> npt.NDArray[np.float32]:
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return np.asarray(np.cross(b - a, c - a), np.float32)


def face_adjacency(faces: Int32) -> npt.NDArray[np.int64]:
    """(m, 2) pairs of faces that share an edge; an edge of more than two faces gives a chain."""
    edge = np.sort(edges(faces), axis=1)
    key = edge[:, 0] << 32 | edge[:, 1]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    return np.stack([order[same], order[same + 1]], axis=1) // 3


def components(pairs: npt.NDArray[np.int64], count: int) -> Int32:
    """(count,) number of the connected component that each node of a graph lies in."""
    graph = coo_matrix((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int32)


def regions(mesh: Mesh, at: npt.NDArray[np.int64]) -> Int32:
    """Number of the connected region that each chosen vertex lies in."""
    number = np.full(len(mesh.vertices), -1)
    number[at] = np.arange(len(at))
    pair = number[edges(mesh.faces)]
    return components(pair[np.all(pair >= 0, axis=1)], len(at))


def weld(meshes: list[Mesh]) -> Mesh:
    """Join meshes of one origin; vertices at the same place become one."""
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    offset = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    faces = np.concatenate([m.faces + o for m, o in zip(meshes, offset, strict=True)])
    view = np.ascontiguousarray(vertices).view(np.dtype((np.void, 12))).reshape(-1)
    _, first, inverse = np.unique(view, return_index=True, return_inverse=True)
    return Mesh(meshes[0].origin, vertices[first], inverse.reshape(-1)[faces].astype(np.int32))
