"""Texels are as fine as what colours them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from surfaces import sheet

from tourgen.fitting.picture import PARTS, Part, Texels, sized
from tourgen.fitting.points import RoomScan
from tourgen.geometry import Panorama, PointCloud, Tile
from tourgen.scans import ReadFacts

SPACING_M = 0.02


def scan() -> RoomScan:
    """A grid of points on a sheet, and a picture from 1.5 m above its middle."""
    side = (np.arange(50) + 0.5) * SPACING_M
    grid = np.stack(np.meshgrid(side, side), -1).reshape(-1, 2)
    points = np.column_stack([grid, np.zeros(len(grid))]).astype(np.float32)
    cloud = PointCloud(
        np.zeros(3), points, np.zeros((len(points), 3), np.uint8), np.zeros(len(points), np.int16)
    )
    picture = Panorama(
        np.array([0.5, 0.5, 1.5]),
        np.eye(3),
        np.zeros((1024, 2048, 3), np.uint8),
        (np.pi / 1024, np.pi / 1024),
    )
    return RoomScan(cloud, np.array([[0.5, 0.5, 1.5]]), (picture,), ReadFacts(2500, 0, 0, ()))


def test_a_picture_nearer_than_the_points_makes_texels_finer() -> None:
    given = scan()
    room = (Tile("r", sheet(1.0, 1.0, 8), 0.0, ()),)
    bare = sized(room, given.cloud, replace(given, panoramas=()), Texels(1.0))
    fine = sized(room, given.cloud, given, Texels(1.0))
    pixel_m = 1.6 * np.pi / 1024  # 1.6 m: the mean way to the sheet
    together_m = 1 / np.sqrt(1 / SPACING_M**2 + 1 / pixel_m**2)
    assert bare["r"] == pytest.approx(SPACING_M / 2, rel=0.15)
    assert fine["r"] == pytest.approx(together_m / 2, rel=0.15)


def test_no_texel_is_finer_than_asked_for() -> None:
    given = scan()
    room = (Tile("r", sheet(1.0, 1.0, 8), 0.0, ()),)
    fine = sized(room, given.cloud, given, Texels(4.0))
    assert fine["r"] == pytest.approx(0.004)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 30])
def test_parts_take_every_tile_once(count: int) -> None:
    taken = [tile for part in PARTS for tile in part.take(range(count))]
    assert taken == list(range(count))
    assert str(Part(2, 8)) == " part 3/8"
