"""Covers: what closes an opening beside the part through which a station looks out.

The solve spans a window or a porthole with a dome, some centimetres outside the rim. A station that
looks through it aslant knows a part of the dome to be empty; the rest hides behind the reveal. As
no beam tells (a carved volume calls it unseen: Curless and Levoy, "A volumetric method for building
complex models from range images", 1996), the shape does: a wall, a reveal, a floor or a step that
nobody saw lies between what was measured around it, a cover before it, outward. From what is cut
the cut runs on over the unsupported surface, as far as that lies outside the convex hull of the
points around it (quickhull: Barber, Dobkin and Huhdanpaa, 1996), through those of its facets that
face outward.

What stays free of the straight beams through the worst of the openings of a room and through all of
them, and of all beams that lead out, with what is cut alone, with patches that went whole once most
of them was cut, and so:

=========  =================  =================  =================
room       alone              patch              hull
=========  =================  =================  =================
chamber1   0.642 0.980 0.951  0.642 0.985 0.983  0.993 0.999 0.995
stairs     0.084 0.949 0.961  0.084 0.973 0.969  0.989 0.995 0.973
chamber2   0.736 0.973 0.943  0.736 0.983 0.978  0.987 0.999 0.991
=========  =================  =================  =================

With the patch the disc under the tripod in the stair's lower doorway went along with the door:
0.683 of the beams down to it met the mesh, now 0.988. What no station saw inside the rim stays:
0.01 of the beams through that door meet a scrap beside its jamb, which had gone with the patch.

Tried and rejected: a cover begins 10 or 20 mm outside the hull. It leaves a brim: 0.917 and 0.881
of the worst of the stair's openings free, of 0.978 (drawn by ``poisson`` with cells of 20 mm). No
plane takes the hull's place, as it would lie askew: what is cut of a porthole faces up to 9° away
from where the porthole does. A stray outside a rim spans the hull out to it, and a brim stays.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from tourgen.geometry import Float32, Float64, Mesh
from tourgen.neighbours import Neighbours
from tourgen.stages.mesh_arrays import regions, vertex_areas, vertex_normals

_FACING = 0.5
"""Cosine between outward and a facet through which a cover lies outside, at least."""
_LEAST_POINTS = 4
"""Of a hull."""

Mask = npt.NDArray[np.bool_]


def with_covers(mesh: Mesh, loose: Mask, cut: Mask, points: Float32, around_m: float) -> Mask:
    """What is to be cut, and the covers that hang on it.

    Args:
        mesh: Where from, faces counter-clockwise seen from the free space.
        loose: Mask of the unsupported vertices.
        cut: Mask of those of them that are known to close an opening.
        points: (n, 3) what was measured, metres.
        around_m: Points so near to an unsupported patch lie around it.

    Returns:
        Mask of the vertices.
    """
    at = np.flatnonzero(loose)
    patch = regions(mesh, at)
    opened = np.bincount(patch, cut[at])[patch] > 0
    at, patch = at[opened], patch[opened]
    if cut[at].all():
        return cut
    near = Neighbours.of(mesh.vertices[at], 1).nearest(points, 1, around_m)[0][:, 0]
    around = np.flatnonzero(near >= 0)
    patch_around = patch[near[around]]
    outward = -vertex_areas(mesh)[:, None] * vertex_normals(mesh) * cut[:, None]
    outside = cut[at]
    for number in np.unique(patch):
        of_patch = np.flatnonzero(patch == number)
        vertices = at[of_patch]
        hull_of = points[around[patch_around == number]].astype(np.float64)
        outside[of_patch] |= _outside(mesh.vertices[vertices], hull_of, outward[vertices].sum(0))
    reached = at[outside]
    region = regions(mesh, reached)
    covers = cut.copy()
    covers[reached] = np.bincount(region, cut[reached])[region] > 0
    return covers


def _outside(places: Float32, points: Float64, outward: Float64) -> Mask:
    """Mask of the places outside the hull of points, through a facet that faces outward."""
    if len(points) < _LEAST_POINTS:
        return np.zeros(len(places), bool)
    facets = ConvexHull(points, qhull_options="QJ").equations
    facing = facets[facets[:, :3] @ outward > _FACING * np.linalg.norm(outward)]
    return np.asarray(np.any(places @ facing[:, :3].T + facing[:, 3] > 0, axis=1))
