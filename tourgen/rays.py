"""Rays cast at meshes, through Embree (Open3D's RaycastingScene)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation

from tourgen.compiled import compiled
from tourgen.extent import extent
from tourgen.geometry import Float32, Float64, Int32, Mesh

_STEP_M = 0.1
"""Between the places of a ray at which faces are looked for."""


def ray_scene(vertices: Float32 | Float64, faces: Any) -> Any:
    """Open3D's ray casting scene of one mesh.

    Args:
        vertices: (v, 3) metres.
        faces: (f, 3) integers of any width.
    """
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(np.ascontiguousarray(vertices, dtype=np.float32)),
        o3d.core.Tensor(np.ascontiguousarray(faces, dtype=np.uint32)),
    )
    return scene


def along(mesh: Mesh, starts: Float32 | Float64, ways: Float32 | Float64, length_m: float) -> Mesh:
    """The faces that some rays may meet: a scene of all of a room's takes seconds to sort.

    Args:
        mesh: All faces.
        starts: (n, 3) metres from its origin.
        ways: (n, 3) of unit length.
        length_m: Of the rays.
    """
    if not len(mesh.faces):
        return mesh
    cell_m = _STEP_M + _widest_m(mesh.vertices, mesh.faces)
    low, high = extent(mesh.vertices)
    met = np.zeros(((high - low) / cell_m).astype(int) + 3, np.bool_)
    for gone_m in np.arange(0, length_m + _STEP_M, _STEP_M):
        at = np.floor((starts + gone_m * ways - low) / cell_m).astype(int) + 1
        at = at[((at >= 0) & (at < met.shape)).all(axis=1)]
        met[tuple(at.T)] = True
    near = binary_dilation(met, np.ones((3, 3, 3), np.bool_))
    cell = ((mesh.vertices - low) / np.float32(cell_m)).astype(int) + 1
    touched = near[tuple(cell.T)]
    return replace(mesh, faces=mesh.faces[touched[mesh.faces].any(axis=1)])


@compiled
def _widest_m(vertices: Float32, faces: Int32) -> float:
    """The longest side of a box about a face."""
    widest = 0.0
    for i in range(len(faces)):
        for axis in range(3):
            a, b, c = faces[i]
            x, y, z = vertices[a, axis], vertices[b, axis], vertices[c, axis]
            widest = max(widest, max(x, y, z) - min(x, y, z))
    return widest


def rays_of(origins: Float32 | Float64, directions: Float32 | Float64) -> Any:
    """Tensor (..., 6) of rays, as a ray casting scene takes them.

    Args:
        origins: (..., 3) metres, or one for all.
        directions: (..., 3)
    """
    import open3d as o3d

    packed = np.empty((*directions.shape[:-1], 6), dtype=np.float32)
    packed[..., :3], packed[..., 3:] = origins, directions
    return o3d.core.Tensor(packed)


def cast(
    scene: Any, origins: Float64, directions: Float64
) -> tuple[Float64, npt.NDArray[np.bool_]]:
    """What rays meet first.

    Args:
        scene: Of ``ray_scene``.
        origins: (..., 3) metres.
        directions: (..., 3) of unit length.

    Returns:
        (...) metres to it, infinite where there is nothing, and (...) whether its front is met.
    """
    hit = scene.cast_rays(rays_of(origins, directions))
    front = np.einsum("...j,...j->...", hit["primitive_normals"].numpy(), directions) < 0
    return hit["t_hit"].numpy().astype(np.float64), front
