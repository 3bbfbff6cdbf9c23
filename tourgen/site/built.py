"""What a build made of a room, as it is published."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tourgen.geometry import Float64, View
from tourgen.stages.plan import Plan


@dataclass(frozen=True, slots=True)
class Made:
    """How a room was made, for those who must cite it.

    Attributes:
        points: Points that it was made of.
        stations: Places that it was scanned from.
        faces: Faces at the finest level.
        deviation_mm: How far points lie from the surface: half of them at most, 95 % at most.
        inferred_ratio: The part of its area that no measurement stands behind.
    """

    points: int
    stations: int
    faces: int
    deviation_mm: tuple[float, float]
    inferred_ratio: float


@dataclass(frozen=True, slots=True)
class BuiltRoom:
    """What a build made of a room. All coordinates are metres from ``origin``.

    Attributes:
        id: The room's id in the tour file.
        origin: (3,) float64, scan frame.
        bounds: (2, 3) lowest and highest corner of the room's surface.
        entry: Where one enters, if not by a door.
        arrivals: For each link of the room in order, where one arrives, in metres from the origin
            of the room that the link leads to.
        viewpoints: Where one stands before each note of the room in order.
        plan: The room from above.
        files: By path relative to the room's folder: ``tileset.json``, ``tiles/*.glb``,
            ``poster.webp``, ``preview.jpg`` and ``around.webp``.
        made: How it was made.
    """

    id: str
    origin: Float64
    bounds: Float64
    entry: View
    arrivals: tuple[View, ...]
    viewpoints: tuple[View, ...]
    plan: Plan
    files: Mapping[str, bytes]
    made: Made
