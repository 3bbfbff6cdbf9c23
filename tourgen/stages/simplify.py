"""Simplify: fewer faces, by the quadric error metric (Garland and Heckbert 1997).

fast-simplification takes edges by the thousand as long as they err less than a threshold that it
raises step by step; Open3D takes always the one that errs least, 12 times slower. Down to a tenth
of the faces both are as near to the mesh; down to a twentieth the first closes windows and loses
the legs of tables. 95th percentile of what vertices of the finest level lie off, in two rooms:

| faces, of 243,000 and 284,000 | fast-simplification | Open3D | the one to 48,000, then the other |
|---|---|---|---|
| 12,000 | 23, 80 mm (0.6 s) | 12, 14 mm (3.0 s) | 9, 11 mm (0.8 s) |

fast-simplification keeps its mesh in variables of its own, so no two threads of a process may
simplify at once.
"""

from __future__ import annotations

import numpy as np

from tourgen.geometry import Mesh

_HASTE = 4
"""Of fast-simplification, 1 to 10. At 5 vertices lie off a quarter more, at 3 it may stop short."""
_FIRST = 4
"""Faces that the fast way leaves to the careful one, over those that are wanted."""
_BORDER_WEIGHT = 100.0
"""Of an edge of one face, so that openings keep their shape."""


def simplified(mesh: Mesh, faces: int, *, preserve_border: bool = False) -> Mesh:
    """Simplify a mesh to about a number of faces.

    Args:
        mesh: It.
        faces: How many are wanted.
        preserve_border: Vertices on a border stay as they are, so that it can be welded again.
    """
    import fast_simplification

    vertices, triangles = fast_simplification.simplify(
        mesh.vertices, mesh.faces, target_count=faces, agg=_HASTE, preserve_border=preserve_border
    )
    return Mesh(mesh.origin, vertices.astype(np.float32), triangles.astype(np.int32))


def coarsened(mesh: Mesh, faces: int) -> Mesh:
    """Simplify a mesh to a small part of its faces, with its openings and all that is thin.

    Args:
        mesh: It.
        faces: How many are wanted.
    """
    import open3d as o3d

    if len(mesh.faces) > _FIRST * faces:
        mesh = simplified(mesh, _FIRST * faces)
    whole = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(mesh.vertices), o3d.utility.Vector3iVector(mesh.faces)
    )
    left = whole.simplify_quadric_decimation(faces, boundary_weight=_BORDER_WEIGHT)
    return Mesh(
        mesh.origin,
        np.asarray(left.vertices, dtype=np.float32),
        np.asarray(left.triangles, dtype=np.int32),
    )
