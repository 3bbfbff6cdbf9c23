"""The nearest points are those that a tree finds, wherever they and the places lie."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from tourgen import threads
from tourgen.neighbours import Neighbours


def room(rng: np.random.Generator, count: int) -> np.ndarray:
    """A wall, a floor ten times as dense, a spot of points, a stray far off."""
    wall = rng.uniform([0, 0, 0], [0, 4, 3], (count, 3))
    floor = rng.uniform([0, 0, 0], [1, 1, 0], (count, 3))
    spot = np.full((count // 20 + 1, 3), [2.0, 2.0, 1.0])
    return np.float32(np.concatenate([wall, floor, spot, [[40.0, -30.0, 5.0]]]))


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 3000),
    wanted=st.integers(1, 40),
    most_m=st.sampled_from([np.inf, 0.05, 1.0]),
)
def test_distances_are_those_of_a_tree(seed: int, count: int, wanted: int, most_m: float) -> None:
    rng = np.random.default_rng(seed)
    points = room(rng, count)
    places = np.float32(np.concatenate([points[::7], rng.uniform(-3, 6, (30, 3)), [[99, 0, -99]]]))
    number, away = Neighbours.of(points, wanted).nearest(places, wanted, most_m)
    true, _ = cKDTree(points).query(places, k=np.arange(1, wanted + 1), distance_upper_bound=most_m)
    np.testing.assert_allclose(away, true, rtol=1e-4, atol=2e-5)
    np.testing.assert_array_equal(number < 0, np.isinf(away))
    told = np.linalg.norm(points[number].astype(float) - places[:, None], axis=2)
    np.testing.assert_allclose(np.where(number < 0, np.inf, told), away, rtol=1e-4, atol=2e-5)


def test_no_point_is_named_twice() -> None:
    points = room(np.random.default_rng(1), 800)
    number, _ = Neighbours.of(points, 16).nearest(points, 16)
    assert all(len(set(each)) == 16 for each in number.tolist())


@pytest.mark.parametrize(
    "points",
    [
        pytest.param(np.zeros((0, 3)), id="none"),
        pytest.param(np.zeros((1, 3)), id="one"),
        pytest.param(np.zeros((500, 3)), id="one spot"),
        pytest.param(np.linspace(0, 1, 300)[:, None] * [1.0, 2.0, 3.0], id="a line"),
        pytest.param(np.array([[0.0, 0, 0], [1e-7, 0, 0], [1e4, 0, 0]]), id="far apart"),
    ],
)
def test_odd_clouds_are_searched_too(points: np.ndarray) -> None:
    number, away = Neighbours.of(points, 4).nearest(np.zeros((2, 3)), 4)
    found = min(4, len(points))
    assert (number[:, :found] >= 0).all()
    assert (number[:, found:] == -1).all()
    assert np.isinf(away[:, found:]).all()


def test_one_thread_finds_what_many_do(monkeypatch: pytest.MonkeyPatch) -> None:
    points = room(np.random.default_rng(2), 60_000)
    found = []
    for count in ("1", "3"):
        monkeypatch.setenv(threads.VARIABLE, count)
        found.append(Neighbours.of(points, 8).nearest(points, 8))
    np.testing.assert_array_equal(found[0][0], found[1][0])
    np.testing.assert_array_equal(found[0][1], found[1][1])


@pytest.mark.parametrize("count", [0, 1, 10, 23])
def test_parts_cover_the_work_once(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for share in ("1", "2"):
        monkeypatch.setenv(threads.VARIABLE, share)
        done = np.zeros(count, int)

        def job(first: int, last: int, done: np.ndarray = done) -> None:
            done[first:last] += 1

        threads.in_parts(job, count, 5)
        assert (done == 1).all()
