"""Thinning what is crowded: one point a voxel, as it was measured, drawn by lot."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tourgen.stages import crowding
from tourgen.stages.crowding import Settings


@settings(deadline=None)  # the first compiles
@given(st.integers(1, 400), st.integers(0, 2**32 - 1))
def test_each_voxel_keeps_one_of_its_points(count: int, seed: int) -> None:
    points = np.random.default_rng(seed).uniform(-1, 1, (count, 3)).astype(np.float32)
    kept = crowding.crowding(points, Settings(0.4, 0.4, 0))
    cells = [tuple(cell) for cell in np.floor(points / np.float64(0.4)).astype(int)]
    assert (np.diff(kept) > 0).all()
    assert sorted(cells[i] for i in kept) == sorted(set(cells))


def test_who_comes_first_has_no_better_chance() -> None:
    """Of two stations in one cloud, one after the other, each keeps its share of every voxel."""
    points = np.random.default_rng(0).uniform(0, 1, (600_000, 3)).astype(np.float32)
    kept = crowding.crowding(points, Settings(0.05, 0.05, 0))
    assert len(kept) == 8000
    assert abs((kept < len(points) // 2).mean() - 0.5) < 0.03


def test_a_table_that_grows_forgets_nothing() -> None:
    line = (np.arange(300_000)[:, None] * np.array([1.0, 0, 0])).astype(np.float32)
    assert np.array_equal(crowding.crowding(line, Settings(0.5, 0.5, 0)), np.arange(300_000))
    twice = crowding.crowding(np.concatenate([line, line]), Settings(0.5, 0.5, 0))
    assert np.array_equal(np.sort(twice % 300_000), np.arange(300_000))


def test_few_points_are_kept_whole() -> None:
    points = np.zeros((100, 3), np.float32)
    assert len(crowding.crowding(points, Settings(0.1, 0.1, 100))) == 100
    assert len(crowding.crowding(points, Settings(0.1, 0.1, 99))) == 1


def test_where_too_many_would_stay_voxels_are_wider() -> None:
    points = np.random.default_rng(0).uniform(0, 1, (20_000, 3)).astype(np.float32)
    few = crowding.crowding(points, Settings(0.1, 0.2, 0, most=1000))
    fewer = crowding.crowding(points, Settings(0.1, 0.2, 0, most=999))
    assert (len(few), len(fewer)) == (1000, 125)
