"""Auto: flat and sharp where points are, closed where they are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sampled import box_corner, cloud, faces_per_edge, runs_one_way, sphere

from tourgen.geometry import OrientedCloud
from tourgen.stages.surface import auto, poisson, signed_distance

SPACING_M = 0.02
SETTINGS = auto.Settings(
    signed_distance.Settings(SPACING_M, SPACING_M),
    poisson.Settings(2 * SPACING_M),
    poisson.Settings(SPACING_M),
)


def without(given: OrientedCloud, gone: np.ndarray) -> OrientedCloud:
    return cloud(given.cloud.points[~gone], given.normals[~gone])


def test_a_gap_is_closed_in_the_shape_of_its_surroundings() -> None:
    whole = sphere(30_000)
    gap = whole.cloud.points[:, 2] > np.cos(0.25)
    found = auto.auto(without(whole, gap), SETTINGS)
    assert (faces_per_edge(found.mesh) == 2).all()
    assert runs_one_way(found.mesh)
    away = np.abs(np.linalg.norm(found.mesh.vertices, axis=1) - 1)
    capped = found.mesh.vertices[:, 2] > np.cos(0.25)
    assert capped.sum() > 100
    assert away[~capped].max() < 0.004
    assert away[capped].max() < 0.07
    assert found.dense_share == pytest.approx(1 - gap.mean(), abs=0.01)


def test_edges_are_sharper_than_the_solve_draws_them() -> None:
    corner = box_corner(50)
    found = auto.auto(corner, SETTINGS).mesh.vertices
    alone = poisson.poisson(corner, SETTINGS.alone).vertices

    def off(vertices: np.ndarray) -> float:
        near = ((vertices > -0.05) & (vertices < 0.9)).all(axis=1)
        edge = near & ((vertices < 0.05).sum(axis=1) >= 2)
        return float(np.quantile(np.abs(vertices[edge]).min(axis=1), 0.9))

    assert off(found) < 0.5 * off(alone)


def test_points_too_far_apart_are_left_to_the_solve() -> None:
    sparse = replace(SETTINGS.distance, spacing_m=0.001, cell_m=0.02, reach=0.5)
    found = auto.auto(sphere(2_000), replace(SETTINGS, distance=sparse))
    assert found.dense_share == 0
    assert np.abs(np.linalg.norm(found.mesh.vertices, axis=1) - 1).max() < 0.02
