"""The picture of a floor goes on under a tripod: tiles stay tiles, and stars get their points."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import oriented, sheet

from tourgen.geometry import OrientedCloud, PointCloud
from tourgen.stages.bake import Settings, continued_floors
from tourgen.stages.bake.exemplars import continued
from tourgen.stages.floor import LAID

SIDE = 200
DARK, LIGHT = 60, 210


def chequered(places: np.ndarray, tile: float) -> np.ndarray:
    dark = (places // tile).sum(-1) % 2 == 0
    return np.where(dark[..., None], DARK, LIGHT).repeat(3, axis=-1)


def pixels() -> np.ndarray:
    return np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE)), axis=-1)


def disc(middle: tuple[int, int], radius: int) -> np.ndarray:
    return np.hypot(*(pixels() - middle).transpose(2, 0, 1)) < radius


def filled(picture: np.ndarray, hole: np.ndarray) -> np.ndarray:
    whole, done = continued(np.where(hole[..., None], 0, picture).astype(np.float32), ~hole, hole)
    assert np.array_equal(done, hole)
    assert np.array_equal(whole[~hole], picture[~hole].astype(np.float32))
    return whole


def test_tiles_stay_tiles() -> None:
    picture = chequered(pixels(), 9)
    hole = disc((110, 90), 40)
    off = np.abs(filled(picture, hole) - picture)[hole].max(1)
    assert (off > 60).mean() < 0.02
    smear = np.abs(picture[~hole].mean(0) - picture)[hole].max(1)
    assert (smear > 60).mean() > 0.9


def test_the_fourth_arm_of_a_cross_is_drawn_after_the_other_three() -> None:
    away = pixels() - (SIDE - 1) / 2
    along, across = np.abs(away).max(-1), np.abs(away).min(-1)
    picture = np.where((along < 80) & (across < 18 * (1 - along / 80)), DARK, LIGHT)
    picture = picture[..., None].repeat(3, axis=-1)
    hole = disc((160, 100), 28)  # holds the tip, of which nothing is left
    off = np.abs(filled(picture, hole) - picture)[hole].max(1)
    assert (picture[hole] == DARK).mean() > 0.1
    assert (off > 60).mean() < 0.06


@pytest.mark.parametrize("side", [20, 75, 161])
def test_a_hole_may_reach_the_edge_of_the_picture(side: int) -> None:
    picture = chequered(np.stack(np.meshgrid(*[np.arange(side)] * 2), axis=-1), 5)
    hole = np.zeros((side, side), bool)
    hole[-side // 5 :, -side // 3 :] = hole[: side // 6, side // 3 : side // 2] = True
    whole = filled(picture, hole)
    assert (np.abs(whole - picture)[hole].max(1) > 60).mean() < 0.4


def test_what_touches_nothing_known_stays() -> None:
    known = pixels()[..., 0] < 60
    hole = disc((30, 100), 12) & known | disc((150, 100), 12)
    whole, done = continued(
        np.full((SIDE, SIDE, 3), 90, np.float32) * known[..., None], known & ~hole, hole
    )
    assert np.array_equal(done, hole & known)
    assert np.allclose(whole[done], 90, atol=0.5)
    nothing = np.zeros_like(known)
    assert not continued(np.zeros((SIDE, SIDE, 3), np.float32), nothing, hole)[1].any()


def scanned_floor(middle: np.ndarray, reach_m: float) -> OrientedCloud:
    """A floor of tiles of 0.1 m, and grey points laid where a disc of it is blind."""
    rng = np.random.default_rng(0)
    at = np.column_stack([rng.random((60_000, 2)) * 2, np.zeros(60_000)])
    at[:, 2] = 0.002 * at[:, 0] - 0.4 + rng.normal(0, 0.001, len(at))
    blind = np.linalg.norm(at[:, :2] - middle, axis=1) < reach_m
    up = np.tile((0.0, 0.0, 1.0), (len(at), 1))
    colors = np.where(blind[:, None], 128, chequered(at[:, :2], 0.1))
    cloud = oriented(at, up, colors)
    station = np.where(blind, LAID, 0).astype(np.int16)
    points = PointCloud(cloud.cloud.origin, cloud.cloud.points, cloud.cloud.colors, station)
    return OrientedCloud(points, cloud.normals, cloud.stations)


def test_a_blind_disc_gets_points_that_go_on_with_the_floor() -> None:
    middle, reach_m = np.array([1.1, 0.9]), 0.4
    floor = scanned_floor(middle, reach_m)
    seen = floor.cloud.take(floor.cloud.station != LAID)
    room = sheet(2.0, 2.0, 4)
    room.vertices[:, 2] = 0.002 * room.vertices[:, 0] - 0.4
    new = continued_floors(seen, floor, room, Settings())
    assert (new.station == LAID).all()
    away = np.linalg.norm(new.points[:, :2] - middle, axis=1)
    assert away.max() < reach_m
    assert np.abs(new.points[:, 2] - (0.002 * new.points[:, 0] - 0.4)).max() < 0.002
    cells = np.unique(np.floor(new.points[:, :2] / 0.05), axis=0)
    assert len(cells) > 0.85 * np.pi * (reach_m - 0.03) ** 2 / 0.05**2
    off = np.abs(new.colors - chequered(new.points[:, :2].astype(float), 0.1)).max(1)
    assert (off > 60).mean() < 0.15  # within a point's spacing of a tile's edge either is right


def test_where_no_floor_was_laid_there_is_nothing_to_go_on_with() -> None:
    floor = scanned_floor(np.array([1.0, 1.0]), 0.0)
    assert len(continued_floors(floor.cloud, floor, sheet(2.0, 2.0, 4), Settings())) == 0
