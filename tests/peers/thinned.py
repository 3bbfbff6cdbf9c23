"""The scan of a room thinned to so few points that every method can do it, crust too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from rooms import BenchRoom, stamp
from variants import alone, scanned

from tourgen.geometry import Float32
from tourgen.simulation.output import write_ply
from tourgen.tour import Tour

ROOM = "chamber1"
POINTS = 100_000
_STEPS = 20

Ints = npt.NDArray[np.int64]


def thinned_room(room: BenchRoom, scratch: Path) -> BenchRoom:
    """The room with every cell's middlemost point alone, in cells such that so many are left."""
    scan = scratch / "thinned" / "scans" / f"{room.id}-{stamp(room.scan)}.ply"
    if not scan.exists():
        scan.parent.mkdir(parents=True, exist_ok=True)
        points, colors = room.cloud()
        left = kept(points)
        write_ply(scan, points[left], colors[left])
    return replace(room, scan=scan)


def thinned_tour(tour: Tour, room: BenchRoom, scratch: Path) -> Tour:
    """A tour of that room; the stations are given, since too few points are left to find them."""
    stations = tuple(map(tuple, np.round(room.stations(), 4).tolist()))
    scan = scanned(tour, room.id, f"scans/{room.scan.name}")
    return alone(tour, room.id, scratch / "thinned", stations=stations, **scan)


def kept(points: Float32) -> Ints:
    """Positions of the points that are left."""
    low, high = 0.001, 1.0
    for _ in range(_STEPS):
        middle = (low * high) ** 0.5
        few = len(_middlemost(points, middle)) <= POINTS
        low, high = (low, middle) if few else (middle, high)
    return _middlemost(points, high)


def _middlemost(points: Float32, cell_m: float) -> Ints:
    """The point next to the middle of each cell of a grid."""
    cell = np.floor(points / cell_m).astype(np.int64)
    away = ((points / cell_m - cell - 0.5) ** 2).sum(axis=1)
    _, number = np.unique(cell @ np.array([1, 1 << 20, 1 << 40]), return_inverse=True)
    order = np.lexsort((away, number))
    first = np.append(True, np.diff(number[order]) > 0)
    return np.sort(order[first])
