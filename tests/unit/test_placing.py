"""Rooms stand so that a door and the door back are one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tourgen.placing import Doorway, Place, Plot, placed

BOX = np.array([[-2.0, -1.5, 0.0], [2.0, 1.5, 2.5]])


def door(to: str, at: tuple[float, float, float], heading_deg: float) -> Doorway:
    turn = np.radians(heading_deg)
    return Doorway(to, np.array(at), np.array([np.cos(turn), np.sin(turn)]))


def plot(name: str, *doors: Doorway, given: Place | None = None) -> Plot:
    return Plot(name, BOX, doors, given)


def test_a_room_stands_behind_its_door() -> None:
    hall = plot("hall", door("den", (2, 0, 0), 0))
    den = plot("den", door("hall", (0, 1.5, 0.2), 90))
    found = placed([hall, den], "hall")
    assert found["hall"] == Place(pytest.approx(np.zeros(3)), 0.0)
    assert found["den"].turn_deg == 90
    assert found["den"].of(np.array([0, 1.5, 0.2])) == pytest.approx([2, 0, 0])
    assert found["den"].of(np.array([0, 0, 0.2])) == pytest.approx([3.5, 0, 0])


@given(
    turn=st.integers(0, 23),
    out=st.floats(0, 360),
    error=st.floats(-6, 6),
    at=st.tuples(*[st.floats(-5, 5)] * 3),
)
def test_doors_meet_though_their_walls_are_told_badly(
    turn: int, out: float, error: float, at: tuple[float, float, float]
) -> None:
    hall = plot("hall", door("den", at, out))
    den = plot("den", door("hall", (0, 1.5, 0), out + 180 - 15 * turn + error))
    found = placed([hall, den], "hall")
    assert (found["den"].turn_deg - 15 * turn) % 360 == pytest.approx(0)
    assert found["den"].of(np.array([0, 1.5, 0])) == pytest.approx(np.array(at))


def test_what_the_tour_file_says_goes_before_the_doors() -> None:
    there = Place(np.array([0.0, 0.0, 6.0]), 30.0)
    hall = plot("hall", door("loft", (2, 0, 0), 0))
    loft = plot(
        "loft", door("hall", (0, 1.5, 0), 90), door("attic", (0, -1.5, 0), 270), given=there
    )
    attic = plot("attic", door("loft", (0, 1.5, 0), 90))
    found = placed([hall, loft, attic], "hall")
    assert found["loft"] is there
    assert found["attic"].turn_deg == 30
    assert found["attic"].at[2] == pytest.approx(6)


def test_a_room_without_a_door_stands_beside_the_others() -> None:
    rooms = [plot("one"), plot("two"), plot("three")]
    found = placed(rooms, "two")
    spans = sorted((found[each.id].at[0] - 2, found[each.id].at[0] + 2) for each in rooms)
    assert spans[0][1] < spans[1][0]
    assert spans[1][1] < spans[2][0]
