"""What a mesh is worth as a surface: accuracy, completeness, F-score, agreement of normals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from score import Truth, spread

from tourgen.geometry import Float64, Int32
from tourgen.rays import ray_scene

LIMITS_MM = (2, 5, 10)
NEAR_M = 0.010
"""Normals are compared where the mesh is so near to the truth."""

Figures = dict[str, float]
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Reference:
    """A room's truth, and the points of it that a station sees, spread evenly.

    Attributes:
        truth: The surface.
        wanted: (n, 3) seen points.
    """

    truth: Truth
    wanted: Float64

    @classmethod
    def of(cls, truth: Truth) -> Reference:
        """Spread points over a truth, the same each time."""
        points, face = spread(truth.vertices, truth.faces, np.random.default_rng(2))
        return cls(truth, points[truth.seen(points, face)])


@dataclass(frozen=True)
class Samples:
    """Points spread evenly over a mesh and what the truth has to say about them.

    Attributes:
        points: (n, 3)
        normals: (n, 3) unit, of the mesh's faces.
        true_face: (n,) the face of the truth nearest to each.
        away_m: (n,) its distance.
        counts: (n,) the nearest truth is seen by a station, and the place lies in no shadow.
        inferred: (n,) no station sees the nearest truth, or the place itself.
    """

    points: Float64
    normals: Float64
    true_face: npt.NDArray[np.int64]
    away_m: Float64
    counts: Bools
    inferred: Bools

    @classmethod
    def of(cls, vertices: Float64, faces: Int32, truth: Truth) -> Samples:
        """Spread points over a mesh, the same each time."""
        import open3d as o3d

        points, face = spread(vertices, faces, np.random.default_rng(1))
        nearest = truth.scene.compute_closest_points(o3d.core.Tensor(points.astype(np.float32)))
        foot = nearest["points"].numpy().astype(np.float64)
        true_face = nearest["primitive_ids"].numpy().astype(np.int64)
        counts = truth.seen(foot, true_face) & ~truth.in_shadow(points)
        return cls(
            points,
            face_normals(vertices, faces)[face],
            true_face,
            np.linalg.norm(points - foot, axis=1),
            counts,
            ~counts,
        )


def face_normals(vertices: Float64, faces: Int32) -> Float64:
    """(f, 3) unit, zero where a face has no area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    unit: Float64 = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-15)
    return unit


def surface_figures(
    vertices: Float64, faces: Int32, samples: Samples, reference: Reference
) -> Figures:
    """The figures of one mesh.

    ``precision`` is the share of the mesh's counted points within a distance of the truth,
    ``recall`` the share of the seen truth within that of the mesh, the F-score their harmonic
    mean (Knapitsch, Park, Zhou, Koltun: Tanks and Temples, 2017).
    """
    import open3d as o3d

    away = samples.away_m[samples.counts] * 1000
    wanted = o3d.core.Tensor(reference.wanted.astype(np.float32))
    gap = ray_scene(vertices, faces).compute_distance(wanted).numpy() * 1000
    figures: Figures = {
        "faces": len(faces),
        "accuracy_median_mm": float(np.median(away)),
        "accuracy_p95_mm": float(np.quantile(away, 0.95)),
    }
    for limit in LIMITS_MM:
        figures[f"precision_{limit}mm"] = float((away <= limit).mean())
        figures[f"recall_{limit}mm"] = float((gap <= limit).mean())
        figures[f"f_score_{limit}mm"] = harmonic_mean(
            figures[f"precision_{limit}mm"], figures[f"recall_{limit}mm"]
        )
    close = samples.counts & (samples.away_m <= NEAR_M)
    true_normals = reference.truth.normals[samples.true_face[close]]
    cosine = (samples.normals[close] * true_normals).sum(axis=1)
    figures["normals_median_deg"] = float(np.degrees(np.arccos(np.clip(np.median(cosine), -1, 1))))
    figures["normal_agreement"] = float(cosine.mean())
    figures["inferred_share"] = float(samples.inferred.mean())
    return figures


def harmonic_mean(one: float, other: float) -> float:
    """Zero where either is."""
    return 2 * one * other / (one + other) if one and other else 0.0


def best(rows: Sequence[tuple[Any, Figures]]) -> tuple[Any, Figures]:
    """The row with the highest F-score at 5 mm."""
    return max(rows, key=lambda row: row[1]["f_score_5mm"])
