"""Winding: an open surface closes as if what is missing were there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from tourgen.geometry import Mesh
from tourgen.stages.surface.winding import Winding
from tourgen.threads import use_threads

CELL_M = 0.05


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.zeros(3), np.float32(shape.vertices), np.int32(shape.faces))


def seen_from_within(mesh: Mesh) -> Mesh:
    return replace(mesh, faces=mesh.faces[:, ::-1].copy())


def without(mesh: Mesh, gone: NDArray[np.bool_]) -> Mesh:
    return replace(mesh, faces=mesh.faces[~gone])


def box(size: float = 2.0) -> Mesh:
    return mesh_of(trimesh.creation.box((size, size, size)).subdivide_to_size(0.1))


def middles(mesh: Mesh) -> NDArray[np.float32]:
    return np.asarray(mesh.vertices[mesh.faces].mean(axis=1))


def exact(mesh: Mesh, place: NDArray[np.float64]) -> float:
    """The winding number, face by face."""
    a, b, c = (mesh.vertices[corner].astype(np.float64) - place for corner in mesh.faces.T)
    x, y, z = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    above = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = x * y * z + (a * b).sum(1) * z + (b * c).sum(1) * x + (c * a).sum(1) * y
    return float(-np.arctan2(above, below).sum() / (2 * np.pi))


def test_it_is_the_sum_over_all_faces() -> None:
    mesh = seen_from_within(box())
    mesh = without(mesh, middles(mesh)[:, 2] > 0.5)
    places = np.random.default_rng(3).uniform(-1.3, 1.3, (200, 3))
    told, _, _ = Winding(mesh, CELL_M)._told(places.astype(np.float32))
    assert told == pytest.approx([exact(mesh, place) for place in places], abs=0.02)


@pytest.mark.parametrize("inside", [True, False])
def test_places_lie_in_front_on_the_side_that_is_seen(inside: bool) -> None:
    mesh = seen_from_within(box()) if inside else box()
    places = np.random.default_rng(1).uniform(-1.5, 1.5, (500, 3)).astype(np.float32)
    places = places[np.abs(np.abs(places).max(axis=1) - 1) > 0.02]
    within = np.abs(places).max(axis=1) < 1
    assert ((Winding(mesh, CELL_M).distance(places) > 0) == (within == inside)).all()


@pytest.mark.parametrize("hole_m", [0.3, 0.8])
def test_a_hole_in_a_wall_closes_in_the_wall(hole_m: float) -> None:
    mesh = seen_from_within(box())
    at = middles(mesh)
    gone = (at[:, 0] > 0.99) & (np.abs(at[:, 1:]) < hole_m / 2).all(axis=1)
    assert gone.sum() > 8
    winding = Winding(without(mesh, gone), CELL_M)
    along = np.linspace(-0.4, 0.4, 9) * hole_m
    y, z = (each.ravel() for each in np.meshgrid(along, along))
    for off_m in (-0.02, 0.02):
        places = np.stack([np.full_like(y, 1 - off_m), y, z], axis=1).astype(np.float32)
        assert winding.distance(places) == pytest.approx(off_m, abs=0.1 * hole_m)


def test_what_closes_a_gap_leaves_its_rim_without_a_kink() -> None:
    """A board that is seen from above alone, in a room: its middle value is not the room's."""
    room = seen_from_within(box())
    board = mesh_of(trimesh.creation.box((1.0, 1.0, 0.002)).subdivide_to_size(0.05))
    board = without(board, middles(board)[:, 2] < 0.0005)
    vertices = np.concatenate([room.vertices, board.vertices])
    both = Mesh(
        np.zeros(3), vertices, np.concatenate([room.faces, board.faces + len(room.vertices)])
    )
    hole = (np.abs(middles(both)) < (0.15, 0.15, 0.01)).all(axis=1)
    winding = Winding(without(both, hole), CELL_M)
    places = np.float32([[x, 0, z] for x in (-0.1, 0, 0.1) for z in (-0.06, 0.06)])
    assert (np.sign(winding.distance(places)) == np.sign(places[:, 2])).all()


def test_the_same_from_one_thread_and_from_two() -> None:
    mesh = without(box(), middles(box())[:, 0] > 0.7)
    places = np.random.default_rng(2).uniform(-1.5, 1.5, (9000, 3)).astype(np.float32)
    found = []
    for count in (1, 2):
        with use_threads(count):
            found.append(Winding(mesh, CELL_M).distance(places))
    assert (found[0] == found[1]).all()


def test_one_face_is_a_surface() -> None:
    face = Mesh(np.zeros(3), np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.int32([[0, 1, 2]]))
    places = np.float32([[0.3, 0.3, 0.01], [0.3, 0.3, -0.01]])
    before, behind = Winding(face, 0.1).distance(places)
    assert before > 0 > behind
