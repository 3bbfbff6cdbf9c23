"""Ball pivoting: closed on a sphere, through the points themselves, small balls before large."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sampled import (
    borders,
    cloud,
    euler_characteristic,
    faces_per_edge,
    flat,
    moved,
    runs_one_way,
    sphere,
    torus,
    volume_m3,
)

from tourgen.errors import InputError, StageError
from tourgen.geometry import OrientedCloud
from tourgen.stages.mesh_arrays import face_areas, face_normals
from tourgen.stages.surface.ball_pivoting import Settings, ball_pivoting, radii


def test_radii_double_from_the_spacing() -> None:
    assert radii(0.01) == pytest.approx((0.01, 0.02, 0.04))
    Settings(radii(0.0125))


def test_a_sphere_is_closed_and_looks_outward() -> None:
    given = sphere(5_000)
    mesh = ball_pivoting(given, Settings(radii(0.05)))
    assert np.all(faces_per_edge(mesh) == 2)
    assert runs_one_way(mesh)
    assert euler_characteristic(mesh) == 2
    assert volume_m3(mesh) == pytest.approx(4 / 3 * np.pi, rel=5e-3)
    assert mesh.vertices.dtype == np.float32
    assert mesh.faces.dtype == np.int32
    inward = OrientedCloud(given.cloud, -given.normals, given.stations)
    assert volume_m3(ball_pivoting(inward, Settings(radii(0.05)))) < -4


def test_its_vertices_are_the_points() -> None:
    given = sphere(2_000)
    mesh = ball_pivoting(given, Settings(radii(0.08)))
    known = {point.tobytes() for point in given.cloud.points}
    assert len(mesh.vertices) == len(known)
    assert all(vertex.tobytes() in known for vertex in mesh.vertices)


def test_a_torus_keeps_its_hole() -> None:
    mesh = ball_pivoting(torus(120, 48), Settings(radii(0.05)))
    assert np.all(faces_per_edge(mesh) == 2)
    assert euler_characteristic(mesh) == 0


def test_a_noisy_sheet_is_covered_and_stays_open_around() -> None:
    sheet = flat(10_000, 1.0, noise_m=0.001)
    mesh = ball_pivoting(sheet, Settings(radii(0.01)))
    over = face_areas(mesh) @ face_normals(mesh)[:, 2]
    assert 0.96 < over < 1
    assert np.all(face_normals(mesh)[:, 2] > 0)
    assert faces_per_edge(mesh).max() == 2
    assert runs_one_way(mesh)


def test_a_larger_ball_closes_what_a_small_one_falls_through_and_no_window() -> None:
    sheet = flat(10_000)
    at = sheet.cloud.points[:, :2]
    window = np.all(np.abs(at - [0.3, 0.5]) < 0.1, axis=1)
    gap = np.all(np.abs(at - [0.7, 0.5]) < [0.02, 0.3], axis=1)
    holed = cloud(sheet.cloud.points[~(window | gap)], sheet.normals[~(window | gap)])

    def borders_at_gap(radii_m: tuple[float, ...]) -> int:
        mesh = ball_pivoting(holed, Settings(radii_m))
        middle = mesh.vertices[borders(mesh)].mean(axis=1)
        around_window = np.all(np.abs(middle[:, :2] - [0.3, 0.5]) < 0.12, axis=1)
        assert around_window.sum() > 25
        return int(np.all(np.abs(middle[:, :2] - [0.7, 0.5]) < [0.04, 0.32], axis=1).sum())

    assert borders_at_gap((0.01,)) > 50
    assert borders_at_gap((0.01, 0.04)) < 5


def test_faces_that_disagree_with_a_normal_go() -> None:
    sheet = flat(2_500)
    tilted = sheet.normals.copy()
    wrong = np.linalg.norm(sheet.cloud.points[:, :2] - 0.5, axis=1) < 0.06
    tilted[wrong] = [np.sin(np.radians(60)), 0, np.cos(np.radians(60))]
    given = cloud(sheet.cloud.points, tilted)
    settings = Settings(radii(0.02))
    middle = np.array([0.5, 0.5, 0], np.float32)

    def at_middle(agree_deg: float) -> int:
        mesh = ball_pivoting(given, replace(settings, agree_deg=agree_deg))
        away = np.linalg.norm(mesh.vertices[mesh.faces].mean(axis=1) - middle, axis=1)
        return int((away < 0.04).sum())

    assert at_middle(75) > 10
    assert at_middle(50) == 0


def test_a_turned_and_shifted_cloud_gives_the_same_faces() -> None:
    given = sphere(2_000)
    turn = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    away = moved(given, turn, np.array([2.0, -4.0, 8.0]))
    settings = Settings(radii(0.08))
    one, other = ball_pivoting(given, settings), ball_pivoting(away, settings)
    assert len(one.faces) == len(other.faces)
    assert volume_m3(other) == pytest.approx(volume_m3(one), rel=1e-4)


def test_a_thousand_points_in_one_place_count_once() -> None:
    given = sphere(2_000)
    again = np.concatenate([np.arange(2_000), np.zeros(1_000, int)])
    mesh = ball_pivoting(
        cloud(given.cloud.points[again], given.normals[again]), Settings(radii(0.08))
    )
    assert np.all(faces_per_edge(mesh) == 2)
    assert len(mesh.vertices) == 2_000


@pytest.mark.parametrize(
    ("points", "told"),
    [
        (np.zeros((1_000, 3)), "expected points at 4 places or more, found 1"),
        (np.outer(np.linspace(0, 1, 500), [1, 2, 0.5]), "expected points on a surface, found them"),
    ],
)
def test_no_ball_rests_on_a_spot_or_a_line(points: np.ndarray, told: str) -> None:
    with pytest.raises(StageError, match=told):
        ball_pivoting(cloud(points, np.tile([0.0, 0, 1], (len(points), 1))), Settings((0.01,)))


def test_normals_that_lie_in_the_surface_carry_no_ball() -> None:
    sheet = flat(400)
    lying = cloud(sheet.cloud.points, np.tile([1.0, 0, 0], (400, 1)))
    with pytest.raises(StageError, match="found that no ball rests"):
        ball_pivoting(lying, Settings(radii(0.05)))


@pytest.mark.parametrize("first_m", [0.00015, 0.06, 0.9])
def test_a_first_ball_that_fits_no_spacing_names_the_range(first_m: float) -> None:
    told = (
        rf"surface.radii_mm: expected the first from 2\.\d+ to 2\d\.\d, found {1000 * first_m:g}$"
    )
    with pytest.raises(InputError, match=told):
        ball_pivoting(flat(10_000), Settings((first_m,)))


@pytest.mark.parametrize(
    ("radii_m", "told"),
    [
        ((), "number of radii_m: expected 1 to 8, found 0"),
        (tuple(np.linspace(0.1, 0.2, 9)), "number of radii_m: expected 1 to 8, found 9"),
        ((0.0, 0.1), "radii_m: expected 0.0001 to 1, found 0"),
        ((0.1, 3.0), "radii_m: expected 0.0001 to 1, found 3"),
        ((0.1, float("nan")), "radii_m: expected 0.0001 to 1, found nan"),
        ((0.1, 0.05), "expected each larger than the one before, found 0.1, 0.05"),
    ],
)
def test_radii_that_cannot_be_are_told(radii_m: tuple[float, ...], told: str) -> None:
    with pytest.raises(InputError, match=told):
        Settings(radii_m)


def test_an_angle_that_cannot_be_names_its_range() -> None:
    with pytest.raises(InputError, match="agree_deg: expected 10 to 90, found 100"):
        Settings((0.01,), agree_deg=100)
