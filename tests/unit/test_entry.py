"""The first view is one that a person can have."""

from __future__ import annotations

import numpy as np
import trimesh

from tourgen.geometry import Mesh
from tourgen.stages.entry import Settings, entry_view


def room(*solids: trimesh.Trimesh, open_floor: bool = False) -> Mesh:
    """4 x 8 x 3 m, floor at 0, with solids in it."""
    shell = trimesh.creation.box((4, 8, 3))
    shell.apply_translation((0, 0, 1.5))
    shell.invert()
    if open_floor:
        shell.update_faces(shell.triangles_center[:, 2] > 0.01)
    joined = trimesh.util.concatenate([shell, *solids])
    return Mesh(np.zeros(3), joined.vertices.astype(np.float32), joined.faces.astype(np.int32))


def test_it_looks_along_the_room_from_eye_height_at_the_better_station() -> None:
    stations = np.array([[0.0, 0.0, 1.5], [0.0, -3.0, 1.4]])
    view = entry_view(room(), stations, Settings())
    assert np.allclose(view.position, [0, -3, 1.6], atol=0.01)
    assert view.look_at[1] > view.position[1]


def test_nobody_enters_on_top_of_a_wardrobe() -> None:
    wardrobe = trimesh.creation.box((1.6, 1.6, 2.0))
    wardrobe.apply_translation((0, -3, 1.0))
    view = entry_view(room(wardrobe), np.empty((0, 3)), Settings())
    assert abs(view.position[2] - 1.6) < 0.01
    apart_m = max(abs(view.position[0]) - 0.8, abs(view.position[1] + 3) - 0.8)
    assert apart_m > Settings().clearance_m - 0.01


def test_a_station_over_a_hole_is_passed_over() -> None:
    floor = trimesh.creation.box((4, 4, 0.02))
    floor.apply_translation((0, 2, -0.01))
    stations = np.array([[0.0, -2.0, 1.5], [0.0, 2.0, 1.5]])
    view = entry_view(room(floor, open_floor=True), stations, Settings())
    assert np.allclose(view.position, [0, 2, 1.6], atol=0.01)


def test_without_any_floor_there_is_still_a_view() -> None:
    view = entry_view(room(open_floor=True), np.empty((0, 3)), Settings())
    assert np.all(np.isfinite([view.position, view.look_at]))
    assert not np.allclose(view.position, view.look_at)
