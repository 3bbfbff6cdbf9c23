"""Blocks: a room drawn block by block is the room drawn at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sampled import faces_per_edge, sphere
from test_auto import SETTINGS, without

from tourgen.geometry import Float32, Mesh
from tourgen.sorting import distinct
from tourgen.stages.surface import auto
from tourgen.stages.surface.blocks import drawn_by_blocks
from tourgen.stages.surface.growing import grown
from tourgen.stages.surface.marching_cubes import Keys, corner_of, key_of, marching_cubes

CELL_M = 0.05
LOW = np.full(3, -10, np.float32)


def distance(key: Keys) -> Float32:
    """Of a torus."""
    x, y, z = (corner_of(key) * np.float32(CELL_M) + LOW).T
    return np.asarray(0.4 - np.hypot(np.hypot(x, y) - 1, z), np.float32)


def draw(key: Keys, value: Float32) -> Mesh:
    return marching_cubes(key, value, LOW, CELL_M, np.zeros(3))


def seed() -> Keys:
    row = np.arange(1.01, 1.6, CELL_M)
    places = np.stack([row, np.zeros_like(row), np.zeros_like(row)], axis=1)
    return distinct(key_of(((places - LOW) / CELL_M).astype(np.int64)))


def triangles(mesh: Mesh) -> set[bytes]:
    corners = mesh.vertices[mesh.faces]
    first = np.lexsort(corners.transpose(2, 0, 1).reshape(3, -1)).argsort()
    turn = first.reshape(-1, 3).argmin(axis=1)
    around = (turn[:, None] + np.arange(3)) % 3
    return {each.tobytes() for each in np.take_along_axis(corners, around[..., None], axis=1)}


@pytest.mark.parametrize("edge_bits", [2, 4, 9])
def test_the_same_faces_come_out_of_blocks_of_any_size(edge_bits: int) -> None:
    nothing = np.empty(0, np.int64), np.empty(0, np.float32)
    found = grown(distance, seed(), *nothing, 1.0)
    whole = draw(found.key, found.value)
    parts = drawn_by_blocks(distance, draw, seed(), 1.0, 1.0, edge_bits)
    assert len(parts.vertices) == len(whole.vertices)
    assert triangles(parts) == triangles(whole)


def test_simplified_blocks_are_welded_without_a_seam() -> None:
    parts = drawn_by_blocks(distance, draw, seed(), 1.0, 0.5, 4)
    assert (faces_per_edge(parts) == 2).all()
    off = distance_of(parts)
    assert np.abs(off).max() < 0.2 * CELL_M


def distance_of(mesh: Mesh) -> Float32:
    x, y, z = mesh.vertices.T
    return np.asarray(0.4 - np.hypot(np.hypot(x, y) - 1, z))


def test_a_room_of_too_many_cells_is_closed_as_others_are() -> None:
    whole = sphere(30_000)
    gap = whole.cloud.points[:, 2] > np.cos(0.25)
    given = without(whole, gap)
    at_once = auto.auto(given, SETTINGS)
    by_blocks = auto.auto(given, replace(SETTINGS, most_cells=10_000))
    assert (faces_per_edge(by_blocks.mesh) == 2).all()
    assert len(by_blocks.mesh.faces) < 0.4 * len(at_once.mesh.faces)
    away = np.abs(np.linalg.norm(by_blocks.mesh.vertices, axis=1) - 1)
    capped = by_blocks.mesh.vertices[:, 2] > np.cos(0.25)
    assert away[~capped].max() < 0.004
    assert away[capped].max() < 0.07
    assert by_blocks.dense_share == pytest.approx(at_once.dense_share, abs=0.01)
