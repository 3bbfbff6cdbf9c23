"""Whatever way a cloud is turned, shifted, scaled or shuffled, its surface stays its surface."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sampled import cloud, euler_characteristic, faces_per_edge, runs_one_way, sphere, volume_m3
from scipy.spatial.transform import Rotation

from tourgen.geometry import Float64, Mesh, OrientedCloud
from tourgen.stages.surface import ball_pivoting, crust, signed_distance

POINTS = 1_500
SPACING = float(np.sqrt(4 * np.pi / POINTS))

Method = Callable[[OrientedCloud, float], Mesh]


def rolled(given_cloud: OrientedCloud, spacing_m: float) -> Mesh:
    radii_m = ball_pivoting.radii(spacing_m)
    return ball_pivoting.ball_pivoting(given_cloud, ball_pivoting.Settings(radii_m))


def measured(given_cloud: OrientedCloud, spacing_m: float) -> Mesh:
    asked = signed_distance.Settings(0.7 * spacing_m, spacing_m, noise_m=0.05 * spacing_m)
    return signed_distance.signed_distance(given_cloud, asked)


def crusted(given_cloud: OrientedCloud, spacing_m: float) -> Mesh:
    return crust.crust(given_cloud, crust.Settings(spacing_m))


def placed(seed: int, quaternion: Float64, shift: Float64, scale: float) -> OrientedCloud:
    ball = sphere(POINTS, seed=seed)
    turn = Rotation.from_quat(quaternion).as_matrix()
    order = np.random.default_rng(seed).permutation(POINTS)
    points = ball.cloud.points[order].astype(np.float64) @ turn.T * scale + shift
    return cloud(points, (ball.normals[order] @ turn.T).astype(np.float32))


unit = st.floats(-1, 1, width=32)
quaternions = st.tuples(unit, unit, unit, unit).filter(lambda q: np.linalg.norm(q) > 0.1)


@pytest.mark.parametrize("method", [rolled, measured, crusted])
@settings(max_examples=8, deadline=None)
@given(
    seed=st.integers(0, 1000),
    quaternion=quaternions,
    shift=st.tuples(unit, unit, unit),
    scale=st.floats(0.05, 2),
)
def test_a_sphere_is_a_sphere_wherever_and_however_large(
    method: Method,
    seed: int,
    quaternion: tuple[float, ...],
    shift: tuple[float, ...],
    scale: float,
) -> None:
    given_cloud = placed(seed, np.array(quaternion), 5 * scale * np.array(shift), scale)
    mesh = method(given_cloud, SPACING * scale)
    assert np.all(faces_per_edge(mesh) == 2)
    assert runs_one_way(mesh)
    assert euler_characteristic(mesh) == 2
    there = Mesh(mesh.origin, mesh.vertices - np.float32(5 * scale) * np.float32(shift), mesh.faces)
    assert volume_m3(there) == pytest.approx(4 / 3 * np.pi * scale**3, rel=0.02)


@pytest.mark.parametrize("method", [rolled, crusted])
@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 1000), noise=st.floats(0, 0.1))
def test_a_surface_through_the_points_uses_no_others(
    method: Method, seed: int, noise: float
) -> None:
    given_cloud = sphere(POINTS, noise_m=noise * SPACING, seed=seed)
    mesh = method(given_cloud, SPACING)
    known = {point.tobytes() for point in given_cloud.cloud.points}
    assert {vertex.tobytes() for vertex in mesh.vertices} <= known
    assert faces_per_edge(mesh).max() == 2
    assert runs_one_way(mesh)


@pytest.mark.parametrize("method", [rolled, measured, crusted])
def test_the_same_cloud_gives_the_same_mesh(method: Method) -> None:
    given_cloud = sphere(POINTS, noise_m=0.1 * SPACING)
    one, other = method(given_cloud, SPACING), method(given_cloud, SPACING)
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.faces, other.faces)
