"""Specks: pieces of surface that hang in the air on a handful of strays.

Two or three strays that sifting left make a blob as large as a fist, in which a visitor on a stair
gets stuck. What tells it from a lamp on its wire is how few points bear it: of the demo's pieces of
less than a square metre, in rooms scanned so thinly that nobody knows which station measured what,
those in the air hold under 0.07 of the points that their area has elsewhere in the room, those that
are there over 0.19, save for scraps of a palm's breadth.
"""

from __future__ import annotations

import numpy as np

from tourgen.geometry import Float32, Mesh
from tourgen.neighbours import Neighbours
from tourgen.stages.mesh_arrays import compact, components, face_adjacency, face_areas

_LARGEST_M2 = 1.0
_LEAST_DENSITY = 0.1


def without_specks(mesh: Mesh, points: Float32, support_m: float) -> Mesh:
    """Drop the pieces of less than a square metre that hardly any point bears.

    Args:
        mesh: Where from.
        points: (n, 3) that it was drawn from, metres.
        support_m: What lies farther than this from a point is not borne by it.
    """
    area = face_areas(mesh)
    piece = components(face_adjacency(mesh.faces), len(mesh.faces))
    piece_area = np.bincount(piece, area)
    small = np.flatnonzero((piece_area < _LARGEST_M2)[piece])
    if not len(small):
        return mesh
    vertices, first = np.unique(mesh.faces[small], return_index=True)
    of_piece = piece[small][first // 3]
    near = Neighbours.of(points, 1).nearest(mesh.vertices[vertices], 1, support_m)[0][:, 0]
    borne = near >= 0
    pairs = np.unique(np.stack([of_piece[borne], near[borne]]), axis=1)
    bearing = np.bincount(pairs[0], minlength=len(piece_area))
    wanted = _LEAST_DENSITY * len(points) / area.sum()
    speck = (bearing < wanted * piece_area) & (piece_area < _LARGEST_M2)
    return compact(mesh, ~speck[piece])
