"""Auto: flat and sharp where points are, closed where they are not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sampled import borders, box_corner, cloud, faces_per_edge, runs_one_way, sphere
from scanned import EYES, ROOM, beams, cloud_of, inside, ranges, solid

from tourgen.geometry import OrientedCloud
from tourgen.stages.surface import auto, poisson, signed_distance

SPACING_M = 0.02
SETTINGS = auto.Settings(
    signed_distance.Settings(SPACING_M, SPACING_M),
    poisson.Settings(SPACING_M),
)

COARSE = auto.Settings(
    signed_distance.Settings(2 * SPACING_M, 2 * SPACING_M),
    poisson.Settings(2 * SPACING_M),
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


@pytest.mark.parametrize(
    "stations", [np.empty((0, 3)), np.full((1, 3), 0.5)], ids=["nobody", "one"]
)
def test_a_scene_without_an_end_ends_a_fifth_beyond_its_points(stations: np.ndarray) -> None:
    corner = box_corner(50)
    who = np.full(len(corner.cloud.points), len(stations) - 1, np.int16)
    seen = OrientedCloud(replace(corner.cloud, station=who), corner.normals, stations)
    found = auto.auto(seen, SETTINGS).mesh
    assert runs_one_way(found)
    assert found.vertices.max() < 1.3
    assert found.vertices.min() > -0.3


def test_points_too_far_apart_are_left_to_the_solve() -> None:
    sparse = replace(SETTINGS.distance, spacing_m=0.001, cell_m=0.02, reach=0.5)
    found = auto.auto(sphere(2_000), replace(SETTINGS, distance=sparse))
    assert found.dense_share == 0
    assert np.abs(np.linalg.norm(found.mesh.vertices, axis=1) - 1).max() < 0.02


def test_a_board_ends_where_beams_went_on_past_it() -> None:
    low, high = np.array([-0.6, 1.6, 1.175]), np.array([0.6, 2.0, 1.2])
    mesh = auto.auto(scanned(low, high), SETTINGS).mesh
    found = mesh.vertices
    ends = found[borders(mesh)].reshape(-1, 3)
    assert not ((ends > low - 0.3) & (ends < high + 0.3) & (ends < ROOM[1])).all(axis=1).any()
    beside = ((found > low - 0.06) & (found < high + 0.06)).all(axis=1)
    outside_m = np.linalg.norm(np.maximum(np.maximum(low - found, found - high), 0), axis=1)
    wall_m = (ROOM[1] - found).min(axis=1)
    watched = found[beside & (outside_m > 0.008) & (wall_m > 0.008)]
    assert not len(watched) or not np.any([went_on_past(watched, eye, low, high) for eye in EYES])


def test_beams_of_nobody_cut_nothing_back() -> None:
    """A pillar's back, guessed to be in sight of both eyes, hollowed it."""
    given = scanned(np.array([-0.2, -0.2, 0.0]), np.array([0.2, 0.2, 2.6]), merged=True)
    nowhere = replace(given, stations=np.empty((0, 3)))
    found, alone = (auto.auto(each, COARSE).mesh for each in (given, nowhere))
    assert np.array_equal(found.vertices, alone.vertices)
    assert np.array_equal(found.faces, alone.faces)


def scanned(low: np.ndarray, high: np.ndarray, *, merged: bool = False) -> OrientedCloud:
    """What two eyes see of a room and a box in it."""
    parts, normals = [], []
    for eye in EYES:
        way = beams(0.4).reshape(-1, 3)
        reach = ranges(eye, way, inside(*ROOM), solid(low, high))
        points = eye + way * reach[:, None]
        parts.append(points)
        normals.append(inward(points, low, high))
    return OrientedCloud(cloud_of(parts, merged=merged), np.concatenate(normals), EYES)


def went_on_past(places: np.ndarray, eye: np.ndarray, low: np.ndarray, high: np.ndarray) -> Any:
    """Which places an eye saw through, a beam's breadth around."""
    way = places - eye
    away = np.linalg.norm(way, axis=1)
    wide = np.radians(0.4) * away.max()
    reach = ranges(eye, way / away[:, None], inside(*ROOM), solid(low - wide, high + wide))
    return reach > away + 0.01


def inward(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Normals of a room's walls and of a box in it, into the free space."""
    gaps = np.concatenate([points - ROOM[0], ROOM[1] - points], axis=1)
    box = np.concatenate([low - points, points - high], axis=1)
    on_box = box.max(axis=1) < 1e-4
    side = np.where(on_box, np.abs(box).argmin(axis=1), np.abs(gaps).argmin(axis=1))
    sign = np.where((side < 3) == on_box, -1.0, 1.0)
    return np.eye(3)[side % 3] * sign[:, None]
