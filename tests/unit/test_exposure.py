"""Stations of different exposure come to one; glare gives way to what other stations saw."""

from __future__ import annotations

import numpy as np
import pytest

from tourgen.geometry import PointCloud
from tourgen.stages.exposure import Settings, exposure, gains, solve_gains

GAINS = np.array([[1.06, 1.02, 0.97], [0.95, 0.99, 1.01], [0.94, 1.05, 1.03]])
STATIONS = np.array([[-1.0, 0.0, 1.5], [1.0, 0.0, 1.5], [0.0, 1.0, 1.5]])


def painted(places: np.ndarray) -> np.ndarray:
    """A floor of uneven colours, 40 to 200."""
    waves = np.stack(
        [np.sin(7 * places[:, 0]), np.cos(5 * places[:, 1]), np.sin(3 * places.sum(1))]
    )
    return 120 + 80 * waves.T


def wall(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    places = np.column_stack([rng.random((count, 2)) * 2, np.zeros(count)])
    return places.astype(np.float32), rng.integers(0, 3, count).astype(np.int16)


def cloud_of(places: np.ndarray, colors: np.ndarray, station: np.ndarray) -> PointCloud:
    shown = np.clip(np.rint(colors), 0, 255).astype(np.uint8)
    return PointCloud(np.zeros(3), places, shown, station)


def exposed_wall(count: int = 60_000) -> PointCloud:
    places, station = wall(count)
    return cloud_of(places, painted(places) * GAINS[station], station)


def test_gains_come_out_up_to_a_common_factor() -> None:
    cloud = exposed_wall()
    found = gains(cloud.points, cloud.colors, cloud.station, 3, Settings())
    expected = GAINS / np.exp(np.log(GAINS).mean(0))
    assert np.abs(found / expected - 1).max() < 0.002


def test_a_passer_by_and_saturation_do_not_pull_the_gains() -> None:
    places, station = wall(60_000)
    colors = painted(places) * GAINS[station]
    colors[(station == 0) & (places[:, 0] < 0.4)] = (20, 30, 90)  # somebody in front of a fifth
    colors[places[:, 1] > 1.5] *= 1.9  # clipped in part
    cloud = cloud_of(places, colors, station)
    found = gains(cloud.points, cloud.colors, cloud.station, 3, Settings())
    assert np.abs(found / (GAINS / np.exp(np.log(GAINS).mean(0))) - 1).max() < 0.004


def test_colours_of_all_stations_agree_after_it() -> None:
    even = exposure(exposed_wall(), STATIONS, Settings())
    off = even.colors - painted(even.points) / np.exp(-np.log(GAINS).mean(0))
    by_station = np.array([off[even.station == k].mean(0) for k in range(3)])
    assert np.ptp(by_station, axis=0).max() < 0.5
    assert np.abs(off).max() < 2.5


def test_what_one_camera_clipped_is_as_bright_as_the_others_saw_it() -> None:
    """A third of the wall is too bright for one camera; half of that no other one sees."""
    places, station = wall(120_000)
    clean = np.full((len(places), 3), 120.0) + 40 * np.sin(7 * places[:, :1])
    clean[places[:, 0] > 1.3] = 228
    gain = np.array([[0.95], [1.0], [1.3]])
    cloud = cloud_of(places, clean * gain[station], station)
    lone = (places[:, 0] > 1.3) & (places[:, 1] > 1.0)
    even = exposure(cloud.take(~lone | (station == 2)), STATIONS, Settings())
    bright = even.points[:, 0] > 1.35
    seen = even.colors[bright & (even.points[:, 1] < 0.95) & (even.station < 2)].mean()
    for part in (even.points[:, 1] < 0.95, even.points[:, 1] > 1.05):
        told = even.colors[bright & part & (even.station == 2)].mean()
        assert told == pytest.approx(seen, abs=1.5)


def test_what_a_camera_clipped_is_told_by_what_others_saw_nearest_to_it() -> None:
    """About a lamp the wall is brighter than beside it; one station clips both."""
    places, station = wall(120_000)
    off = np.hypot(places[:, 0] - 1.65, places[:, 1] - 1.0)
    clean = np.full((len(places), 3), 120.0) + 40 * np.sin(7 * places[:, :1])
    clean[places[:, 0] > 1.3] = 200
    clean[off < 0.3] = 225
    clean[(places < 0.1).all(1)] = 240  # the others' cameras reach farther up than that
    gain = np.array([[1.0], [1.0], [1.3]])
    cloud = cloud_of(places, clean * gain[station], station)
    even = exposure(cloud.take((off > 0.1) | (station == 2)), STATIONS, Settings())
    off = np.hypot(even.points[:, 0] - 1.65, even.points[:, 1] - 1.0)
    bright = even.points[:, 0] > 1.35
    for part in (off > 0.35, (off > 0.12) & (off < 0.25)):
        seen, told = (
            even.colors[bright & part & (even.station == k)].mean(dtype=float) for k in (0, 2)
        )
        assert told == pytest.approx(seen, abs=2)
    assert even.colors[off < 0.08].mean() == pytest.approx(seen, abs=3)


def test_a_remnant_of_unknown_station_joins_the_others() -> None:
    cloud = exposed_wall()
    station = cloud.station.copy()
    station[::20] = -1
    even = exposure(
        PointCloud(cloud.origin, cloud.points, cloud.colors, station), STATIONS, Settings()
    )
    off = even.colors - painted(even.points)
    assert np.abs(off[even.station < 0].mean(0) - off[even.station >= 0].mean(0)).max() < 1


def test_one_bad_pair_among_many_is_outvoted() -> None:
    pairs = np.array([(a, b) for a in range(5) for b in range(a)])
    true = np.linspace(-0.1, 0.1, 5)
    ratio = np.repeat((true[pairs[:, 0]] - true[pairs[:, 1]])[:, None], 3, axis=1)
    ratio[3] += 0.2
    found = solve_gains(pairs, ratio, np.full_like(ratio, 0.001), 5)
    assert np.abs(np.log(found) - true[:, None]).max() < 0.003


def test_groups_of_stations_that_see_nothing_in_common_keep_their_own_mean() -> None:
    pairs = np.array([[0, 1], [2, 3]])
    found = solve_gains(pairs, np.array([[0.1] * 3, [0.2] * 3]), np.full((2, 3), 0.001), 5)
    assert found[:, 0] == pytest.approx(np.exp([0.05, -0.05, 0.1, -0.1, 0.0]))


LAMP = np.array([1.0, 1.0, 0.8])
AROUND = np.array([[0.0, 1.0, 1.6], [2.0, 1.0, 1.6], [1.0, 0.0, 1.6]])
"""Stations that see the lamp before different places of the wall."""


def lamplit(gain: np.ndarray) -> tuple[PointCloud, np.ndarray]:
    """The wall behind a lamp, as three cameras of those gains see it; which points are dazzled."""
    places, station = wall(200_000)
    rng = np.random.default_rng(4)
    globe = rng.normal(size=(3000, 3))
    globe = LAMP + 0.1 * globe / np.linalg.norm(globe, axis=1)[:, None]
    places = np.concatenate([places, globe]).astype(np.float32)
    station = np.concatenate([station, rng.integers(0, 3, 3000).astype(np.int16)])
    clean = painted(places)
    clean[-3000:] = 255
    way, toward = places - AROUND[station], LAMP - AROUND[station]
    lengths = np.linalg.norm(way, axis=1) * np.linalg.norm(toward, axis=1)
    angle = np.degrees(np.arccos(np.clip((way * toward).sum(1) / lengths, -1, 1)))
    shown = np.minimum(clean + 340 * np.exp(-((angle / 4) ** 2))[:, None], 255)
    return cloud_of(places, shown * gain[station], station), shown[:, 0] - clean[:, 0] > 40


@pytest.mark.parametrize("ends_at", [255, 247, 243])
def test_glare_gives_way_to_a_station_that_is_not_dazzled(ends_at: int) -> None:
    """A camera that clips below 255, by its white balance, burns out all the same."""
    cloud, dazzled = lamplit(np.full((3, 1), ends_at / 255))
    lost = np.flatnonzero(cloud.points[:, 2] == 0)[:6]
    cloud.colors[lost] = 255  # another camera's
    even = exposure(cloud, AROUND, Settings())
    on_wall = even.points[:, 2] == 0
    clean = painted(even.points[on_wall]) * ends_at / 255
    assert dazzled.sum() > 1000
    assert (np.abs(even.colors[on_wall] - clean).max(1) > 40).sum() < 30
    assert on_wall.sum() > 180_000
    assert (~on_wall).sum() == 3000  # the lamp itself shines for every station


def test_what_only_a_dazzled_station_saw_takes_the_colours_about_it() -> None:
    cloud, dazzled = lamplit(np.ones((3, 1)))
    unseen = (cloud.station != 0) & (cloud.points[:, 2] == 0) & (cloud.points[:, 0] > 1.85)
    even = exposure(cloud.take(~unseen), AROUND, Settings())
    lone = ~unseen & (cloud.points[:, 0] > 1.9)  # beyond the cells that another one sees in part
    stays = even.points[:, 0] > 1.9
    assert np.array_equal(even.points[stays], cloud.points[lone])
    worst = dazzled[lone]
    assert worst.sum() > 100
    clean = painted(even.points[stays])[worst]
    before = np.abs(cloud.colors[lone][worst] - clean).mean()
    assert np.abs(even.colors[stays][worst] - clean).mean() < before / 3


@pytest.mark.parametrize("owner", [-1, 0])
def test_a_cloud_of_unknown_or_of_one_station_stays_as_it_is(owner: int) -> None:
    places, _ = wall(5000)
    cloud = cloud_of(places, painted(places), np.full(5000, owner, np.int16))
    stations = STATIONS[: owner + 1]
    assert np.array_equal(exposure(cloud, stations, Settings()).colors, cloud.colors)


def test_stations_without_common_places_keep_their_gains() -> None:
    places, _ = wall(5000)
    station = (places[:, 0] > 1).astype(np.int16)
    gap = np.abs(places[:, 0] - 1) > 0.1
    cloud = cloud_of(places[gap], painted(places[gap]), station[gap])
    assert np.array_equal(exposure(cloud, STATIONS[:2], Settings()).colors, cloud.colors)


def test_an_empty_cloud_is_no_fault() -> None:
    none = PointCloud(
        np.zeros(3), np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint8), np.zeros(0, np.int16)
    )
    assert len(exposure(none, np.zeros((0, 3)), Settings())) == 0
