from __future__ import annotations

import numpy as np
import pytest
from surfaces import mesh, sheet

from tourgen.errors import StageError
from tourgen.geometry import TexturedMesh, UvMesh, View
from tourgen.stages.poster import Scene, Settings, poster

SMALL = Settings(width=64, height=48, field_of_view_deg=60.0, void=(14, 16, 20))
QUARTERS = [(250, 0, 0), (0, 250, 0), (0, 0, 250), (250, 250, 0)]


def wall(turned: bool = False) -> TexturedMesh:
    """2 m square in z = 0 looking up; seen from above, y up, its quarters read as a page does."""
    plane = sheet(2.0, 2.0, 1)
    vertices = plane.vertices - np.float32([1, 1, 0])
    uv = np.stack([(vertices[:, 0] + 1) / 2, (1 - vertices[:, 1]) / 2], 1).astype(np.float32)
    picture = np.zeros((40, 40, 3), np.uint8)
    for color, (row, column) in zip(QUARTERS, [(0, 0), (0, 20), (20, 0), (20, 20)], strict=True):
        picture[row : row + 20, column : column + 20] = color
    faces = plane.faces[:, ::-1] if turned else plane.faces
    placed = mesh(vertices, faces)
    return TexturedMesh(UvMesh(placed, uv, np.zeros(2, np.int32), (40, 40), 0.05), picture)


def view(position: tuple[float, float, float], look_at: tuple[float, float, float]) -> View:
    return View(np.array(position), np.array(look_at))


def test_the_picture_is_upright_and_not_mirrored() -> None:
    picture = poster(Scene([wall()]), view((0, -0.05, 1.2), (0, 0, 0)), SMALL)
    assert picture.shape == (48, 64, 3)
    assert picture.dtype == np.uint8
    corners = [picture[18, 26], picture[18, 38], picture[30, 26], picture[30, 38]]
    assert np.abs(np.array(corners, float) - QUARTERS).max() <= 2


def test_the_field_of_view_is_the_one_asked_for() -> None:
    far = 1 / np.tan(np.radians(30)) * 1.25  # the square covers 80 % of the height
    picture = poster(Scene([wall()]), view((0, 0, far), (0, 0, 0)), SMALL)
    red_or_green = picture[:, 32].max(1) > 200
    assert red_or_green.sum() == pytest.approx(0.8 * 48, abs=1)


def test_where_nothing_is_the_void_shows() -> None:
    picture = poster(Scene([wall()]), view((0, 0, 5), (0, 9, 5)), SMALL).astype(int)
    assert np.abs(picture[0] - SMALL.void).max() <= 1


def test_faces_are_seen_from_behind_too() -> None:
    near = wall(turned=True)
    raised = mesh(near.uv_mesh.mesh.vertices + np.float32([0, 0, 0.5]), near.uv_mesh.mesh.faces)
    shade = TexturedMesh(
        UvMesh(raised, near.uv_mesh.uv, near.uv_mesh.chart, (40, 40), 0.05),
        np.zeros((40, 40, 3), np.uint8),
    )
    eye = view((0, -0.05, 1.2), (0, 0, 0))
    assert (poster(Scene([shade, wall()]), eye, SMALL) == 0).all()


def test_the_nearer_tile_hides_the_farther() -> None:
    near = wall()
    raised = mesh(near.uv_mesh.mesh.vertices + np.float32([0, 0, 0.2]), near.uv_mesh.mesh.faces)
    grey = TexturedMesh(
        UvMesh(raised, near.uv_mesh.uv, near.uv_mesh.chart, (40, 40), 0.05),
        np.full((40, 40, 3), 77, np.uint8),
    )
    picture = poster(Scene([wall(), grey]), view((0, -0.05, 1.0), (0, 0, 0)), SMALL)
    assert (picture[20:28, 28:36] == 77).all()


def test_no_tile_is_an_error() -> None:
    with pytest.raises(StageError, match="at least 1 tile, found 0"):
        poster(Scene([]), view((0, 0, 0), (1, 0, 0)), SMALL)
