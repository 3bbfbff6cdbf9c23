"""Rays cast at meshes, through Embree (Open3D's RaycastingScene)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64


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
