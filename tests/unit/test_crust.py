"""The crust: its poles first, then what is drawn from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sampled import (
    borders,
    box_corner,
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
from tourgen.geometry import Float64, OrientedCloud
from tourgen.stages.mesh_arrays import face_areas, face_normals
from tourgen.stages.surface.crust import Settings, crust, poles

RING = torus(120, 48)


def positions(given: OrientedCloud) -> Float64:
    return np.asarray(given.cloud.points, np.float64)


# ------------------------------------------------------------------ poles


def test_the_way_to_the_pole_is_the_normal() -> None:
    found = poles(positions(RING))
    cosine = np.abs(np.einsum("ij,ij->i", found.direction, RING.normals))
    angle_deg = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
    assert np.median(angle_deg) < 1
    assert angle_deg.max() < 8


def test_poles_lie_on_either_side() -> None:
    points = positions(RING)
    found = poles(points)
    both = np.isfinite(found.first[:, 0]) & np.isfinite(found.second[:, 0])
    one, other = found.first[both] - points[both], found.second[both] - points[both]
    assert both.mean() > 0.4
    assert np.all(np.einsum("ij,ij->i", one, other) < 0)
    assert np.all(np.linalg.norm(one, axis=1) > np.linalg.norm(other, axis=1))


def test_the_poles_within_a_torus_lie_on_its_core() -> None:
    """The medial axis within is the circle of radius 1 m; outside, the torus' own axis."""
    points = positions(RING)
    found = poles(points)
    every = np.concatenate([found.first, found.second])
    every = every[np.isfinite(every[:, 0])]
    ring = np.hypot(every[:, 0], every[:, 1])
    to_core = np.hypot(ring - 1, every[:, 2])
    to_surface = np.abs(to_core - 0.4)
    within = to_core < 0.4
    assert within.sum() > 5_000
    assert np.quantile(to_core[within], 0.99) < 0.04
    near = ~within & (np.linalg.norm(every, axis=1) < 1)
    assert near.sum() > 50
    assert np.quantile(ring[near], 0.9) < 0.05
    assert to_surface.min() > 0.2


def test_a_point_of_the_hull_has_the_hulls_normal_and_one_pole() -> None:
    ball = sphere(1_000)
    found = poles(positions(ball))
    assert np.isnan(found.first).all()
    assert np.einsum("ij,ij->i", found.direction, ball.normals).min() > 0.99
    assert np.linalg.norm(found.second, axis=1).max() < 0.05


def test_poles_move_with_the_points() -> None:
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1.0]])
    points = positions(torus(60, 24))
    one, other = poles(points), poles(points @ turn.T + [4, 5, 6])
    assert other.direction == pytest.approx(one.direction @ turn.T, abs=1e-6)


# ------------------------------------------------------------------ surface


def test_a_torus_comes_out_with_its_hole() -> None:
    mesh = crust(RING, Settings(0.055))
    assert np.all(faces_per_edge(mesh) == 2)
    assert runs_one_way(mesh)
    assert euler_characteristic(mesh) == 0
    assert len(mesh.vertices) == len(RING.cloud)
    assert volume_m3(mesh) == pytest.approx(2 * np.pi**2 * 0.4**2, rel=0.01)
    assert mesh.vertices.dtype == np.float32
    assert mesh.faces.dtype == np.int32


def test_normals_turned_round_turn_the_faces_round() -> None:
    inward = OrientedCloud(RING.cloud, -RING.normals, RING.stations)
    mesh = crust(inward, Settings(0.055))
    assert euler_characteristic(mesh) == 0
    assert volume_m3(mesh) < -3


@pytest.mark.parametrize("noise_m", [0.0, 0.005])
def test_a_sphere_is_closed(noise_m: float) -> None:
    mesh = crust(sphere(3_000, noise_m=noise_m), Settings(0.065))
    assert np.all(faces_per_edge(mesh) == 2)
    assert runs_one_way(mesh)
    assert euler_characteristic(mesh) == 2
    assert volume_m3(mesh) == pytest.approx(4 / 3 * np.pi, rel=0.01)


def test_a_noisy_sheet_is_covered_once_and_open_around() -> None:
    mesh = crust(flat(2_500, noise_m=0.001), Settings(0.02))
    over = face_areas(mesh) @ face_normals(mesh)[:, 2]
    assert 0.93 < over < 1
    assert faces_per_edge(mesh).max() == 2
    rim = np.abs(mesh.vertices[borders(mesh)].mean(axis=1)[:, :2] - 0.5).max(axis=1) > 0.45
    assert rim.mean() > 0.9


def test_a_window_stays_open() -> None:
    sheet = flat(2_500, noise_m=0.001)
    window = np.all(np.abs(sheet.cloud.points[:, :2] - 0.5) < 0.15, axis=1)
    holed = cloud(sheet.cloud.points[~window], sheet.normals[~window])
    mesh = crust(holed, Settings(0.02))
    centre = mesh.vertices[mesh.faces].mean(axis=1)
    assert not np.any(np.all(np.abs(centre[:, :2] - 0.5) < 0.1, axis=1))
    spanned = crust(holed, Settings(0.02, longest=100))
    assert face_areas(spanned).sum() > face_areas(mesh).sum() + 0.05


def test_a_corner_of_three_walls_keeps_its_creases() -> None:
    given = box_corner(30, noise_m=0.0005)
    mesh = crust(given, Settings(0.033))
    assert len(mesh.vertices) > 0.99 * len(given.cloud)
    assert face_areas(mesh).sum() == pytest.approx(3, rel=0.1)
    border = mesh.vertices[borders(mesh)].mean(axis=1)
    inner = np.all(border < 0.9, axis=1)
    assert inner.mean() < 0.35


def test_the_filter_takes_what_stands_aslant() -> None:
    given = sphere(1_000, noise_m=0.02)
    all_, few = (crust(given, Settings(0.11, filter_deg=deg)) for deg in (90.0, 10.0))
    assert len(few.faces) < 0.9 * len(all_.faces)


def test_a_turned_and_shifted_cloud_gives_the_same_faces() -> None:
    turn = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    given = torus(60, 24)
    away = crust(moved(given, turn, np.array([2.0, -4.0, 8.0])), Settings(0.11))
    assert len(away.faces) == len(crust(given, Settings(0.11)).faces)
    assert euler_characteristic(away) == 0


def test_a_thousand_points_in_one_place_count_once() -> None:
    given = sphere(2_000)
    again = np.concatenate([np.arange(2_000), np.zeros(1_000, int)])
    mesh = crust(cloud(given.cloud.points[again], given.normals[again]), Settings(0.08))
    assert euler_characteristic(mesh) == 2
    assert len(mesh.vertices) == 2_000


# ------------------------------------------------------------------ refusals


def test_more_points_than_it_can_do_are_refused_with_the_methods_that_can() -> None:
    with pytest.raises(InputError, match="crust: expected at most 1000 points, found 5760") as told:
        crust(RING, Settings(0.055, most_points=1000))
    for method in ("auto", "poisson", "signed-distance", "ball-pivoting", "`clean.thin_mm`"):
        assert method in told.value.hint


def test_points_on_one_plane_are_refused_with_the_methods_that_can() -> None:
    with pytest.raises(StageError, match="expected points in space, found them on one plane"):
        crust(flat(400), Settings(0.05))


@pytest.mark.parametrize(
    ("points", "told"),
    [
        (np.zeros((1_000, 3)), "expected points at 4 places or more, found 1"),
        (np.outer(np.linspace(0, 1, 500), [1, 2, 0.5]), "expected points on a surface, found them"),
    ],
)
def test_no_crust_of_a_spot_or_a_line(points: Float64, told: str) -> None:
    with pytest.raises(StageError, match=told) as raised:
        crust(cloud(points, np.tile([0.0, 0, 1], (len(points), 1))), Settings(0.01))
    assert "\n" not in raised.value.message


def test_edges_too_short_for_the_points_leave_nothing() -> None:
    with pytest.raises(StageError, match="crust: expected faces, found none"):
        crust(sphere(500), Settings(0.001))


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("spacing_m", 0.0, "spacing_m: expected 0.0001 to 1, found 0"),
        ("filter_deg", 100.0, "filter_deg: expected 10 to 90, found 100"),
        ("longest", 1.0, "longest: expected 2 to 1000, found 1"),
        ("most_points", 3, "most_points: expected 4 to 1000000, found 3"),
    ],
)
def test_a_setting_that_cannot_be_names_its_range(name: str, value: float, told: str) -> None:
    with pytest.raises(InputError, match=told):
        replace(Settings(0.01), **{name: value})
