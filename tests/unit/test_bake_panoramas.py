"""Panoramas colour what they see, agree with the points, and give way where they are wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from surfaces import oriented, ramp, sheet

from tourgen.geometry import Mesh, Panorama, TexturedMesh, UvMesh
from tourgen.raster import rasterize
from tourgen.stages import unwrap
from tourgen.stages.bake import Settings, VistaSettings, bake, color_index, vistas
from tourgen.stages.bake.pictures import agreement
from tourgen.stages.bake.vista import Vista, directions

TEXEL_M = 0.01
LENSES = ((0.3, 0.3, 0.8), (0.7, 0.35, 0.9), (0.5, 0.75, 0.85))
Paint = Callable[[np.ndarray], np.ndarray]


def painted(places: np.ndarray) -> np.ndarray:
    return ramp(places.astype(np.float32), 1.0).astype(float)


def striped(places: np.ndarray) -> np.ndarray:
    """Stripes of 20 mm over the ramp."""
    return painted(places) + np.where((places[:, :1] // 0.02) % 2 == 0, 30.0, -20.0)


def photo(lens: tuple[float, float, float], paint: Paint, gain: float = 1.0) -> Panorama:
    """What a lens sees of the sheet in z = 0 and of nothing else, cut off at -80 degrees."""
    blank = Panorama(
        np.array(lens),
        np.eye(3),
        np.zeros((512, 1024, 3), np.uint8),
        (2 * np.pi / 1024, np.pi / 512),
    )
    way = directions(blank, 1024, 512).astype(np.float64)
    down = (way[..., 2] < -0.05) & (way[..., 2] > -np.sin(np.radians(80)))
    foot = blank.position + way[down] * (lens[2] / -way[down][:, 2:])
    image = np.full((512, 1024, 3), 90, np.uint8)
    image[way[..., 2] <= -np.sin(np.radians(80))] = 0
    image[down] = np.clip(np.rint(paint(foot) * gain), 1, 255).astype(np.uint8)
    return replace(blank, image=image)


def points(paint: Paint, count: int = 3000) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    at = np.column_stack([rng.random((count, 2)), np.zeros(count)])
    return at, np.clip(np.rint(paint(at)), 0, 255)


def ready(panoramas: list[Panorama], paint: Paint = painted, mesh: Mesh | None = None):
    at, colors = points(paint)
    cloud = oriented(at, np.tile((0.0, 0.0, 1.0), (len(at), 1)), colors)
    index = color_index(cloud.cloud, cloud, TEXEL_M)
    room = mesh or sheet(1.0, 1.0, 8)
    return index, vistas(tuple(panoramas), room, index, VistaSettings())


def seen(textured: TexturedMesh) -> tuple[np.ndarray, np.ndarray]:
    tile: UvMesh = textured.uv_mesh
    corner = tile.uv.astype(np.float64)[tile.mesh.faces] * tile.texture_size
    hits = rasterize(corner, *tile.texture_size)
    places = np.einsum(
        "tc,tcx->tx", hits.barycentric, tile.mesh.vertices[tile.mesh.faces[hits.face]]
    )
    return places, textured.texture[hits.row, hits.column].astype(float)


def baked(index: object, shown: tuple[Vista, ...], texel_m: float = TEXEL_M):
    tile = unwrap.unwrap(sheet(1.0, 1.0, 8), unwrap.Settings(texel_m))
    return seen(bake(tile, index, Settings(), shown))


def test_stripes_too_fine_for_the_points_come_from_the_pictures() -> None:
    index, shown = ready([photo(lens, striped) for lens in LENSES], striped)
    assert len(shown) == 3
    off = {}
    for name, used in (("points", ()), ("pictures", shown)):
        places, colors = baked(index, used, 0.005)
        inner = np.abs(places[:, 0] % 0.02 - 0.01) < 0.006
        off[name] = np.sqrt(np.mean((colors[inner] - striped(places[inner])) ** 2))
    assert off["pictures"] < 0.5 * off["points"]


def test_pictures_come_to_the_exposure_of_the_points() -> None:
    panoramas = [
        photo(lens, painted, gain) for lens, gain in zip(LENSES, (1.08, 0.94, 1.0), strict=True)
    ]
    index, shown = ready(panoramas)
    assert [each.gain.mean() for each in shown] == pytest.approx([1.08, 0.94, 1.0], abs=0.01)
    places, colors = baked(index, shown)
    off = colors - painted(places)
    assert np.abs(off.mean(0)).max() < 1
    assert np.percentile(np.abs(off), 99) < 5


def test_what_stands_before_the_surface_does_not_colour_it() -> None:
    """A board hangs over the sheet; the picture shows it, the mesh has it."""
    board = sheet(0.3, 0.3, 2)
    lifted = board.vertices + np.float32((0.5, 0.5, 0.4))
    room = sheet(1.0, 1.0, 8)
    mesh = Mesh(
        room.origin,
        np.concatenate([room.vertices, lifted]),
        np.concatenate([room.faces, board.faces + len(room.vertices)]),
    )
    lens = LENSES[0]

    def hidden(places: np.ndarray) -> np.ndarray:
        """Magenta where the ray to the sheet meets the board first."""
        share = (lens[2] - 0.4) / lens[2]
        through = np.array(lens[:2]) + share * (places[:, :2] - lens[:2])
        colors = painted(places)
        colors[((through > 0.5) & (through < 0.8)).all(1)] = (255, 0, 255)
        return colors

    index, shown = ready([photo(lens, hidden)], mesh=mesh)
    assert len(shown) == 1
    places, colors = baked(index, shown)
    off = np.abs(colors - painted(places)).max(1)
    assert (off > 25).mean() < 0.002


def test_a_passer_by_in_one_picture_is_outvoted() -> None:
    def crossed(places: np.ndarray) -> np.ndarray:
        colors = painted(places)
        colors[np.linalg.norm(places[:, :2] - 0.5, axis=1) < 0.12] = (10, 200, 30)
        return colors

    index, shown = ready(
        [photo(LENSES[0], crossed), *(photo(lens, painted) for lens in LENSES[1:])]
    )
    assert len(shown) == 3
    places, colors = baked(index, shown)
    assert np.abs(colors - painted(places)).max() < 25


def test_where_there_is_no_picture_the_points_tell() -> None:
    index, shown = ready([photo((0.5, 0.5, 1.2), painted)])
    places, colors = baked(index, shown)
    below = np.linalg.norm(places[:, :2] - 0.5, axis=1) < 0.3  # the blind disc has 0.21 m
    assert np.abs(colors[below] - painted(places[below])).max() < 14


def test_white_specks_are_no_lamps_but_a_lamp_has_glare() -> None:
    plain = photo(LENSES[0], painted)
    specked, lit = plain.image.copy(), plain.image.copy()
    specked[300:500:20, ::16] = 255
    specked[301:501:20, ::16] = 255
    lit[400:408, 200:208] = 255
    dimmed = (lit * 0.95).astype(np.uint8)  # its white balance ends below 255
    pictures = [replace(plain, image=image) for image in (specked, lit, dimmed)]
    _, shown = ready([plain, *pictures])
    assert np.array_equal(shown[1].trust, shown[0].trust)
    for lamp in shown[2:]:
        assert lamp.trust[400:408, 200:208].max() < 0.05
    assert shown[2].trust[400, 600] == shown[0].trust[400, 600] == 1


def test_a_picture_of_something_else_is_left_out() -> None:
    turned = photo(LENSES[0], painted)
    turned = replace(turned, rotation=np.diag([-1.0, -1.0, 1.0]))
    _, shown = ready([turned, photo(LENSES[1], painted)])
    assert [each.panorama.position.tolist() for each in shown] == [list(LENSES[1])]


def test_points_without_colour_leave_it_to_the_pictures() -> None:
    index, shown = ready(
        [photo(lens, painted) for lens in LENSES], lambda at: np.full((len(at), 3), 160.0)
    )
    assert len(shown) == 3
    places, colors = baked(index, shown)
    inner = np.abs(places[:, :2] - 0.5).max(1) < 0.4
    assert np.median(np.abs(colors[inner] - painted(places[inner]))) < 4


def test_agreement_drops_the_one_that_differs() -> None:
    shown = np.array([[[100.0] * 3], [[104.0] * 3], [[240.0] * 3]], np.float32)
    trust = agreement(shown, np.ones((3, 1), np.float32), 20.0)[:, 0]
    assert trust[:2].min() > 0.99
    assert trust[2] < 0.01


def test_stripes_finer_than_any_one_picture_s_pixels_come_from_all_together() -> None:
    """Pixels of 9 to 15 mm, stripes of 14 mm: the pictures' pixels lie between one another's."""

    def fine(places: np.ndarray) -> np.ndarray:
        return painted(places) + np.where((places[:, :1] // 0.014) % 2 == 0, 30.0, -20.0)

    eyes = ((0.2, 0.3, 2.0), (0.8, 0.3, 2.1), (0.5, 0.8, 2.2), (0.4, 0.5, 2.3), (0.7, 0.6, 2.4))
    off = []
    for several in (eyes[:1], eyes):
        index, shown = ready([photo(lens, fine) for lens in several], fine)
        places, colors = baked(index, shown, 0.004)
        inner = (np.abs(places[:, :2] - 0.5) < 0.4).all(1)
        inner &= np.abs(places[:, 0] % 0.014 - 0.007) < 0.004
        off.append(np.sqrt(np.mean((colors[inner] - fine(places[inner])) ** 2)))
    assert off[1] < 0.75 * off[0]


def test_no_panoramas_make_no_vistas() -> None:
    assert ready([])[1] == ()
