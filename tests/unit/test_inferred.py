"""Inferred: what no station saw is a guess, however near to points it runs."""

from __future__ import annotations

import numpy as np
import pytest

from tourgen.geometry import Float32, PointCloud
from tourgen.stages.inferred import INFERRED, Settings, inferred, measured

STATION = np.array([[0.0, 0.0, 1.5]])
SETTINGS = Settings(detail_m=0.006)
DISC_M = 0.85
APART_M = 0.01
BOARD_X, WALL_X = 1.9, 1.95
"""A board before a wall: 0.5 m wide, at the height of the scanner."""


def scanned(points: Float32, station: int) -> PointCloud:
    return PointCloud(
        np.zeros(3),
        np.float32(points),
        np.zeros((len(points), 3), np.uint8),
        np.full(len(points), station, np.int16),
    )


def lattice(low: tuple[float, float], high: tuple[float, float]) -> np.ndarray:
    """(n, 2) points ``APART_M`` apart."""
    x, y = (np.arange(a, b, APART_M) for a, b in zip(low, high, strict=True))
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def floor() -> np.ndarray:
    at = lattice((-2, -2), (2, 2))
    at = at[np.hypot(*at.T) > DISC_M]
    return np.column_stack([at, np.zeros(len(at))])


def board_and_wall() -> np.ndarray:
    board = lattice((-0.25, 1.0), (0.25, 2.0))
    wall = lattice((-1, 0.2), (1, 2.8))
    shade = WALL_X / BOARD_X
    hidden = (np.abs(wall[:, 0]) < 0.25 * shade) & (np.abs(wall[:, 1] - 1.5) < 0.5 * shade)
    return np.concatenate(
        [
            np.column_stack([np.full(len(board), BOARD_X), board]),
            np.column_stack([np.full((~hidden).sum(), WALL_X), wall[~hidden]]),
        ]
    )


@pytest.mark.parametrize("owner", [0, -1], ids=["its station told", "not told"])
def test_the_disc_under_a_tripod_is_a_guess_up_to_its_edge(owner: int) -> None:
    """A spot 40 mm from a point is one where points lie 10 mm apart."""
    along = np.float32([0.0, 0.5, DISC_M - 0.04, DISC_M + 0.03, 1.5])
    places = np.column_stack([along, 0 * along, 0 * along])
    found = measured(places, scanned(floor(), owner), STATION, SETTINGS)
    assert found.tolist() == [False, False, False, True, True]


def test_the_shadow_of_a_board_is_a_guess_though_the_board_is_near() -> None:
    cloud = scanned(board_and_wall(), 0)
    back = BOARD_X + 0.02
    places = np.float32([[x, y, 1.4] for x, y in ((WALL_X, 0.1), (back, 0.1))])
    assert not measured(places, cloud, STATION, SETTINGS).any()
    places = np.float32([[x, y, 1.4] for x, y in ((BOARD_X, 0.1), (WALL_X, 0.6))])
    assert measured(places, cloud, STATION, SETTINGS).all()


def test_what_a_beam_passed_by_is_a_guess_beside_the_points_of_another_surface() -> None:
    """The hidden flank of a box meets the wall that was seen: its last 30 mm lie near to that."""
    cloud = scanned(board_and_wall(), 0)
    flank = np.float32([[x, 0.25, 1.5] for x in (1.92, 1.93, 1.94)])
    assert not measured(flank, cloud, STATION, SETTINGS).any()


def test_a_place_between_points_that_lie_far_apart_was_measured() -> None:
    far = lattice((-1, -1), (1, 1)) * 6  # 60 mm apart
    cloud = scanned(np.column_stack([np.full(len(far), 5.0), far]), 0)
    assert measured(np.float32([[5.0, 0.03, 0.03]]), cloud, STATION, SETTINGS).all()


def test_noise_beyond_the_distance_between_points_leaves_a_surface_measured() -> None:
    dense = lattice((-1, -1), (1, 1)) * 0.05  # half a millimetre apart
    noise = np.random.default_rng(0).normal(0, 0.002, len(dense))
    cloud = scanned(np.column_stack([dense[:, 0], dense[:, 1] + 1, noise]), 0)
    places = np.float32([[0, 1 + y, 0] for y in (-0.01, 0.0, 0.01, 0.02)])
    assert measured(places, cloud, STATION, SETTINGS).all()


def test_a_station_of_a_few_points_measured_nothing() -> None:
    assert not measured(
        np.float32([[1, 0, 0]]), scanned(np.float32([[1, 0, 0]] * 3), 0), STATION, SETTINGS
    ).any()


def test_each_mesh_gets_its_own_marks() -> None:
    meshes = (np.float32([[0, 0, 0]]), np.float32([[1.5, 0, 0], [0.1, 0, 0]]))
    marks = inferred(meshes, scanned(floor(), 0), STATION, SETTINGS)
    assert [each.tolist() for each in marks] == [[INFERRED], [0, INFERRED]]
