"""Covers: what closes an opening beside the part through which a station looks out.

The solve spans a window or a porthole with a dome, some centimetres outside the rim. A station that
looks through it aslant knows a part of the dome to be empty; the rest hides behind the reveal. As
no beam tells (a carved volume calls it unseen: Curless and Levoy, "A volumetric method for building
complex models from range images", 1996), the shape does: a wall, a reveal, a floor or a step that
nobody saw lies between what was measured around it, a cover before it, outward. From what is cut
the cut runs on over the unsupported surface, as far as that lies outside the convex hull of the
points around it (quickhull: Barber, Dobkin and Huhdanpaa, 1996), through those of its facets that
face outward.

Straight beams through the demo's openings that stay free, the least in each room, with what is cut
alone, where most of a patch being cut takes the rest along, and so:

=========  ===== ===== =====
room       alone patch hull
=========  ===== ===== =====
=========  ===== ===== =====

With the patch the disc under the tripod in the stair's lower doorway went along with the door.
Tried and rejected: the same 10 and 20 mm outside the hull, which leave a brim (0.92 and 0.88 of the
stair's porthole free, of 0.98). A plane in place of the hull lies askew: what is cut of a porthole
faces up to 9° away from it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull, cKDTree

from tourgen.geometry import Float32, Float64, Mesh
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
    _, near = cKDTree(mesh.vertices[at]).query(points, distance_upper_bound=around_m, workers=-1)
    around = np.flatnonzero(near < len(at))
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
    return np.any(places @ facing[:, :3].T + facing[:, 3] > 0, axis=1)
