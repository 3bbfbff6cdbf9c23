"""What several mesh stages ask of faces."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Int32, Mesh

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
    faces = mesh.faces[keep]
    used = np.zeros(len(mesh.vertices), np.bool_)
    used[faces] = True
    number = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return Mesh(mesh.origin, mesh.vertices[used], number[faces])


def face_areas(mesh: Mesh) -> npt.NDArray[np.float32]:
    """Area of each face, square metres."""
    return np.asarray(np.linalg.norm(_doubled_normals(mesh), axis=1) / 2, np.float32)


def face_normals(mesh: Mesh) -> npt.NDArray[np.float32]:
    """Unit normal of each face, zero where it has no area."""
    return _unit(_doubled_normals(mesh))


def vertex_normals(mesh: Mesh) -> npt.NDArray[np.float32]:
    """Unit normal of each vertex, of the faces around it by their areas; zero where none has."""
    return _unit(_at_vertices(mesh.faces, _doubled_normals(mesh), len(mesh.vertices)))


def vertex_areas(mesh: Mesh) -> npt.NDArray[np.float64]:
    """A third of the faces around each vertex, square metres."""
    third = face_areas(mesh)[:, None] / 3
    return _at_vertices(mesh.faces, third, len(mesh.vertices))[:, 0]


def edges(faces: Int32) -> npt.NDArray[np.int64]:
    """(3 f, 2) the directed edges of all faces."""
    return faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)


def _unit(vectors: npt.NDArray[np.floating]) -> npt.NDArray[np.float32]:
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))[:, None]
    return np.asarray(vectors / np.maximum(length, 1e-20), np.float32)


def _doubled_normals(mesh: Mesh) -> npt.NDArray[np.float32]:
    """(f, 3) across each face, twice as long as it is large."""
    found = np.empty((len(mesh.faces), 3), np.float32)
    _cross(mesh.vertices, mesh.faces, found)
    return found


@compiled
def _cross(vertices: Float32, faces: Int32, found: Float32) -> None:
    """Write the cross product of two edges of each face."""
    for i in range(len(faces)):
        a, b, c = faces[i, 0], faces[i, 1], faces[i, 2]
        px, qx = vertices[b, 0] - vertices[a, 0], vertices[c, 0] - vertices[a, 0]
        py, qy = vertices[b, 1] - vertices[a, 1], vertices[c, 1] - vertices[a, 1]
        pz, qz = vertices[b, 2] - vertices[a, 2], vertices[c, 2] - vertices[a, 2]
        found[i, 0] = py * qz - pz * qy
        found[i, 1] = pz * qx - px * qz
        found[i, 2] = px * qy - py * qx


@compiled
def _at_vertices(
    faces: Int32, of_faces: npt.NDArray[np.floating], count: int
) -> npt.NDArray[np.float64]:
    """(count, k) the sum of (f, k) values of faces around each vertex."""
    total = np.zeros((count, of_faces.shape[1]), np.float64)
    for i in range(len(faces)):
        for corner in range(3):
            for k in range(of_faces.shape[1]):
                total[faces[i, corner], k] += of_faces[i, k]
    return total


@compiled
def face_adjacency(faces: Int32) -> npt.NDArray[np.int64]:
    """(m, 2) pairs of faces that share an edge; an edge of more than two faces gives a chain."""
    starts, high, owner = edge_faces(faces)
    pairs = np.empty((len(high), 2), np.int64)
    found = 0
    for i in range(len(starts) - 1):
        for place in range(starts[i] + 1, starts[i + 1]):
            if high[place] == high[place - 1]:
                pairs[found, 0], pairs[found, 1] = owner[place - 1], owner[place]
                found += 1
    return pairs[:found].copy()


@compiled
def edge_faces(faces: Int32) -> tuple[npt.NDArray[np.int64], Int32, Int32]:
    """Which faces each edge has, sorted by its lower vertex, then its higher one, then the face.

    Args:
        faces: (f, 3)

    Returns:
        (v + 1,) where the edges of each lower vertex begin, (3 f,) their higher vertices, and
        (3 f,) their faces.
    """
    count = 0
    for face in faces:
        count = max(count, face.max() + 1)
    starts = np.zeros(count + 1, np.int64)
    for face in faces:
        for k in range(3):
            starts[min(face[k], face[(k + 1) % 3]) + 1] += 1
    for i in range(count):
        starts[i + 1] += starts[i]
    high, owner = np.empty(3 * len(faces), np.int32), np.empty(3 * len(faces), np.int32)
    at = starts[:-1].copy()
    for i in range(len(faces)):
        for k in range(3):
            one, other = faces[i, k], faces[i, (k + 1) % 3]
            low = min(one, other)
            place = at[low]
            at[low] += 1
            while place > starts[low] and high[place - 1] > max(one, other):
                high[place], owner[place] = high[place - 1], owner[place - 1]
                place -= 1
            high[place], owner[place] = max(one, other), i
    return starts, high, owner


def components(pairs: npt.NDArray[np.int64], count: int) -> Int32:
    """(count,) number of the connected component that each node of a graph lies in."""
    graph = coo_matrix((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int32)


def regions(mesh: Mesh, at: npt.NDArray[np.int64]) -> Int32:
    """Number of the connected region that each chosen vertex lies in."""
    number = np.full(len(mesh.vertices), -1, np.int64)
    number[at] = np.arange(len(at))
    return components(_among(mesh.faces, number), len(at))


@compiled
def _among(faces: Int32, number: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """(m, 2) the edges between vertices that have a number, by these."""
    pairs = np.empty((3 * len(faces), 2), np.int64)
    found = 0
    for face in faces:
        for k in range(3):
            one, other = number[face[k]], number[face[(k + 1) % 3]]
            if one >= 0 and other >= 0:
                pairs[found, 0], pairs[found, 1] = one, other
                found += 1
    return pairs[:found].copy()


def weld(meshes: list[Mesh]) -> Mesh:
    """Join meshes of one origin; vertices at the same place become one."""
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    offset = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    faces = np.concatenate([m.faces + o for m, o in zip(meshes, offset, strict=True)])
    view = np.ascontiguousarray(vertices).view(np.dtype((np.void, 12))).reshape(-1)
    _, first, inverse = np.unique(view, return_index=True, return_inverse=True)
    return Mesh(meshes[0].origin, vertices[first], inverse.reshape(-1)[faces].astype(np.int32))
