from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surfaces import oriented, ramp, sheet

from tourgen.errors import StageError
from tourgen.geometry import OrientedCloud, TexturedMesh, UvMesh
from tourgen.raster import rasterize
from tourgen.stages import unwrap
from tourgen.stages.bake import Settings, bake, color_index
from tourgen.stages.bake.points import of_points
from tourgen.stages.bake.texels import texels_of

TEXEL_M = 0.01
UP = (0.0, 0.0, 1.0)


def scanned(points: np.ndarray, colors: np.ndarray) -> OrientedCloud:
    return oriented(points, np.tile(UP, (len(points), 1)), colors)


def spread(count: int, seed: int = 0, noise_m: float = 0.0) -> np.ndarray:
    """Points over the unit square of z = 0."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.random((count, 2)), np.zeros(count)])
    points[:, 2] += rng.normal(0, noise_m, count) if noise_m else 0
    return points


def baked(cloud: OrientedCloud, texel_m: float = TEXEL_M) -> TexturedMesh:
    tile = unwrap.unwrap(sheet(1.0, 1.0, 8), unwrap.Settings(texel_m))
    return bake(tile, color_index(cloud.cloud, cloud, texel_m), Settings())


def seen(textured: TexturedMesh) -> tuple[np.ndarray, np.ndarray]:
    """Places of the texels within faces, and their colours."""
    tile: UvMesh = textured.uv_mesh
    width, height = tile.texture_size
    corner = tile.uv.astype(np.float64)[tile.mesh.faces] * (width, height)
    hits = rasterize(corner, width, height)
    at = tile.mesh.vertices[tile.mesh.faces[hits.face]]
    places = np.einsum("tc,tcx->tx", hits.barycentric, at)
    return places, textured.texture[hits.row, hits.column].astype(float)


@pytest.mark.parametrize("noise_m", [0.0, 0.003])
def test_a_ramp_of_colour_comes_out_as_it_is(noise_m: float) -> None:
    points = spread(40_000, noise_m=noise_m)
    places, colors = seen(baked(scanned(points, ramp(points, 1.0))))
    off = np.abs(colors - ramp(places.astype(np.float32), 1.0))
    assert np.percentile(off, 99) <= 3
    assert off.max() <= 8


@settings(deadline=None, max_examples=10)
@given(color=st.tuples(*[st.integers(0, 255)] * 3), count=st.integers(1, 400))
def test_one_colour_fills_every_texel_and_the_background(
    color: tuple[int, int, int], count: int
) -> None:
    points = spread(count)
    texture = baked(scanned(points, np.tile(color, (count, 1)))).texture
    assert (texture == color).all()


def test_an_edge_aslant_to_the_grid_of_points_has_no_teeth() -> None:
    grid = np.stack(np.meshgrid(*[np.arange(100) / 100 + 0.005] * 2), -1).reshape(-1, 2)
    points = np.column_stack([grid, np.zeros(len(grid))])
    across = np.array([np.sin(np.radians(25)), np.cos(np.radians(25)), 0])

    def beyond_m(places: np.ndarray) -> np.ndarray:
        return places @ across - 0.6

    light = beyond_m(points) > 0
    cloud = scanned(points, np.where(light[:, None], 210, 40).repeat(3, axis=1))
    places, colors = seen(baked(cloud, texel_m=0.002))
    inner = (np.abs(places[:, :2] - 0.5) < 0.45).all(1)
    shade, off_m = colors[inner, 0], beyond_m(places[inner])
    wrong = (shade > 125) != (off_m > 0)
    assert np.abs(off_m[wrong]).max() < 0.004
    assert wrong[np.abs(off_m) < 0.004].mean() < 0.165  # 0.183 of a round bell


def test_stripes_as_wide_as_three_points_stay_apart() -> None:
    grid = np.stack(np.meshgrid(*[np.arange(200) / 200 + 0.0025] * 2), -1).reshape(-1, 2)
    points = np.column_stack([grid, np.zeros(len(grid))])
    stripe_m = 0.015
    light = (points[:, 0] // stripe_m) % 2 == 0
    cloud = scanned(points, np.where(light[:, None], 220, 30).repeat(3, axis=1))
    places, colors = seen(baked(cloud, texel_m=0.005))
    middle = np.abs((places[:, 0] / stripe_m) % 1 - 0.5) < 0.15
    bright = (places[:, 0] // stripe_m) % 2 == 0
    assert colors[middle & bright].mean() > 205
    assert colors[middle & ~bright].mean() < 45


def test_coarse_texels_average_what_they_cover() -> None:
    points = spread(60_000)
    checker = ((points[:, 0] // 0.01) + (points[:, 1] // 0.01)) % 2
    colors = np.where(checker[:, None] == 0, 200, 40).repeat(3, axis=1)
    _, coarse = seen(baked(scanned(points, colors), texel_m=0.06))
    assert np.abs(coarse - 120).max() < 40
    assert coarse.std() < 14


def test_the_other_side_of_a_board_lends_no_colour() -> None:
    front, back = spread(20_000, 1), spread(20_000, 2)
    back[:, 2] -= 0.012
    both = oriented(
        np.concatenate([front, back]),
        np.concatenate([np.tile(UP, (len(front), 1)), -np.tile(UP, (len(back), 1))]),
        np.concatenate([np.tile((200, 0, 0), (20_000, 1)), np.tile((0, 0, 200), (20_000, 1))]),
    )
    _, colors = seen(baked(both))
    assert colors[:, 2].max() == 0
    assert colors[:, 0].min() == 200


def test_no_colour_bleeds_through_a_board_thinner_than_the_points_lie_apart() -> None:
    """Each side is seen by its own station; normals are known at one point in five."""
    at, color = spread(40_000, 3), np.zeros((40_000, 3))
    back = np.arange(40_000) % 2 == 1
    at[back, 2] -= 0.002
    color[back], color[~back] = (0, 0, 200), (200, 0, 0)
    normals = np.where(back[:, None], -np.array(UP), UP)
    both = oriented(at, normals, color)
    station = back.astype(np.int16)
    whole = replace(both.cloud, station=station)
    some = np.random.default_rng(0).random(40_000) < 0.2
    known = OrientedCloud(whole.take(some), both.normals[some], both.stations)
    tile = unwrap.unwrap(sheet(1.0, 1.0, 8), unwrap.Settings(TEXEL_M))
    _, colors = seen(bake(tile, color_index(whole, known, TEXEL_M), Settings()))
    assert colors[:, 2].mean() < 1
    assert (colors[:, 2] > 20).mean() < 0.01


def test_a_hole_takes_the_colours_about_it() -> None:
    points = spread(40_000)
    hole = np.linalg.norm(points[:, :2] - 0.5, axis=1) < 0.25
    left = points[~hole]
    places, colors = seen(baked(scanned(left, ramp(left, 1.0))))
    inside = np.linalg.norm(places[:, :2] - 0.5, axis=1) < 0.2
    assert np.abs(colors[inside] - ramp(places[inside].astype(np.float32), 1.0)).max() < 75
    assert np.abs(colors[inside, 2] - 100).max() <= 1


def test_no_mip_level_shows_a_background() -> None:
    points = spread(20_000)
    texture = baked(scanned(points, np.tile((200, 150, 100), (20_000, 1)))).texture.astype(float)
    while min(texture.shape[:2]) > 1:
        height, width = (side // 2 * 2 for side in texture.shape[:2])
        quarters = texture[:height, :width].reshape(height // 2, 2, width // 2, 2, 3)
        texture = quarters.mean((1, 3))
        assert np.abs(texture - (200, 150, 100)).max() < 1


def test_two_tiles_agree_along_their_seam() -> None:
    points = spread(30_000, noise_m=0.001)
    rng = np.random.default_rng(5)
    cloud = scanned(points, np.clip(ramp(points, 1.0) + rng.normal(0, 6, (30_000, 3)), 0, 255))
    index = color_index(cloud.cloud, cloud, TEXEL_M)
    whole = sheet(1.0, 1.0, 8)
    middle = whole.vertices[whole.faces].mean(1)[:, 0]
    strips = []
    for side in (middle < 0.5, middle >= 0.5):
        half = type(whole)(whole.origin, whole.vertices, whole.faces[side])
        textured = bake(unwrap.unwrap(half, unwrap.Settings(TEXEL_M)), index, Settings())
        places, colors = seen(textured)
        near = np.abs(places[:, 0] - 0.5) < TEXEL_M
        row = np.clip((places[near, 1] * 20).astype(int), 0, 19)
        strips.append([colors[near][row == each].mean(0) for each in range(20)])
    assert np.abs(np.subtract(*strips)).max() < 6


def test_an_empty_cloud_is_an_error() -> None:
    cloud = scanned(np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(StageError, match="at least 1 point, found 0"):
        color_index(cloud.cloud, cloud, TEXEL_M)


def test_texels_between_faces_that_look_opposite_ways_get_a_colour_too() -> None:
    """Their normals cancel; a texel that is no number would black out all those about it."""
    points = spread(20_000)
    cloud = scanned(points, np.tile((200, 150, 120), (20_000, 1)))
    texels = texels_of(unwrap.unwrap(sheet(1.0, 1.0, 8), unwrap.Settings(TEXEL_M)))
    normals = texels.normals.copy()
    normals[::7] = 0
    texels = replace(texels, normals=normals)
    index = color_index(cloud.cloud, cloud, TEXEL_M)
    told = of_points(texels, index, TEXEL_M, Settings(), np.zeros(len(texels.row), np.float32))
    assert np.isfinite(told.colors).all()
    assert told.colors.min() > 100
