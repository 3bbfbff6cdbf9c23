"""Signed distance: closed where points are, open where none are, flat walls flat, edges sharp."""

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

from tourgen.errors import InputError, StageError, TourgenError
from tourgen.geometry import OrientedCloud
from tourgen.stages.mesh_arrays import face_areas, face_normals
from tourgen.stages.surface.signed_distance import Settings, signed_distance

FINE = Settings(cell_m=0.02, spacing_m=0.03, noise_m=0.001)


def test_a_sphere_is_closed_and_looks_outward() -> None:
    mesh = signed_distance(sphere(14_000), FINE)
    assert np.all(faces_per_edge(mesh) == 2)
    assert runs_one_way(mesh)
    assert euler_characteristic(mesh) == 2
    assert volume_m3(mesh) == pytest.approx(4 / 3 * np.pi, rel=2e-3)
    off = np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1)
    assert np.quantile(off, 0.99) < 0.0005
    assert mesh.vertices.dtype == np.float32
    assert mesh.faces.dtype == np.int32


def test_normals_turned_round_turn_the_faces_round() -> None:
    outward = sphere(14_000)
    inward = OrientedCloud(outward.cloud, -outward.normals, outward.stations)
    assert volume_m3(signed_distance(inward, FINE)) == pytest.approx(-4 / 3 * np.pi, rel=2e-3)


def test_a_torus_keeps_its_hole() -> None:
    mesh = signed_distance(torus(200, 80), FINE)
    assert np.all(faces_per_edge(mesh) == 2)
    assert euler_characteristic(mesh) == 0
    assert volume_m3(mesh) == pytest.approx(2 * np.pi**2 * 0.4**2, rel=0.01)


def test_noise_is_averaged_and_leaves_a_wall_flat() -> None:
    noise_m = 0.002
    sheet = flat(10_000, 1.0, noise_m, tilt_deg=6)
    mesh = signed_distance(sheet, Settings(cell_m=0.008, spacing_m=0.01, noise_m=noise_m))
    inner = np.all((mesh.vertices[:, :2] > 0.05) & (mesh.vertices[:, :2] < 0.95), axis=1)
    assert np.sqrt(np.square(mesh.vertices[inner, 2]).mean()) < 0.45 * noise_m
    tilt = np.degrees(np.arccos(face_normals(mesh)[inner[mesh.faces].all(axis=1), 2]))
    assert np.median(tilt) < 3
    assert faces_per_edge(mesh).max() == 2


def test_a_surface_ends_a_little_past_its_last_points() -> None:
    settings = Settings(cell_m=0.008, spacing_m=0.01, noise_m=0.001)
    mesh = signed_distance(flat(10_000), settings)
    assert mesh.vertices[:, :2].min() > -0.03
    assert mesh.vertices[:, :2].max() < 1.03
    assert 1 < face_areas(mesh).sum() < 1.08


def test_a_window_stays_open_and_a_gap_of_one_spacing_closes() -> None:
    sheet = flat(10_000)
    at = sheet.cloud.points
    window = np.all(np.abs(at[:, :2] - [0.3, 0.5]) < 0.1, axis=1)
    gap = np.abs(at[:, 0] - 0.7) < 0.004
    kept = ~(window | gap)
    holed = cloud(at[kept], sheet.normals[kept])
    mesh = signed_distance(holed, Settings(cell_m=0.008, spacing_m=0.01, noise_m=0.001))
    centre = mesh.vertices[mesh.faces].mean(axis=1)
    assert not np.any(np.all(np.abs(centre[:, :2] - [0.3, 0.5]) < 0.075, axis=1))
    border = borders(mesh)
    middle = mesh.vertices[border].mean(axis=1)
    assert np.all(np.abs(middle[:, :2] - [0.3, 0.5]) < 0.11, axis=1).sum() > 50
    strip = (np.abs(middle[:, 0] - 0.7) < 0.03) & (np.abs(middle[:, 1] - 0.5) < 0.45)
    assert not strip.any()


@pytest.mark.parametrize("seen_from", ["within", "outside"])
def test_a_crease_is_sharp(seen_from: str) -> None:
    cell_m = 0.008
    corner = box_corner(100, noise_m=0.0005)
    if seen_from == "outside":
        corner = OrientedCloud(corner.cloud, -corner.normals, corner.stations)
    mesh = signed_distance(corner, Settings(cell_m=cell_m, spacing_m=0.01, noise_m=0.001))
    inner = np.all((mesh.vertices < 0.9) & (mesh.vertices > -cell_m), axis=1)
    off = np.abs(mesh.vertices[inner]).min(axis=1)
    assert off.max() < cell_m / 8
    near = np.sort(np.abs(mesh.vertices[inner]), axis=1)[:, 1] < 2 * cell_m
    assert near.sum() > 300
    assert np.quantile(off[near], 0.9) < cell_m / 16


def test_two_walls_back_to_back_stay_two() -> None:
    front = flat(10_000, 1.0, 0.0005)
    back = front.cloud.points * [1, 1, -1] - [0, 0, 0.03]
    both = cloud(
        np.concatenate([front.cloud.points, back]),
        np.concatenate([front.normals, front.normals * [1, 1, -1]]),
    )
    mesh = signed_distance(both, Settings(cell_m=0.008, spacing_m=0.01, noise_m=0.001))
    inner = np.all((mesh.vertices[:, :2] > 0.05) & (mesh.vertices[:, :2] < 0.95), axis=1)
    height = mesh.vertices[inner, 2]
    assert np.minimum(np.abs(height), np.abs(height + 0.03)).max() < 0.002
    assert face_areas(mesh).sum() == pytest.approx(2, rel=0.05)


def test_a_lone_point_in_the_air_makes_no_surface() -> None:
    sheet = flat(10_000)
    rng = np.random.default_rng(0)
    air = rng.uniform([0.1, 0.1, 0.1], [0.9, 0.9, 0.5], (30, 3))
    way = rng.normal(size=air.shape)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    both = cloud(np.concatenate([sheet.cloud.points, air]), np.concatenate([sheet.normals, way]))
    mesh = signed_distance(both, Settings(cell_m=0.008, spacing_m=0.01, noise_m=0.001))
    assert np.abs(mesh.vertices[:, 2]).max() < 0.01


def test_a_handful_of_points_that_stand_apart_make_no_surface() -> None:
    """Five strays that agree with each other, as a tripod's or a passer-by's leftovers do."""
    wall = flat(2_000)
    strays = np.float32([[0.5, 0.5, 0.5]]) + np.float32(
        [[0, 0, 0], [0.03, 0, 0], [0, 0.03, 0], [-0.03, 0, 0], [0, -0.03, 0]]
    )
    both = cloud(
        np.concatenate([wall.cloud.points, strays]),
        np.concatenate([wall.normals, np.float32([[0, 0, 1]] * 5)]),
    )
    mesh = signed_distance(both, FINE)
    assert np.abs(mesh.vertices[:, 2]).max() < 0.1


def test_memory_follows_the_area_not_the_room() -> None:
    """Two sheets 150 m apart: a full grid would have 10^12 cells."""
    sheet = flat(2_500)
    far = cloud(
        np.concatenate([sheet.cloud.points, sheet.cloud.points + np.float32(150)]),
        np.concatenate([sheet.normals, sheet.normals]),
    )
    mesh = signed_distance(far, Settings(cell_m=0.015, spacing_m=0.02))
    assert face_areas(mesh).sum() == pytest.approx(2, rel=0.1)


def test_a_turned_and_shifted_cloud_gives_the_same_shape() -> None:
    angle = 0.7
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    shift = np.array([3.0, -7.0, 2.0])
    mesh = signed_distance(moved(sphere(14_000), turn, shift), FINE)
    assert np.all(faces_per_edge(mesh) == 2)
    off = np.abs(np.linalg.norm(mesh.vertices - shift, axis=1) - 1)
    assert np.quantile(off, 0.99) < 0.0005


def test_the_order_of_the_points_does_not_matter() -> None:
    given = sphere(5_000, noise_m=0.002)
    order = np.random.default_rng(1).permutation(5_000)
    shuffled = cloud(given.cloud.points[order], given.normals[order])
    settings = Settings(cell_m=0.04, spacing_m=0.05)
    one, other = signed_distance(given, settings), signed_distance(shuffled, settings)
    assert len(one.vertices) == len(other.vertices)
    assert np.abs(one.vertices - other.vertices).max() < 1e-5


def test_repeated_points_change_nothing() -> None:
    given = sphere(5_000)
    again = np.concatenate([np.arange(5_000), np.zeros(1_000, int)])
    repeated = cloud(given.cloud.points[again], given.normals[again])
    settings = Settings(cell_m=0.04, spacing_m=0.05)
    one, other = signed_distance(given, settings), signed_distance(repeated, settings)
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.faces, other.faces)


@pytest.mark.parametrize(
    ("points", "told"),
    [
        (np.zeros((1_000, 3)), "expected points at 4 places or more, found 1"),
        (np.outer(np.linspace(0, 1, 500), [1, 2, 0.5]), "expected points on a surface, found them"),
        (np.eye(3), "expected points at 4 places or more, found 3"),
    ],
)
def test_no_surface_runs_through_a_spot_or_a_line(points: np.ndarray, told: str) -> None:
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    with pytest.raises(StageError, match=told) as raised:
        signed_distance(cloud(points, normals), FINE)
    assert "\n" not in raised.value.message


def test_points_that_contradict_each_other_are_told() -> None:
    rng = np.random.default_rng(0)
    way = rng.normal(size=(400, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    with pytest.raises(StageError, match="expected points that agree on a surface"):
        signed_distance(cloud(rng.random((400, 3)), way), replace(FINE, support=0.9))


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("cell_m", 0.0, "cell_m: expected 0.0005 to 1, found 0"),
        ("cell_m", float("nan"), "cell_m: expected 0.0005 to 1, found nan"),
        ("spacing_m", -1.0, "spacing_m: expected 0.0001 to 1, found -1"),
        ("noise_m", 3.0, "noise_m: expected 0 to 0.1, found 3"),
        ("neighbours", 2, "neighbours: expected 4 to 64, found 2"),
        ("crease_deg", 120.0, "crease_deg: expected 3 to 45, found 120"),
        ("blend", 0, "blend: expected 1 to 32, found 0"),
        ("reach", 100.0, "reach: expected 0.5 to 5, found 100"),
        ("support", 1.0, "support: expected 0 to 0.9, found 1"),
    ],
)
def test_a_setting_that_cannot_be_names_its_range(name: str, value: float, told: str) -> None:
    with pytest.raises(InputError, match=told):
        replace(FINE, **{name: value})


def test_cells_too_fine_for_the_room_name_the_range() -> None:
    sheet = flat(100)
    wide = cloud(sheet.cloud.points * np.float32(6000), sheet.normals)
    with pytest.raises(TourgenError, match=r"cell_m: expected 0\.0027\d* to 1, found 0\.001"):
        signed_distance(wide, Settings(cell_m=0.001, spacing_m=1))
