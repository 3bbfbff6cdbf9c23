"""One stands before what one looks at: on the floor, with room around, in sight of it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from tourgen.geometry import Float64, Mesh, View
from tourgen.stages.viewpoints import Settings, viewpoints

ENTRY = View(np.array([0.0, -3.0, 1.6]), np.array([0.0, 0.0, 1.5]))


def room(*solids: trimesh.Trimesh) -> Mesh:
    """4 x 8 x 3 m, floor at 0, with solids in it."""
    shell = trimesh.creation.box((4, 8, 3))
    shell.apply_translation((0, 0, 1.5))
    shell.invert()
    joined = trimesh.util.concatenate([shell, *solids])
    return Mesh(np.zeros(3), joined.vertices.astype(np.float32), joined.faces.astype(np.int32))


def stand(mesh: Mesh, *thing: float) -> Float64:
    (view,) = viewpoints(mesh, np.array([thing]), ENTRY, Settings())
    assert view.look_at == pytest.approx(np.array(thing))
    return view.position


def test_one_stands_square_before_a_plaque() -> None:
    eye = stand(room(), 1.97, 2.0, 1.6)
    assert eye == pytest.approx([1.97 - 1.3, 2.0, 1.6], abs=0.3)
    assert eye[2] == pytest.approx(1.6, abs=1e-3)


def test_a_table_is_looked_at_from_beside_it() -> None:
    table = trimesh.creation.box((1.2, 1.2, 0.8))
    table.apply_translation((0, 1, 0.4))
    eye = stand(room(table), 0.0, 1.0, 0.95)
    assert max(abs(eye[0]), abs(eye[1] - 1)) > 0.6 + Settings().clearance_m
    assert eye[2] == pytest.approx(1.6, abs=1e-3)


def test_what_stands_between_is_walked_round() -> None:
    screen = trimesh.creation.box((2.4, 0.1, 3))
    screen.apply_translation((0, 3.0, 1.5))
    eye = stand(room(screen), 0.0, 3.9, 1.4)
    assert eye[1] > 3.0


def test_where_nobody_can_stand_one_looks_from_the_entry() -> None:
    assert stand(room(), 0.0, 0.0, 0.1) == pytest.approx(ENTRY.position)
