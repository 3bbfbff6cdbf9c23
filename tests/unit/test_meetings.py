"""Two flats that end short of each other go on to the line between them, and no farther."""

from __future__ import annotations

import numpy as np

from tourgen.stages.surface.flats import Flats
from tourgen.stages.surface.meetings import met
from tourgen.stages.surface.tangent_planes import TangentPlanes

SPACING_M = 0.012
FLOOR, WALL = 0, 1


def sheet(u_m: tuple[float, float], v_m: tuple[float, float]) -> np.ndarray:
    """(n, 2) places a spacing apart."""
    u, v = (np.arange(low + SPACING_M / 2, high, SPACING_M) for low, high in (u_m, v_m))
    return np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)


def room(
    floor_from_m: float, wall_from_m: float, rest: np.ndarray | None = None
) -> tuple[TangentPlanes, Flats]:
    """A floor (z = 0) and a wall (x = 0) of a metre; what lies on neither."""
    floor, wall = sheet((floor_from_m, 1), (0, 1)), sheet((0, 1), (wall_from_m, 1))
    rest = np.empty((0, 3)) if rest is None else rest
    points = np.concatenate(
        [
            np.insert(floor, 2, 0, axis=1),
            np.insert(wall, 0, 0, axis=1),
            rest,
        ]
    )
    normals = np.tile([1.0, 0, 1], (len(points), 1)) / np.sqrt(2)
    normals[: len(floor)] = [0, 0, 1]
    normals[len(floor) : len(floor) + len(wall)] = [1, 0, 0]
    of = np.repeat([FLOOR, WALL, -1], [len(floor), len(wall), len(rest)])
    count = len(points)
    planes = TangentPlanes(
        np.float32(points),
        np.float32(normals),
        np.full(count, SPACING_M, np.float32),
        np.ones(count, np.float32),
        0.001,
    )
    flats = Flats(np.array([[0.0, 0, 1], [1, 0, 0]]), np.zeros(2), np.zeros(2, bool), of)
    return planes, flats


def test_a_gap_beside_a_corner_is_filled_on_both_planes() -> None:
    planes, flats = room(0.04, 0.03)
    told = met(planes, flats, SPACING_M)
    new = told.points[len(planes.points) :]
    assert np.all((np.abs(new[:, 0]) < 1e-6) | (np.abs(new[:, 2]) < 1e-6))
    assert np.all(new[:, [0, 2]] > -1e-6)
    assert new[:, 0].max() < 0.045
    assert new[:, 2].max() < 0.035
    # From one end of the line to the other, each plane to within a third of a spacing.
    for across in (0, 2):
        near = new[(new[:, across] > 0) & (new[:, across] < SPACING_M / 3)]
        assert np.ptp(near[:, 1]) > 0.95
        assert np.diff(np.sort(near[:, 1])).max() < 1.5 * SPACING_M
    normals = told.normals[len(planes.points) :]
    assert np.array_equal(normals[:, 2] == 1, np.abs(new[:, 2]) < 1e-6)


def test_flats_too_far_from_each_other_stay_as_they_are() -> None:
    planes, flats = room(0.08, 0.08)
    assert np.array_equal(met(planes, flats, SPACING_M).points, planes.points)


def test_a_floor_that_goes_on_under_a_wall_is_not_cut() -> None:
    planes, flats = room(-1.0, 0.03)
    assert np.array_equal(met(planes, flats, SPACING_M).points, planes.points)


def test_what_the_scanner_mixed_of_both_goes_and_what_stands_apart_stays() -> None:
    along = np.arange(0.1, 0.9, 0.05)
    mixed = np.stack([np.full(16, 0.006), along, np.full(16, 0.006)], axis=1)
    planes, flats = room(0.02, 0.02, np.concatenate([mixed, mixed + np.array([0.05, 0, 0.05])]))
    told = met(planes, flats, SPACING_M)
    left = told.points[np.all(told.points[:, [0, 2]] > 0.001, axis=1)]
    assert len(left) == 16
    assert left[:, 0].min() > 0.05


def test_no_flats_are_no_fault() -> None:
    planes, flats = room(0.04, 0.03)
    none = Flats(np.empty((0, 3)), np.empty(0), np.zeros(0, bool), np.full(len(flats.of), -1))
    assert np.array_equal(met(planes, none, SPACING_M).points, planes.points)
