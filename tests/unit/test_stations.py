"""Stations: blind discs tell where a tripod stood; a bare ring round a newel does not."""

from __future__ import annotations

import numpy as np

from tourgen.stages import stations


def test_a_newel_with_bare_floor_around_it_is_no_station() -> None:
    """Round stairs leave a ring bare; a scanner never stands inside a column."""
    rng = np.random.default_rng(0)
    floor = rng.random((250_000, 3)) * [4, 4, 0] - [2, 2, 0]
    radius = np.hypot(floor[:, 0], floor[:, 1])
    keep = (radius > 0.8) & (rng.random(len(floor)) < np.exp(-3 * (radius - 0.8)) + 0.1)
    turn, height = rng.random((2, 40_000))
    newel = np.stack(
        [0.15 * np.cos(2 * np.pi * turn), 0.15 * np.sin(2 * np.pi * turn), 3 * height], axis=1
    )
    bare = np.float32(floor[keep])
    assert len(stations.find_stations(bare, stations.Settings())) == 1
    both = np.concatenate([bare, np.float32(newel)])
    assert len(stations.find_stations(both, stations.Settings())) == 0


def test_a_tripod_on_a_dais_is_found_beside_one_on_the_floor() -> None:
    """The floor under the dais is bare, and most points lie on the rest of it."""
    rng = np.random.default_rng(0)
    found = stations.find_stations(
        np.concatenate(
            [
                scanned_level(rng, (-4, -2.5), (4, 2.5), 0.0, (-2.0, 0.0)),
                scanned_level(rng, (0.5, -1.5), (3.5, 1.5), 0.15, (2.0, 0.1)),
                np.float32(rng.uniform([-4, -2.5, 2.8], [4, 2.5, 2.8], (100_000, 3))),
            ]
        ),
        stations.Settings(),
    )
    expected = [[-2.0, 0.0, 1.4], [2.0, 0.1, 1.55]]
    np.testing.assert_allclose(found[found[:, 0].argsort()], expected, atol=0.12)


def scanned_level(
    rng: np.random.Generator,
    low: tuple[float, float],
    high: tuple[float, float],
    height: float,
    tripod: tuple[float, float],
) -> np.ndarray:
    """Points on a level, denser toward a tripod, none right under it."""
    points = np.column_stack([rng.uniform(low, high, (300_000, 2)), np.full(300_000, height)])
    away = np.hypot(*(points[:, :2] - tripod).T)
    density = np.exp(-1.5 * (away - 0.8)) + 0.05
    return np.float32(points[(away > 0.8) & (rng.random(len(points)) < density)])


def test_ground_far_outside_takes_no_memory() -> None:
    """Seen through a door, at the floor's height: the map had covered all of it."""
    rng = np.random.default_rng(0)
    room = scanned_level(rng, (-4, -2.5), (4, 2.5), 0.0, (-2.0, 0.0))
    ground = np.float32(rng.uniform([-2e4, -2e4, 0], [2e4, 2e4, 0], (len(room) // 200, 3)))
    found = stations.find_stations(np.concatenate([room, ground]), stations.Settings())
    np.testing.assert_allclose(found, [[-2.0, 0.0, 1.4]], atol=0.12)
