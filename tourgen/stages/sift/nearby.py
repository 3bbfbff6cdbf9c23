"""Nearby: what may lie near some places, told from cells alone.

A nearest-neighbour tree over a whole scan costs seconds a million points; the cells tell in a
tenth of one which few points are worth asking.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32
from tourgen.sorting import distinct

_AXES = np.array([1 << 42, 1 << 21, 1])
_NEIGHBOURS: npt.NDArray[np.int64] = np.array(list(product((-1, 0, 1), repeat=3))) @ _AXES
_MOST_CELLS = 2**20
"""Along an axis; so that three numbers of cells fit into one of 64 bits."""


def nearby(points: Float32, places: Float32, reach_m: float) -> npt.NDArray[np.bool_]:
    """Mask of the (n, 3) points that share a cell of ``reach_m``, or touching ones, with one of
    the (m, 3) places: all that lie within that reach, and some that lie farther."""
    low = places.min(axis=0) - 2 * reach_m
    extent_m = float((places.max(axis=0) - low).max()) + 2 * reach_m
    edge_m = np.float32(max(reach_m, extent_m / _MOST_CELLS))
    inside = np.flatnonzero(((points > low) & (points < low + extent_m)).all(axis=1))
    taken = distinct(_key(_cells(places, low, edge_m)))
    wanted = distinct(taken[:, None] + _NEIGHBOURS)
    key = _key(_cells(points[inside], low, edge_m))
    found = np.zeros(len(points), np.bool_)
    at = np.minimum(np.searchsorted(wanted, key), len(wanted) - 1)
    found[inside] = wanted[at] == key
    return found


def _cells(points: Float32, low: Float32, edge_m: np.float32) -> npt.NDArray[np.int64]:
    return np.asarray(np.floor((points - low) / edge_m), np.int64)


def _key(cell: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    return np.asarray((cell + 1) @ _AXES)
