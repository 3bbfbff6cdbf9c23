"""Placing: where rooms stand beside each other, as their doors say.

Two rooms joined by a door and a door back stand so that both doors are one: at one place, on one
floor, looking away from each other. Scans are rarely true to the compass, rooms nearly always
square to each other, so that turns are taken in steps. From the start room each is placed beside
the one that it was first reached from; what the tour file says goes before. A room without any
door stands aside.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tourgen.geometry import Float64

_TURN_DEG = 15.0
_ASIDE_M = 1.0


@dataclass(frozen=True, slots=True)
class Place:
    """Where a room stands in its building.

    Attributes:
        at: (3,) where the origin of the room's coordinates lies, metres.
        turn_deg: By how much the room is turned, counter-clockwise seen from above.
    """

    at: Float64
    turn_deg: float

    def of(self, points: Float64) -> Float64:
        """(..., 3) points of the room in the building."""
        return np.asarray(points @ _turned(self.turn_deg).T + self.at)


@dataclass(frozen=True, slots=True)
class Doorway:
    """A door as its room knows it.

    Attributes:
        to: The room behind it.
        at: (3,) on the floor, metres from the room's origin.
        way: (2,) unit, out of the room.
    """

    to: str
    at: Float64
    way: Float64


@dataclass(frozen=True, slots=True)
class Plot:
    """What is known of a room.

    Attributes:
        id: The room.
        bounds: (2, 3) lowest and highest corner, metres from the room's origin.
        doorways: Its doors.
        given: Where it stands, if that is said.
    """

    id: str
    bounds: Float64
    doorways: tuple[Doorway, ...]
    given: Place | None


def placed(plots: Sequence[Plot], start: str) -> Mapping[str, Place]:
    """Where every room stands; the start room at the origin, if nothing else is said."""
    by_id = {plot.id: plot for plot in plots}
    found = {plot.id: plot.given for plot in plots if plot.given}
    found.setdefault(start, Place(np.zeros(3), 0.0))
    _follow_doors(by_id, found, deque([start, *(room for room in found if room != start)]))
    for plot in plots:
        if plot.id not in found:
            found[plot.id] = _aside(plot, by_id, found)
            _follow_doors(by_id, found, deque([plot.id]))
    return found


def _follow_doors(by_id: Mapping[str, Plot], found: dict[str, Place], waiting: deque[str]) -> None:
    """Place all that can be reached from some rooms, the nearest first."""
    while waiting:
        here = by_id[waiting.popleft()]
        for door in here.doorways:
            back = next((each for each in by_id[door.to].doorways if each.to == here.id), None)
            if door.to not in found and back:
                found[door.to] = _behind(found[here.id], door, back)
                waiting.append(door.to)


def _behind(place: Place, door: Doorway, back: Doorway) -> Place:
    """Where the room behind a door stands, by its door back."""
    out, into = _heading_deg(door.way), _heading_deg(back.way)
    turn_deg = place.turn_deg + out + 180.0 - into
    turn_deg = float(np.round(turn_deg / _TURN_DEG) * _TURN_DEG % 360.0)
    at = place.of(door.at) - _turned(turn_deg) @ back.at
    return Place(at, turn_deg)


def _aside(plot: Plot, by_id: Mapping[str, Plot], found: Mapping[str, Place]) -> Place:
    """Beside all rooms that have a place, on the floor of the lowest."""
    corners = np.concatenate([place.of(_corners(by_id[room])) for room, place in found.items()])
    low, high = corners.min(axis=0), corners.max(axis=0)
    at = np.array([high[0] + _ASIDE_M, (low[1] + high[1]) / 2, low[2]])
    at -= [plot.bounds[0, 0], plot.bounds[:, 1].mean(), plot.bounds[0, 2]]
    return Place(at, 0.0)


def _corners(plot: Plot) -> Float64:
    """(8, 3) of a room's box."""
    axes = np.meshgrid(*plot.bounds.T, indexing="ij")
    return np.stack(axes, axis=-1).reshape(-1, 3)


def _heading_deg(way: Float64) -> float:
    return float(np.degrees(np.arctan2(way[1], way[0])))


def _turned(turn_deg: float) -> Float64:
    """(3, 3) a turn about the vertical."""
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
