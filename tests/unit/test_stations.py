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
