"""From raw points to oriented ones: strays go, density evens out, normals look inward."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tourgen.errors import InputError
from tourgen.geometry import OrientedCloud, PointCloud
from tourgen.stages import floor, free_space, normals, sift, sight, spacing, stations, thin
from tourgen.voxels import voxel_groups

ROOM_M = np.array([4.0, 5.0, 2.6])


def cloud(points: np.ndarray, station: int = -1) -> PointCloud:
    count = len(points)
    return PointCloud(
        np.zeros(3),
        np.asarray(points, np.float32),
        np.full((count, 3), 128, np.uint8),
        np.full(count, station, np.int16),
    )


def box_points(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points spread evenly over the inside of a 4 x 5 x 2.6 m box about the z axis, and normals."""
    rng = np.random.default_rng(seed)
    area = np.array([ROOM_M[1] * ROOM_M[2], ROOM_M[0] * ROOM_M[2], ROOM_M[0] * ROOM_M[1]])
    axis = rng.choice(3, count, p=area / area.sum())
    side = rng.choice([0.0, 1.0], count)
    points = rng.random((count, 3))
    points[np.arange(count), axis] = side
    inward = np.zeros((count, 3))
    inward[np.arange(count), axis] = 1 - 2 * side
    return (points - [0.5, 0.5, 0]) * ROOM_M, inward


def scanned_box(eyes: np.ndarray, rays: int) -> np.ndarray:
    """What scanners see of that box: even directions, nothing below -60 degrees."""
    rng = np.random.default_rng(1)
    found = []
    for eye in eyes:
        way = rng.normal(size=(rays, 3))
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        way = way[way[:, 2] > -np.sin(np.radians(60))]
        wall = np.where(way > 0, ROOM_M * [0.5, 0.5, 1], -ROOM_M * [0.5, 0.5, 0])
        found.append(eye + way * ((wall - eye) / way).min(axis=1)[:, None])
    return np.concatenate(found)


# ------------------------------------------------------------------ sift


def _sifted(points: np.ndarray) -> PointCloud:
    return sift.sift(cloud(points), np.empty((0, 3)), sift.Settings()).cloud


def test_strays_and_islands_go_and_the_room_stays() -> None:
    points, _ = box_points(60_000)
    rng = np.random.default_rng(3)
    strays = rng.uniform([-1.5, -2, 0.5], [1.5, 2, 2.1], (100, 3))
    island = rng.normal([9, 0, 1], 0.02, (80, 3))
    kept = _sifted(np.concatenate([points, strays, island]))
    is_room = np.isin(kept.points[:, 0], np.float32(points[:, 0]))
    assert (~is_room).sum() <= 3
    assert is_room.sum() > 0.995 * len(points)


def test_density_alone_makes_no_stray() -> None:
    dense = np.random.default_rng(0).random((40_000, 3)) * [1, 1, 0]
    sparse = np.random.default_rng(1).random((2_000, 3)) * [2, 1, 0] + [1, 0, 0]
    kept = _sifted(np.concatenate([dense, sparse]))
    assert len(kept) > 0.995 * 42_000


def test_too_few_points_are_told() -> None:
    with pytest.raises(InputError, match="expected at least 10000 points, found 50"):
        _sifted(box_points(50)[0])


# ------------------------------------------------------------------ thin, spacing


@settings(max_examples=25, deadline=None)
@given(voxel_m=st.floats(0.02, 1.0), seed=st.integers(0, 1000))
def test_one_point_a_voxel_and_their_mean_stays(voxel_m: float, seed: int) -> None:
    points, _ = box_points(2_000, seed)
    thinned = thin.thin(cloud(points), thin.Settings(voxel_m))
    low = np.float32(points).min(axis=0)
    cells = np.floor((np.float32(points) - low) / voxel_m).astype(int)
    expected, count = np.unique(cells, axis=0, return_counts=True)
    assert len(thinned) == len(expected)
    order, starts = voxel_groups(np.float32(points), voxel_m)
    weight = np.diff(np.append(starts, len(order)))
    assert sorted(weight) == sorted(count)
    mean = (thinned.points * weight[:, None]).sum(axis=0) / weight.sum()
    assert np.allclose(mean, points.mean(axis=0), atol=1e-4)


def test_spacing_is_that_of_the_grid() -> None:
    x, y = np.meshgrid(np.arange(0, 2, 0.01), np.arange(0, 2, 0.01))
    rng = np.random.default_rng(0)
    grid = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    grid[:, :2] += rng.uniform(-0.003, 0.003, (len(grid), 2))
    measured = spacing.spacing(cloud(grid))
    assert measured.median_m == pytest.approx(0.01, rel=0.15)
    assert measured.fine_m <= measured.median_m


# ------------------------------------------------------------------ stations


@pytest.mark.parametrize("most", [250_000, 80_000], ids=["every point", "one in three"])
def test_stations_are_found_by_their_blind_discs(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stations, "_MOST_POINTS", most)
    eyes = np.array([[-1.0, -1.2, 1.5], [0.9, 1.1, 1.45]])
    found = stations.find_stations(np.float32(scanned_box(eyes, 250_000)), stations.Settings())
    assert len(found) == 2
    found = found[np.argsort(found[:, 0])]
    assert np.abs(found[:, :2] - eyes[:, :2]).max() < 0.08
    assert np.abs(found[:, 2] - eyes[:, 2]).max() < 0.15


def test_where_no_disc_is_none_is_found() -> None:
    points = np.float32(box_points(300_000)[0])
    assert len(stations.find_stations(points, stations.Settings())) == 0


# ------------------------------------------------------------------ sight, normals


@pytest.mark.parametrize("owner", [0, -1])
def test_a_station_sees_what_nothing_hides_and_knows_what_is_empty(owner: int) -> None:
    eye = np.array([0.0, 0.0, 1.5])
    points, inward = box_points(200_000)
    rng = np.random.default_rng(5)
    board = np.stack(
        [np.full(20_000, 1.0), rng.uniform(-0.5, 0.5, 20_000), rng.uniform(1, 2, 20_000)], axis=1
    )
    window = (
        (points[:, 1] > 2.49) & (np.abs(points[:, 0]) < 0.4) & (np.abs(points[:, 2] - 1.5) < 0.4)
    )
    seen = np.float32(np.concatenate([points[~window], board]))
    buffer = sight.depth_buffer(seen, eye, 0.75)
    behind = (
        (points[:, 0] > 1.99) & (np.abs(points[:, 1]) < 0.8) & (np.abs(points[:, 2] - 1.5) < 0.8)
    )
    ray = eye - points
    cosine = np.float32((ray * inward).sum(axis=1) / np.linalg.norm(ray, axis=1))
    hidden = ~buffer.sees(np.float32(points[behind]), cosine[behind])
    assert hidden.mean() > 0.95, "some cells of the buffer miss the board"
    clear = points[:, 0] < 0
    assert buffer.sees(np.float32(points[clear]), cosine[clear]).mean() > 0.995
    glass = np.float32(points[window] * [0.8, 1, 1])
    inner = (np.abs(glass[:, 0]) < 0.3) & (np.abs(glass[:, 2] - 1.5) < 0.3)
    visible = buffer.sees(seen, np.ones(len(seen), np.float32)) if owner == 0 else slice(None)
    measured = cloud(seen[visible], owner)
    free = free_space.free_space(measured, eye[None], 1.1, -58, 0.08)
    assert free.holds(glass[inner]).all()
    assert free.leads_out(glass[inner]).all()
    assert not free.holds(np.float32(points[~window])).any()
    assert not free.leads_out(np.float32(points[~window & (points[:, 2] > 0.5)])).any()
    before = np.float32(eye + 0.8 * (points[clear & (points[:, 2] > 0.5)] - eye))
    assert free.holds(before).mean() > 0.99
    under = np.float32([[0.2, 0.1, 0.0]])
    assert not free.holds(under).any(), "it lies under the tripod"


@pytest.mark.parametrize(
    ("given", "owner"),
    [
        pytest.param([[0.5, 0.5, 1.5]], 0, id="the station of each point is known"),
        pytest.param([[0.5, 0.5, 1.5], [-1.0, -1.0, 1.4]], -1, id="stations are known"),
        pytest.param([], -1, id="nothing is known"),
    ],
)
def test_normals_look_inward(given: list[list[float]], owner: int) -> None:
    points, inward = box_points(12_000)
    points += np.random.default_rng(4).normal(0, 0.002, points.shape)
    known = np.array(given).reshape(-1, 3)
    oriented = normals.normals(cloud(points, owner), known, normals.Settings())
    assert np.allclose(np.linalg.norm(oriented.normals, axis=1), 1, atol=1e-5)
    right = np.einsum("ij,ij->i", oriented.normals, inward) > 0
    assert right.mean() > 0.995


def test_hidden_points_follow_their_neighbours() -> None:
    """A board that stands out of sight of the only station gets normals like those around."""
    points, _ = box_points(60_000)
    rng = np.random.default_rng(2)
    screen = rng.uniform([0.99, -1, 0], [1.01, 1, 2.6], (30_000, 3)) * [0, 1, 1] + [1, 0, 0]
    both = np.concatenate([points, screen])
    oriented = normals.normals(cloud(both), np.array([[-1.0, 0, 1.5]]), normals.Settings())
    wall = (both[:, 0] > 1.99) & (np.abs(both[:, 1]) < 2.4)
    assert (oriented.normals[wall, 0] < 0).mean() > 0.98


# ------------------------------------------------------------------ floor


def oriented_box(eyes: np.ndarray, keep: Callable[[np.ndarray], np.ndarray]) -> OrientedCloud:
    points = scanned_box(eyes, 60_000)
    points = points[keep(points)]
    up = np.zeros(points.shape, np.float32)
    up[np.arange(len(points)), np.argmin(np.abs(np.abs(points) - ROOM_M * [0.5, 0.5, 0]), 1)] = 1
    up[points[:, 2] > 2] *= -1
    return OrientedCloud(cloud(points), up, eyes)


def test_the_floor_goes_on_below_a_tripod() -> None:
    eye = np.array([[0.4, -0.3, 1.5]])
    bare = oriented_box(eye, lambda points: np.ones(len(points), bool))
    laid = floor.floor(bare, floor.Settings(spacing_m=0.03))
    new = laid.cloud.points[len(bare.cloud) :]
    assert np.abs(new[:, 2]).max() < 0.01
    away = np.linalg.norm(new[:, :2] - eye[0, :2], axis=1)
    assert away.max() < 1.5 * np.tan(np.radians(32)) + 0.01
    disc_m2 = np.pi * (1.5 * np.tan(np.radians(30))) ** 2
    assert len(new) * 0.03**2 == pytest.approx(disc_m2, rel=0.1)
    assert (laid.normals[len(bare.cloud) :] == [0, 0, 1]).all()
    assert (laid.cloud.station[len(bare.cloud) :] == floor.LAID).all()


def test_no_floor_is_laid_where_something_stands_or_nothing_is_level() -> None:
    eyes = np.array([[0.4, -0.3, 1.5], [-0.9, 1.2, 1.5]])
    seen = oriented_box(eyes, lambda points: np.ones(len(points), bool))
    laid = floor.floor(seen, floor.Settings(spacing_m=0.06))
    assert len(laid.cloud) - len(seen.cloud) < 40, "each station sees the other's disc"
    floorless = oriented_box(eyes[:1], lambda points: points[:, 2] > 0.1)
    assert len(floor.floor(floorless, floor.Settings(spacing_m=0.03)).cloud) == len(floorless.cloud)
