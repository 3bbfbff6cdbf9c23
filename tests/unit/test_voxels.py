"""Points by voxel, and the box about them."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tourgen.extent import extent
from tourgen.voxels import grouped, voxels


@given(st.integers(1, 200), st.integers(0, 2**32 - 1), st.floats(0.01, 3))
def test_voxels_hold_the_points_within_them(count: int, seed: int, voxel_m: float) -> None:
    points = np.random.default_rng(seed).normal(size=(count, 3)).astype(np.float32)
    number, shape = voxels(points, voxel_m)
    cell = np.stack(np.unravel_index(number, shape), axis=1)
    low = points.min(axis=0)
    assert np.array_equal(cell, ((points - low) / np.float32(voxel_m)).astype(int))
    order, starts = grouped(number)
    for group in np.split(order, starts[1:]):
        assert len(set(number[group])) == 1
        assert (np.diff(group) > 0).all()
    assert len(starts) == len(np.unique(number))


def test_no_points_have_no_voxels() -> None:
    number, shape = voxels(np.empty((0, 3), np.float32), 0.1)
    order, starts = grouped(number)
    assert len(number) == len(order) == len(starts) == 0
    assert shape.tolist() == [0, 0, 0]


@given(st.integers(1, 100), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_extent_is_the_least_and_the_most(count: int, columns: int, seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(count, columns))
    low, high = extent(points)
    assert np.array_equal(low, points.min(axis=0))
    assert np.array_equal(high, points.max(axis=0))
