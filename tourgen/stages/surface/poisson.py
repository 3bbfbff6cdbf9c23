"""Poisson: the indicator function's screened solve (Kazhdan and Hoppe 2013), by Open3D.

The octree's depth follows from the room's size and the detail asked for: deeper only costs.
The solve closes everything, windows included; ``trim`` opens them again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tourgen.errors import StageError
from tourgen.geometry import Mesh, OrientedCloud

VERSION = 2
SCALE = 1.1
"""The solver's cube over the cloud's box."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The solve.

    Attributes:
        cell_m: Width of the octree's finest cells.
        depth: The octree's depth, or 0 to derive it from ``cell_m``.
        full_depth: Down to it the octree is complete, points or none.
        samples_per_node: Points that make a cell worth splitting; more for noisy scans.
        point_weight: How strongly the surface is drawn through the points.
        linear_fit: Place vertices by linear instead of quadratic interpolation.
    """

    cell_m: float
    depth: int = 0
    full_depth: int = 5
    samples_per_node: float = 1.0
    point_weight: float = 16.0
    linear_fit: bool = False


def poisson(oriented: OrientedCloud, settings: Settings) -> Mesh:
    """Solve for the surface.

    Args:
        oriented: Points with normals toward the free space.
        settings: See ``Settings``.

    Returns:
        A closed mesh, faces counter-clockwise seen from the free space.

    Raises:
        StageError: The solver found no surface.
    """
    import open3d as o3d

    points = oriented.cloud.points
    pcd = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    pcd.normals = o3d.utility.Vector3dVector(oriented.normals)
    solved, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
        pcd,
        depth=settings.depth or octree_depth(points, settings.cell_m),
        scale=SCALE,
        linear_fit=settings.linear_fit,
        n_threads=1,  # what several find differs from run to run by the last bits
        full_depth=settings.full_depth,
        samples_per_node=settings.samples_per_node,
        point_weight=settings.point_weight,
    )
    if not len(solved.triangles):
        raise StageError(
            "surface: expected a surface, found none", "check the normals, or thin the scan less"
        )
    return Mesh(
        oriented.cloud.origin,
        np.asarray(solved.vertices).astype(np.float32),
        np.asarray(solved.triangles).astype(np.int32),
    )


def octree_depth(points: np.ndarray, cell_m: float) -> int:
    """The least depth whose cells are no wider than ``cell_m``, from 6 to 12."""
    side_m = SCALE * float(np.ptp(points, axis=0).max())
    return int(np.clip(np.ceil(np.log2(side_m / cell_m) - 0.25), 6, 12))
