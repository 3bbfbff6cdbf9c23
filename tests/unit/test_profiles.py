"""A moulding too fine for its points is read along its length; a ball has no length."""

from __future__ import annotations

import numpy as np
import trimesh

from tourgen.geometry import OrientedCloud, PointCloud
from tourgen.stages import tangent
from tourgen.stages.surface.profiles import along_profiles
from tourgen.stages.surface.tangent_planes import Smoothing, TangentPlanes, tangent_planes

SPACING_M = 0.012
NOISE_M = 0.001
SMOOTHING = Smoothing(neighbours=16, crease_deg=12.0, noise_m=NOISE_M)
FACET_M = 0.025


def told(points: np.ndarray, normals: np.ndarray) -> TangentPlanes:
    count = len(points)
    cloud = PointCloud(
        np.zeros(3), np.float32(points), np.zeros((count, 3), np.uint8), np.zeros(count, np.int16)
    )
    return tangent_planes(OrientedCloud(cloud, np.float32(normals), np.empty((0, 3))), SMOOTHING)


def zigzag(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points and true normals of six facets of 25 mm, a metre and a half long, at right angles."""
    count = int(6 * FACET_M * 1.5 / SPACING_M**2)
    along, across = rng.uniform(0, 1.5, count), rng.uniform(0, 6, count)
    facet = across.astype(int)
    rising = facet % 2 == 0
    height = FACET_M * np.where(rising, across - facet, 1 - (across - facet))
    points = np.stack([FACET_M * across, along, height], axis=1)
    points[:, [0, 2]] *= np.sqrt(0.5)
    normals = np.where(rising[:, None], [-1.0, 0, 1], [1.0, 0, 1]) / np.sqrt(2)
    # Slanted in the room, as most mouldings are to its axes.
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])[:3, :3]
    points = points @ turn.T + rng.normal(0, NOISE_M, (count, 3))
    return points, normals @ turn.T


def off_deg(planes: TangentPlanes, normals: np.ndarray) -> np.ndarray:
    cosine = np.einsum("ij,ij->i", planes.normals, normals)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def test_facets_finer_than_their_points_are_told_apart_along_their_length() -> None:
    points, normals = zigzag(np.random.default_rng(0))
    fitted = tangent.tangent_planes(np.float32(points), 12, 32)
    fitted *= np.sign(np.einsum("ij,ij->i", fitted, normals))[:, None]
    before = told(points, fitted)
    after = along_profiles(before, np.float32(points), np.ones(len(points), bool), SMOOTHING)
    assert np.median(off_deg(before, normals)) > 20
    assert np.median(off_deg(after, normals)) < 8
    assert np.array_equal(after.spacing_m, before.spacing_m)


def test_only_what_may_be_of_a_profile_is_changed() -> None:
    points, normals = zigzag(np.random.default_rng(1))
    before = told(points, normals)
    rest = points[:, 1] < np.median(points[:, 1])
    after = along_profiles(before, np.float32(points), rest, SMOOTHING)
    assert np.array_equal(after.points[~rest], before.points[~rest])
    assert np.array_equal(after.normals[~rest], before.normals[~rest])


def test_a_ball_stays_round() -> None:
    ball = trimesh.creation.icosphere(6, 0.6)
    points = np.float32(ball.vertices)
    before = told(points, ball.vertex_normals)
    after = along_profiles(before, points, np.ones(len(points), bool), SMOOTHING)
    off_m = np.abs(np.linalg.norm(after.points, axis=1) - 0.6)
    assert np.quantile(off_m, 0.99) < NOISE_M
    assert np.quantile(off_deg(after, ball.vertex_normals), 0.99) < 3


def test_a_handful_of_points_is_no_fault() -> None:
    few = told(np.random.default_rng(2).normal(size=(20, 3)), np.tile([0.0, 0, 1], (20, 1)))
    assert along_profiles(few, few.points, np.ones(20, bool), SMOOTHING) is few
