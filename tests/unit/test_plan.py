"""A plan shows the floor, walls with their openings, and which way doors lead."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from shapely import Polygon

from tourgen.geometry import Float32, Mesh
from tourgen.stages.plan import Settings, Storey, plan

ENTRY = np.array([0.0, 0.0, 1.6])
NONE = np.empty((0, 3))


def joined(*parts: trimesh.Trimesh) -> Mesh:
    one = trimesh.util.concatenate(parts)
    return Mesh(np.zeros(3), one.vertices.astype(np.float32), one.faces.astype(np.int32))


def shell(height: float = 2.5, base: float = 0.0) -> trimesh.Trimesh:
    """4 x 6 m, seen from inside, of small faces."""
    box = trimesh.creation.box((4, 6, height)).subdivide_to_size(0.3)
    box.apply_translation((0, 0, base + height / 2))
    box.invert()
    return box


def with_door(room: trimesh.Trimesh) -> trimesh.Trimesh:
    """A doorway of about a metre in the wall at x = 2."""
    x, y, z = room.triangles_center.T
    room.update_faces(~((x > 1.99) & (np.abs(y) < 0.5) & (z < 2.0)))
    return room


def block(size: tuple[float, float, float], at: tuple[float, float, float]) -> trimesh.Trimesh:
    made = trimesh.creation.box(size)
    made.apply_translation(at)
    return made


def area(rings: tuple[Float32, ...]) -> float:
    """What an odd number of rings encloses."""
    found = Polygon()
    for ring in rings:
        found = found.symmetric_difference(Polygon(ring))
    return float(found.area)


def length(lines: tuple[Float32, ...]) -> float:
    return float(sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines))


def only(storeys: tuple[Storey, ...]) -> Storey:
    (one,) = storeys
    return one


def test_a_bare_room_is_its_outline() -> None:
    storey = only(plan(joined(shell()), ENTRY, NONE, Settings()).storeys)
    assert storey.floor_m == pytest.approx(0, abs=1e-3)
    assert area(storey.floor) == pytest.approx(24, abs=0.01)
    assert length(storey.walls) == pytest.approx(20, abs=0.01)
    assert not storey.low
    assert sum(map(len, storey.walls)) <= 6, "straight walls need no more than their corners"


def test_a_doorway_is_a_gap_in_the_wall_and_none_in_the_floor() -> None:
    drawn = plan(joined(with_door(shell())), ENTRY, np.array([[2.0, 0, 1.2]]), Settings())
    storey = only(drawn.storeys)
    gap = 20 - length(storey.walls)
    assert 0.6 < gap < 1.5
    assert area(storey.floor) == pytest.approx(24, abs=0.05)
    assert drawn.door_way[0] == pytest.approx([1, 0], abs=0.02)
    assert drawn.door_floor_m[0] == pytest.approx(0, abs=1e-3)


def test_a_pillar_is_no_floor_and_a_table_is_drawn_thin() -> None:
    pillar, table = block((0.5, 0.5, 2.5), (1, 1, 1.25)), block((1, 2, 0.7), (-1, -1, 0.35))
    storey = only(plan(joined(shell(), pillar, table), ENTRY, NONE, Settings()).storeys)
    assert area(storey.floor) == pytest.approx(24 - 0.25, abs=0.02)
    assert length(storey.low) == pytest.approx(6, abs=0.1)


def test_a_room_with_doors_on_two_floors_has_two_storeys() -> None:
    gallery = block((4, 1.5, 0.2), (0, 2.25, 3.1))
    doors = np.array([[2.0, -2, 1.2], [-2.0, 2.2, 4.3]])
    drawn = plan(joined(shell(6.0), gallery), ENTRY, doors, Settings())
    assert [storey.floor_m for storey in drawn.storeys] == pytest.approx([0, 3.2], abs=0.01)
    assert drawn.door_way == pytest.approx(np.array([[1, 0], [-1, 0]]), abs=0.35)


def test_where_nothing_is_cut_there_is_no_floor() -> None:
    flat = block((3, 3, 0.1), (0, 0, -0.05))
    storey = only(plan(joined(flat), ENTRY, NONE, Settings()).storeys)
    assert storey.floor == storey.walls == storey.low == ()
