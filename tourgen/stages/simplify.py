"""Simplify: fewer faces, by fast-simplification (quadric error metric, Garland and Heckbert 1997).

It keeps its mesh in variables of its own, so no two threads of a process may simplify at once.
"""

from __future__ import annotations

import numpy as np

from tourgen.geometry import Mesh


def simplified(mesh: Mesh, faces: int, *, preserve_border: bool = False) -> Mesh:
    """Simplify a mesh to about a number of faces.

    Args:
        mesh: It.
        faces: How many are wanted.
        preserve_border: Vertices on a border stay as they are, so that it can be welded again.
    """
    import fast_simplification

    vertices, triangles = fast_simplification.simplify(
        mesh.vertices, mesh.faces, target_count=faces, agg=5, preserve_border=preserve_border
    )
    return Mesh(mesh.origin, vertices.astype(np.float32), triangles.astype(np.int32))
