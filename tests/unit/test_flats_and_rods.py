"""What is flat becomes flat, what is bent stays bent, and a rail is a tube again."""

from __future__ import annotations

import numpy as np
import trimesh

from tourgen.geometry import Mesh
from tourgen.stages.surface.flats import flattened
from tourgen.stages.surface.rods import Rod, rods, with_tubes
from tourgen.stages.surface.tangent_planes import TangentPlanes

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
    assert abs(rod.along[2]) > 0.999
    assert abs(rod.length_m - 0.4) < 0.04
    middle = rod.start + rod.length_m / 2 * rod.along
    assert np.linalg.norm(middle - [2, 2, 0.5]) < 0.02
    assert theirs[-80:].mean() > 0.9
    assert not theirs[:-80].any()


def test_tubes_are_closed_and_look_outward() -> None:
    nothing = Mesh(np.zeros(3), np.empty((0, 3), np.float32), np.empty((0, 3), np.int32))
    along = np.array([0.6, 0.0, 0.8])
    two = (Rod(np.zeros(3), along, 0.5, 0.01), Rod(np.ones(3), -along, 0.3, 0.02))
    mesh = with_tubes(nothing, two, 0.025)
    shape = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert shape.is_watertight
    wanted = np.pi * (0.5 * 0.01**2 + 0.3 * 0.02**2)
    assert abs(shape.volume / wanted - 1) < 0.05
