"""Reads a surface that was mended elsewhere, by trimesh."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from tourgen.errors import InputError
from tourgen.geometry import Float64, Mesh
from tourgen.scans.scan import Frame

MESH_FORMATS: Final = (".ply", ".obj", ".stl", ".glb")
_EXPORT: Final = "export it again, as triangles in .ply or .glb"


def read_mesh(path: Path, name: str, frame: Frame, origin: Float64) -> Mesh:
    """Read all triangles of a file as one mesh.

    Args:
        path: The file.
        name: What to call it.
        frame: Carries its coordinates into the room's; glTF's, which are y-up by its standard,
            after they were turned to z-up.
        origin: (3,) of the mesh, metres.

    Raises:
        InputError: It is no such file, or holds no triangle.
    """
    import trimesh

    kind = path.suffix.lower()
    if kind not in MESH_FORMATS:
        raise InputError(
            f"`{name}`: expected a mesh ({', '.join(MESH_FORMATS)}), found `{path.suffix}`", _EXPORT
        )
    try:
        found = trimesh.load_mesh(path, process=False)
    except Exception as error:  # whatever its many readers raise
        raise InputError(f"`{name}`: expected a mesh, found: {error}", _EXPORT) from None
    if not len(getattr(found, "faces", ())) or not np.isfinite(found.vertices).all():
        raise InputError(f"`{name}`: expected triangles at finite places, found none", _EXPORT)
    found.merge_vertices(merge_tex=True, merge_norm=True)
    vertices = np.asarray(found.vertices, np.float64)
    if kind == ".glb":
        vertices = vertices[:, [0, 2, 1]] * (1.0, -1.0, 1.0)
    vertices = frame.apply(vertices) - origin
    return Mesh(origin, vertices.astype(np.float32), np.asarray(found.faces, np.int32))
