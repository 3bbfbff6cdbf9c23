"""Growing: the cells that a surface enters, found from some of them on.

From a cell on to its neighbours across every face that the surface crosses (Wyvill, McPheeters and
Wyvill 1986; Bloomenthal 1988), so that time and memory follow the area, not the room.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tourgen.geometry import Float32
from tourgen.stages.surface.marching_cubes import CELL_CORNERS, STEPS, Keys


def grown(
    distance: Callable[[Keys], Float32], seeds: Keys, key: Keys, value: Float32, most_m: float
) -> tuple[Keys, Float32]:
    """Corners and distances of all cells that a surface enters.

    Args:
        distance: Of (n,) corners, metres, NaN where it is unknown.
        seeds: Cells to begin with.
        key: (m,) corners whose distance is told already, sorted.
        value: (m,) their distances.
        most_m: A face along which the distance changes by more is not crossed: it jumps there.

    Returns:
        Sorted keys and their distances; see ``marching_cubes``.
    """
    cells, fresh = np.empty(0, np.int64), distinct(seeds)
    while len(fresh):
        cells = np.insert(cells, np.searchsorted(cells, fresh), fresh)
        new = _without(distinct(fresh[:, None] + CELL_CORNERS), key)
        at = np.searchsorted(key, new)
        key, value = np.insert(key, at, new), np.insert(value, at, distance(new))
        of_cells = value[np.searchsorted(key, fresh[:, None] + CELL_CORNERS)]
        fresh = _without(distinct(_across_crossed_faces(fresh, of_cells, most_m)), cells)
    return key, value


def _across_crossed_faces(cells: Keys, value: Float32, most_m: float) -> Keys:
    """The cells across those faces of ``cells`` that the surface crosses."""
    found = []
    for axis, step in enumerate(STEPS):
        for side, way in ((0, -step), (1, step)):
            face = value[:, [corner for corner in range(8) if corner >> axis & 1 == side]]
            low, high = face.min(axis=1), face.max(axis=1)  # NaN where one is unknown
            crossed = (low <= 0) & (high > 0) & (high - low < most_m)
            found.append(cells[crossed] + way)
    return np.concatenate(found)


def distinct(keys: Keys) -> Keys:
    """The keys sorted, each once."""
    ordered = np.sort(keys, axis=None)
    first = np.concatenate([[True], ordered[1:] != ordered[:-1]])[: len(ordered)]
    return np.asarray(ordered[first], np.int64)


def _without(keys: Keys, known: Keys) -> Keys:
    """The keys that are not among the known ones, all sorted."""
    if not len(known):
        return keys
    at = np.minimum(np.searchsorted(known, keys), len(known) - 1)
    return np.asarray(keys[known[at] != keys], np.int64)
