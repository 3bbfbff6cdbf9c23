"""Measure: how well the surface follows the scan, and how much of it no scan supports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tourgen.geometry import Float64, Mesh, PointCloud
from tourgen.rays import ray_scene
from tourgen.stages import inferred
from tourgen.stages.mesh_arrays import face_areas

VERSION = 1 + inferred.VERSION
_SAMPLE = 200_000


@dataclass(frozen=True, slots=True)
class Quality:
    """The figures of the report.

    Attributes:
        cloud_to_mesh_p50_mm: Median distance from a point to the surface.
        cloud_to_mesh_p95_mm: Its 95th percentile.
        inferred_area_ratio: Share of the surface's area that no point was measured at.
        area_m2: Area of the surface.
    """

    cloud_to_mesh_p50_mm: float
    cloud_to_mesh_p95_mm: float
    inferred_area_ratio: float
    area_m2: float


def measure(
    mesh: Mesh, cloud: PointCloud, stations: Float64, settings: inferred.Settings
) -> Quality:
    """Compare the finest mesh with the cleaned points.

    Args:
        mesh: The finest; its faces are judged by their middles.
        cloud: The cleaned points, unthinned.
        stations: (s, 3) metres from the cloud's origin, that its ``station`` counts through.
        settings: What counts as inferred, as in the tiles.
    """
    scene = ray_scene(mesh.vertices, mesh.faces)
    step = max(1, len(cloud) // _SAMPLE)
    distance = scene.compute_distance(np.ascontiguousarray(cloud.points[::step])).numpy()
    p50, p95 = 1000 * np.quantile(distance, [0.5, 0.95])
    area = face_areas(mesh)
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    guess = ~inferred.measured(middles, cloud, stations, settings)
    share = area[guess].sum() / area.sum()
    return Quality(round(float(p50), 3), round(float(p95), 3), float(share), float(area.sum()))
