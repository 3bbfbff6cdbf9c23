"""Hygiene: what later stages and other programs must not stumble over, by trimesh.

Crumbs (components of negligible area, unless they are rods: of the demo's pieces of 50 to 300 cm2
those at least four times as long as wide lie within 6 mm of the truth, the others 8 to 35 mm
off), faces without area, faces given twice and faces on edges
that more than two faces share are removed; vertices that nothing uses go with them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.errors import StageError
from tourgen.geometry import Float32, Int32, Mesh
from tourgen.stages.mesh_arrays import (
    compact,
    components,
    edge_faces,
    face_adjacency,
    face_areas,
)

VERSION = 4
_SUSPECT_M2 = 1e-8
"""A face without height, to trimesh 10 nm, is smaller than this if it is no metre long."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What is a crumb.

    Attributes:
        crumb_area_m2: Components smaller than this go.
        rod_area_m2: Rods only where they are smaller than this.
        rod_length: A rod is so many times as long as wide.
    """

    crumb_area_m2: float = 0.015
    rod_area_m2: float = 0.005
    rod_length: float = 4.0


def hygiene(mesh: Mesh, settings: Settings) -> Mesh:
    """Return the clean mesh.

    Raises:
        StageError: Nothing is left.
    """
    import trimesh

    def among(chosen: npt.NDArray[np.int64]) -> trimesh.Trimesh:
        return trimesh.Trimesh(mesh.vertices, mesh.faces[chosen], process=False)

    keep = np.ones(len(mesh.faces), np.bool_)
    # Of two at the same place, each has an edge with more, or both are a crumb.
    crowded = np.flatnonzero(_crowded(*edge_faces(mesh.faces), len(keep)))
    keep[crowded] = among(crowded).unique_faces()
    small = np.flatnonzero(face_areas(mesh) < _SUSPECT_M2)
    keep[small] &= among(small).nondegenerate_faces()
    mesh = _without_overfull_edges(compact(mesh, keep))
    mesh = compact(mesh, _large_enough(mesh, settings))
    if not len(mesh.faces):
        raise StageError(
            "surface: expected a connected surface, found only crumbs",
            "check the scan's density, or ask for less detail",
        )
    return mesh


def _large_enough(mesh: Mesh, settings: Settings) -> npt.NDArray[np.bool_]:
    """(f,) faces of components that are no crumbs."""
    label = components(face_adjacency(mesh.faces), len(mesh.faces))
    area = np.bincount(label, weights=face_areas(mesh))
    large = area >= settings.crumb_area_m2
    for each in np.flatnonzero(~large & (area >= settings.rod_area_m2)):
        large[each] = _is_rod(mesh.vertices[np.unique(mesh.faces[label == each])], settings)
    return np.asarray(large[label])


def _is_rod(vertices: Float32, settings: Settings) -> bool:
    """Whether places spread along one axis alone."""
    length, width, _ = np.linalg.svd(vertices - vertices.mean(0), compute_uv=False)
    return bool(length >= settings.rod_length * width)


def _without_overfull_edges(mesh: Mesh) -> Mesh:
    """Drop the smallest faces of each edge that more than two faces share."""
    starts, high, owner = edge_faces(mesh.faces)
    return compact(mesh, ~_overfull(starts, high, owner, face_areas(mesh)))


@compiled
def _crowded(
    starts: npt.NDArray[np.int64], high: Int32, owner: Int32, count: int
) -> npt.NDArray[np.bool_]:
    """(count,) faces of an edge that has more than two."""
    found = np.zeros(count, np.bool_)
    for i in range(len(starts) - 1):
        for place in range(starts[i], starts[i + 1] - 2):  # those of one edge stand in a row
            if high[place] == high[place + 2]:
                found[owner[place]] = found[owner[place + 1]] = found[owner[place + 2]] = True
    return found


@compiled
def _overfull(
    starts: npt.NDArray[np.int64], high: Int32, owner: Int32, area_m2: Float32
) -> npt.NDArray[np.bool_]:
    """(f,) faces of an edge that has two others which are no smaller."""
    found = np.zeros(len(area_m2), np.bool_)
    for i in range(len(starts) - 1):
        for place in range(starts[i], starts[i + 1]):
            larger = 0
            for other in range(starts[i], starts[i + 1]):
                if high[other] != high[place]:
                    continue
                own, theirs = area_m2[owner[place]], area_m2[owner[other]]
                larger += theirs > own or (theirs == own and other < place)
            found[owner[place]] |= larger >= 2
    return found
