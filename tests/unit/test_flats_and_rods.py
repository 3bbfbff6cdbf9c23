"""What is flat becomes flat, what is bent stays bent, and a rail is a tube again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tourgen.geometry import Mesh
from tourgen.stages.surface.onto_flats import flattened
from tourgen.stages.surface.rods import rods
from tourgen.stages.surface.tangent_planes import TangentPlanes
from tourgen.stages.surface.tubes import Rod, with_tubes

SPACING_M = 0.012
NOISE_M = 0.0013


def planes_of(points: np.ndarray, normals: np.ndarray) -> TangentPlanes:
    count = len(points)
    return TangentPlanes(
        np.float32(points),
        np.float32(normals / np.linalg.norm(normals, axis=1, keepdims=True)),
        np.full(count, SPACING_M, np.float32),
        np.ones(count, np.float32),
        NOISE_M,
    )


def corner(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Floor and wall, a metre square each, noisy, their normals too."""
    count = int(1 / SPACING_M**2)
    points = rng.uniform(0, 1, (2 * count, 3))
    normals = rng.normal(0, 0.04, (2 * count, 3))
    points[:count, 2] = rng.normal(0, NOISE_M / 2, count)
    points[count:, 0] = rng.normal(0, NOISE_M / 2, count)
    normals[:count, 2] += 1
    normals[count:, 0] += 1
    return points, normals


def rail(rng: np.random.Generator, radius_m: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """An upright rod 0.4 m long, a metre off, seen from one side by two points a centimetre."""
    height = rng.uniform(0.3, 0.7, 80)
    angle = rng.uniform(-1.3, 1.3, 80)
    outward = np.stack([np.cos(angle), np.sin(angle), np.zeros(80)], axis=1)
    points = [2.0, 2.0, 0.0] + (radius_m + rng.normal(0, NOISE_M, 80))[:, None] * outward
    points[:, 2] = height
    return points, outward


def test_walls_become_flat_and_their_corner_keeps_its_place() -> None:
    points, normals = corner(np.random.default_rng(0))
    flat, flats = flattened(planes_of(points, normals), SPACING_M)
    half = len(points) // 2
    on = flats.broad
    assert on.mean() > 0.98
    floor, wall = on.copy(), on.copy()
    floor[half:], wall[:half] = False, False
    floor &= points[:, 0] > 0.01
    wall &= points[:, 2] > 0.01
    assert np.degrees(np.arccos(np.minimum(flat.normals[floor, 2], 1))).max() < 0.3
    assert np.abs(flat.points[floor, 2]).max() < 0.0005
    assert np.degrees(np.arccos(np.minimum(flat.normals[wall, 0], 1))).max() < 0.3
    assert np.abs(flat.points[wall, 0]).max() < 0.0005


def test_what_bends_stays_as_it_is() -> None:
    ball = trimesh.creation.icosphere(6, 0.4)
    told = planes_of(ball.vertices, ball.vertex_normals)
    flat, flats = flattened(told, SPACING_M)
    assert flats.broad.mean() < 0.05
    radius = np.linalg.norm(flat.points, axis=1)
    assert np.abs(radius - 0.4).max() < 3 * NOISE_M


def test_a_floor_is_flat_though_its_normals_lean_a_little_toward_its_middle() -> None:
    """A thousandth of a metre's turn a metre, as where stations' beams come in aslant."""
    rng = np.random.default_rng(5)
    points = rng.uniform(-2.5, 2.5, (60_000, 3))
    points[:, 2] = rng.normal(0, NOISE_M / 2, len(points))
    normals = rng.normal(0, 0.04, points.shape) - 0.001 * points
    normals[:, 2] += 1
    flat, flats = flattened(planes_of(points, normals), 0.02)
    assert flats.broad.mean() > 0.99
    assert np.abs(flat.points[:, 2]).max() < 0.0005


def test_a_rail_seen_from_one_side_is_found_and_a_wall_is_none() -> None:
    rng = np.random.default_rng(1)
    (points, normals), (more, outward) = corner(rng), rail(rng)
    points, normals = np.concatenate([points, more]), np.concatenate([normals, outward])
    told = planes_of(points, normals)
    _, flats = flattened(told, SPACING_M)
    found, theirs = rods(told, told.points, ~flats.broad, SPACING_M)
    assert len(found) == 1
    (rod,) = found
    assert abs(rod.radius_m - 0.01) < 0.002
    along = rod.axis[-1] - rod.axis[0]
    assert abs(along[2]) > 0.999 * np.linalg.norm(along)
    assert abs(rod.length_m - 0.4) < 0.04
    assert np.linalg.norm(rod.axis.mean(axis=0) - [2, 2, 0.5]) < 0.02
    assert theirs[-80:].mean() > 0.9
    assert not theirs[:-80].any()


HANDRAIL_M = 0.02


def test_a_stout_leg_is_found_where_points_lie_close() -> None:
    """Four millimetres apart on 32: no direction in which its points alone run on."""
    rng = np.random.default_rng(0)
    count = 4000
    height, angle = rng.uniform(0, 1.1, count), rng.uniform(-1.4, 1.4, count)
    outward = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    raw = np.float32((0.016 + rng.normal(0, NOISE_M, count))[:, None] * outward)
    raw[:, 2] = height
    found, theirs = rods(planes_of(raw, outward), raw, np.ones(count, bool), 0.004)
    assert len(found) == 1
    assert abs(found[0].radius_m - 0.016) < 0.001
    assert np.abs(found[0].axis[:, :2]).max() < 0.001
    assert np.allclose(np.sort(found[0].axis[:, 2]), [0, 1.1], atol=0.02)
    assert theirs.mean() > 0.99


def handrail(turn: np.ndarray) -> np.ndarray:
    """Places of a handrail that winds up a shaft of a metre."""
    return np.stack([np.cos(turn), np.sin(turn), 0.4 * turn + 1], axis=1)


def on_handrail(rng: np.random.Generator, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of it, seen from within the shaft."""
    inward = np.stack([-np.cos(turn), -np.sin(turn), np.zeros(len(turn))], axis=1)
    along = np.stack([-np.sin(turn), np.cos(turn), np.full(len(turn), 0.4)], axis=1)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    angle = rng.uniform(-1.3, 1.3, len(turn))
    outward = np.cos(angle)[:, None] * inward
    outward += np.sin(angle)[:, None] * np.cross(along, inward)
    off = HANDRAIL_M + rng.normal(0, NOISE_M, len(turn))
    return handrail(turn) + off[:, None] * outward, outward


def test_a_handrail_is_traced_up_a_winding_stair_through_its_sparse_stretches() -> None:
    rng = np.random.default_rng(2)
    turn = np.concatenate([rng.uniform(0, 6, 1500), rng.uniform(2, 4, 500)])
    sparse = (turn > 4.5) & (turn < 5.2)
    turn = turn[~sparse | (rng.random(len(turn)) < 0.3)]
    points, normals = on_handrail(rng, turn)
    told = planes_of(points, normals)
    found, theirs = rods(told, told.points, np.ones(len(points), bool), SPACING_M)
    assert theirs.mean() > 0.97
    axis = np.concatenate([rod.axis for rod in found])
    away = np.linalg.norm(axis[:, None] - handrail(np.arange(-0.1, 6.1, 0.001)), axis=2).min(1)
    assert np.quantile(away, 0.9) < 0.003
    assert sum(rod.length_m for rod in found) == pytest.approx(6 * np.hypot(1, 0.4), abs=0.1)
    for rod in found:
        assert rod.radius_m == pytest.approx(HANDRAIL_M, abs=0.003)


def ring(rng: np.random.Generator, count: int = 600) -> tuple[np.ndarray, np.ndarray]:
    """Points of a ring of 24 mm, half a metre wide, seen from above."""
    turn = rng.uniform(0, 2 * np.pi, count)
    away = np.stack([np.cos(turn), np.sin(turn), np.zeros(count)], axis=1)
    angle = rng.uniform(0, np.pi, count)
    outward = np.cos(angle)[:, None] * away + np.sin(angle)[:, None] * [0.0, 0.0, 1.0]
    return 0.25 * away + (0.012 + rng.normal(0, NOISE_M, count))[:, None] * outward, outward


def test_a_ring_is_traced_once() -> None:
    points, normals = ring(np.random.default_rng(4))
    told = planes_of(points, normals)
    found, theirs = rods(told, told.points, np.ones(len(points), bool), SPACING_M)
    assert theirs.mean() > 0.95
    assert sum(rod.length_m for rod in found) == pytest.approx(np.pi / 2, abs=0.1)


def test_the_rim_of_a_lampshade_is_no_rod() -> None:
    """A ring, from which five petals of thin glass rise to the middle."""
    rng = np.random.default_rng(4)
    points, normals = ring(rng)
    turn, out = rng.uniform(0, 2 * np.pi, 1000), 0.25 * np.sqrt(rng.uniform(0.2, 1, 1000))
    petal = np.sin(5 * turn) > 0.5
    turn, out = turn[petal], out[petal]
    glass = np.stack([out * np.cos(turn), out * np.sin(turn), 0.6 * (0.25 - out)], axis=1)
    up = np.stack([0.6 * np.cos(turn), 0.6 * np.sin(turn), np.ones(len(turn))], axis=1)
    told = planes_of(np.concatenate([points, glass]), np.concatenate([normals, up]))
    assert not rods(told, told.points, np.ones(len(told.points), bool), SPACING_M)[0]


def test_two_dense_rows_of_beams_on_a_board_are_no_rod() -> None:
    """A board whose rows lie far apart, and two near each other through which a tube would fit."""
    rng = np.random.default_rng(5)
    rows, along = np.meshgrid(np.arange(-0.165, 0.17, 0.055), np.arange(0, 2, 0.022))
    board = np.stack([rows.ravel(), along.ravel()], axis=1)
    row = np.stack([rng.choice([-0.0055, 0.0055], 400), np.linspace(0, 2, 400)], axis=1)
    flat = np.concatenate([board, row])
    points = np.column_stack([flat, rng.normal(0, NOISE_M, len(flat))])
    told = planes_of(points, np.tile([0.0, 0, 1], (len(points), 1)))
    told = replace(told, spacing_m=np.repeat(np.float32([0.039, 0.02]), [len(board), len(row)]))
    assert not rods(told, told.points, np.ones(len(points), bool), SPACING_M)[0]


def test_tubes_are_closed_and_look_outward() -> None:
    nothing = Mesh(np.zeros(3), np.empty((0, 3), np.float32), np.empty((0, 3), np.int32))
    along = np.array([0.6, 0.0, 0.8])
    two = (
        Rod(np.array([np.zeros(3), 0.5 * along]), 0.01),
        Rod(np.array([np.ones(3), np.ones(3) - 0.3 * along]), 0.02),
    )
    mesh = with_tubes(nothing, two, 0.025)
    shape = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert shape.is_watertight
    wanted = np.pi * (0.5 * 0.01**2 + 0.3 * 0.02**2)
    assert abs(shape.volume / wanted - 1) < 0.05


def test_a_bent_tube_is_closed_and_does_not_twist() -> None:
    nothing = Mesh(np.zeros(3), np.empty((0, 3), np.float32), np.empty((0, 3), np.int32))
    rod = Rod(handrail(np.arange(0, 6, 0.01)), HANDRAIL_M)
    mesh = with_tubes(nothing, (rod,), 0.025)
    shape = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert shape.is_watertight
    assert shape.volume == pytest.approx(np.pi * HANDRAIL_M**2 * rod.length_m, rel=0.05)
    along_m, off_m = rod.of(mesh.vertices[:-2])
    assert np.abs(off_m).max() < 0.001
    assert along_m.max() == pytest.approx(rod.length_m, abs=0.001)
