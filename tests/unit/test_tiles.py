"""Tiles of any levels meet exactly."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from tourgen.geometry import Mesh, Tile
from tourgen.stages.levels import Levels
from tourgen.stages.levels import Settings as LevelSettings
from tourgen.stages.levels import levels as make_levels
from tourgen.stages.tiles import Settings, tiles


def bumpy_sphere(subdivisions: int = 5) -> Mesh:
    """Closed, 20,480 faces at five subdivisions, with relief so that simplifying has work."""
    ball = trimesh.creation.icosphere(subdivisions, radius=2.0)
    relief = 1 + 0.01 * np.sin(9 * ball.vertices).sum(axis=1, keepdims=True)
    vertices = (ball.vertices * relief).astype(np.float32)
    return Mesh(np.zeros(3), vertices, ball.faces.astype(np.int32))


@pytest.fixture(scope="module")
def room() -> tuple[Tile, ...]:
    ends = make_levels(bumpy_sphere(), LevelSettings(0.01, face_detail_ratio=1.0, root_faces=800))
    return tiles(ends, Settings(leaf_faces=500, children=4))


def border(mesh: Mesh) -> set[tuple[bytes, bytes]]:
    """Edges of one face, by the places of their ends."""
    edge = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    once, uses = np.unique(edge, axis=0, return_counts=True)
    at = [v.tobytes() for v in mesh.vertices]
    return {tuple(sorted((at[a], at[b]))) for a, b in once[uses == 1]}


def test_the_tree_is_whole(room: tuple[Tile, ...]) -> None:
    by_id = {tile.id: tile for tile in room}
    assert room[0].id == "r"
    assert len(by_id) == len(room)
    named = [child for tile in room for child in tile.children]
    assert sorted(named) == sorted(by_id.keys() - {"r"})
    assert max(len(tile.id) for tile in room) == 4, "two levels of branches were wanted here"


def test_errors_fall_to_zero_at_the_leaves(room: tuple[Tile, ...]) -> None:
    by_id = {tile.id: tile for tile in room}
    for tile in room:
        assert (tile.geometric_error_m == 0) == (not tile.children)
        assert all(by_id[c].geometric_error_m < tile.geometric_error_m for c in tile.children)


def test_the_leaves_are_the_finest_mesh(room: tuple[Tile, ...]) -> None:
    leaves = [tile.mesh for tile in room if not tile.children]
    area = sum(trimesh.Trimesh(m.vertices, m.faces, process=False).area for m in leaves)
    assert sum(len(m.faces) for m in leaves) == 20_480
    ball = bumpy_sphere()
    assert np.isclose(area, trimesh.Trimesh(ball.vertices, ball.faces, process=False).area)


def test_branches_are_coarser_and_near(room: tuple[Tile, ...]) -> None:
    by_id = {tile.id: tile for tile in room}
    for tile in room[1:]:
        if tile.children:
            below = sum(len(by_id[child].mesh.faces) for child in tile.children)
            assert len(tile.mesh.faces) < 0.6 * below
            assert tile.geometric_error_m < 0.15, "of a ball of 2 m"


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_mix_of_levels_is_closed(room: tuple[Tile, ...], seed: int) -> None:
    """Whatever is refined: every border edge of a shown tile is one of another shown tile."""
    by_id, rng = {tile.id: tile for tile in room}, np.random.default_rng(seed)
    shown, waiting = [], list(room[0].children)
    while waiting:
        tile = by_id[waiting.pop()]
        if tile.children and rng.random() < 0.6:
            waiting += tile.children
        else:
            shown.append(tile)
    count: dict[tuple[bytes, bytes], int] = {}
    for tile in shown:
        for edge in border(tile.mesh):
            count[edge] = count.get(edge, 0) + 1
    assert set(count.values()) == {2}


def test_a_small_room_is_one_tile() -> None:
    mesh = bumpy_sphere(2)
    (only,) = tiles(Levels(mesh, mesh), Settings())
    assert only == Tile("r", mesh, 0.0, ())


@pytest.mark.parametrize(("texel_m", "count"), [(0.004, 4), (0.02, 1)])
def test_a_room_of_few_faces_has_leaves_where_they_show_finer_texels(
    texel_m: float, count: int
) -> None:
    """Its root, of every face, had no error, and so its leaves were never shown."""
    mesh = bumpy_sphere(4)  # 5,120 faces, 50 square metres
    found = tiles(Levels(mesh, mesh), Settings(leaf_faces=2000, texel_m=texel_m))
    assert len(found) == count
    assert found[0].geometric_error_m == pytest.approx(0.0 if count == 1 else 0.01, rel=0.1)
