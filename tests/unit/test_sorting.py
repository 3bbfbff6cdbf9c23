"""The order that numpy finds, equal keys in their order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tourgen.sorting import distinct, order_of
from tourgen.voxels import voxel_groups


@settings(deadline=None)
@given(st.lists(st.integers(0, 2**62) | st.integers(0, 9), max_size=300))
def test_the_order_is_numpys(keys: list[int]) -> None:
    array = np.array(keys, np.int64)
    np.testing.assert_array_equal(order_of(array), np.argsort(array, kind="stable"))


@settings(deadline=None)
@given(st.lists(st.integers(-9, 9) | st.integers(0, 2**62), max_size=300))
def test_each_is_kept_once_as_numpy_does(keys: list[int]) -> None:
    array = np.array(keys, np.int64)
    np.testing.assert_array_equal(distinct(array), np.unique(array))


@pytest.mark.parametrize("voxel_m", [0.01, 0.1, 50.0])
def test_voxels_hold_the_points_that_lie_in_them(voxel_m: float) -> None:
    points = np.float32(np.random.default_rng(0).uniform(-2, 3, (5000, 3)))
    order, starts = voxel_groups(points, voxel_m)
    cell = np.floor((points - points.min(axis=0)) / np.float32(voxel_m)).astype(int)[order]
    first = np.concatenate([[True], (cell[1:] != cell[:-1]).any(axis=1)])
    np.testing.assert_array_equal(starts, np.flatnonzero(first))
    assert len(starts) == len(np.unique(cell, axis=0))
    np.testing.assert_array_equal(np.sort(order), np.arange(len(points)))
    assert cell[starts].tolist() == sorted(cell[starts].tolist())
