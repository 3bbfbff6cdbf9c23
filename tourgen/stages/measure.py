"""Measure: how well the surface follows the scan, and how much of it no scan supports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tourgen.geometry import Mesh, PointCloud
from tourgen.stages.mesh_arrays import face_areas

VERSION = 1
_SAMPLE = 200_000


@dataclass(frozen=True, slots=True)
class Settings:
    """What counts as inferred.

    Attributes:
        support_m: A face farther than this from every point is inferred.
    """

    support_m: float


@dataclass(frozen=True, slots=True)
class Quality:
    """The figures of the report.

    Attributes:
        cloud_to_mesh_p50_mm: Median distance from a point to the surface.
        cloud_to_mesh_p95_mm: Its 95th percentile.
        inferred_area_ratio: Share of the surface's area farther than ``support_m`` from a point.
        area_m2: Area of the surface.
    """

    cloud_to_mesh_p50_mm: float
    cloud_to_mesh_p95_mm: float
    inferred_area_ratio: float
    area_m2: float


def measure(mesh: Mesh, cloud: PointCloud, settings: Settings) -> Quality:
    """Compare the finest mesh with the cleaned points."""
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh.vertices, mesh.faces.astype(np.uint32))
    step = max(1, len(cloud) // _SAMPLE)
    distance = scene.compute_distance(np.ascontiguousarray(cloud.points[::step])).numpy()
    p50, p95 = 1000 * np.quantile(distance, [0.5, 0.95])
    area = face_areas(mesh)
    gap, _ = cKDTree(cloud.points).query(mesh.vertices[mesh.faces].mean(axis=1), workers=-1)
    inferred = area[gap > settings.support_m].sum() / area.sum()
    return Quality(round(float(p50), 3), round(float(p95), 3), float(inferred), float(area.sum()))
