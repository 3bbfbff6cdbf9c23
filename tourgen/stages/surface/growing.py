"""Growing: the cells that a surface enters, found from some of them on.

From a cell on to its neighbours across every face that the surface crosses (Wyvill, McPheeters and
Wyvill 1986; Bloomenthal 1988), so that time and memory follow the area, not the room.

All keys are kept sorted: what is found of them is merged, never sorted again. A gap is crossed in
hundreds of small rounds, so what they find is kept apart and merged into the rest when it is worth
it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.geometry import Float32
from tourgen.sorting import distinct
from tourgen.stages.surface.marching_cubes import CELL_CORNERS, STEPS, Keys

_WORTH = 0.125
"""Of what is known, the share found lately from which on it is merged."""
_NO_KEYS: Keys = np.empty(0, np.int64)
_NO_VALUES: Float32 = np.empty(0, np.float32)


Within = Callable[[Keys], npt.NDArray[np.bool_]]


@dataclass(frozen=True, slots=True)
class Grown:
    """All cells that a surface enters.

    Attributes:
        key: (n,) of their corners, sorted; see ``marching_cubes``.
        value: (n,) the distance at each, metres.
        outside: Cells that the surface enters, from within, where it was not followed.
    """

    key: Keys
    value: Float32
    outside: Keys


def grown(
    distance: Callable[[Keys], Float32],
    seeds: Keys,
    key: Keys,
    value: Float32,
    most_m: float,
    within: Within | None = None,
) -> Grown:
    """Follow a surface from cell to cell.

    Args:
        distance: Of (n,) corners, metres, NaN where it is unknown.
        seeds: Cells to begin with.
        key: (m,) corners whose distance is told already, sorted.
        value: (m,) their distances.
        most_m: A face along which the distance changes by more is not crossed: it jumps there.
        within: Tells of (n,) cells which are to be entered; None: all.
    """
    told, outside = _Told(key, value), _NO_KEYS
    cells, lately, fresh = _NO_KEYS, _NO_KEYS, distinct(seeds)
    while len(fresh):
        lately = union(lately, fresh)
        told.add(distance, _corners(fresh))
        crossed = told.crossed(fresh, np.float32(most_m))
        fresh = without(without(_across(fresh, crossed), cells), lately)
        if within:
            inside = within(fresh)
            outside, fresh = union(outside, fresh[~inside]), fresh[inside]
        if len(lately) > _WORTH * len(cells):
            cells, lately = union(cells, lately), _NO_KEYS
            told.settle()
    told.settle()
    return Grown(told.key, told.value, outside)


class _Told:
    """Corners with their distances, those told lately apart."""

    def __init__(self, key: Keys, value: Float32) -> None:
        self.key, self.value = key, value
        self._late_key, self._late_value = _NO_KEYS, _NO_VALUES

    def add(self, distance: Callable[[Keys], Float32], corners: Keys) -> None:
        """Have those told that are not."""
        new = without(without(corners, self.key), self._late_key)
        late = self._late_key, self._late_value
        self._late_key, self._late_value = _merged(*late, new, distance(new))

    def settle(self) -> None:
        """Merge what was told lately into the rest."""
        late = self._late_key, self._late_value
        self.key, self.value = _merged(self.key, self.value, *late)
        self._late_key, self._late_value = _NO_KEYS, _NO_VALUES

    def crossed(self, cells: Keys, most_m: np.float32) -> npt.NDArray[np.bool_]:
        """(6, n) whether the surface crosses each face of n cells; bit 0 of a face's number is
        the side, the others are the axis."""
        told = self.key, self.value, self._late_key, self._late_value
        return _crossed(cells, *told, most_m)


def _corners(cells: Keys) -> Keys:
    """The corners of sorted cells."""
    found = cells
    for step in STEPS:
        found = union(found, found + step)
    return found


def _across(cells: Keys, crossed: npt.NDArray[np.bool_]) -> Keys:
    """The cells across crossed faces of sorted cells."""
    found = _NO_KEYS
    for face in range(6):
        step = STEPS[face >> 1] if face & 1 else -STEPS[face >> 1]
        found = union(found, cells[crossed[face]] + step)
    return found


@compiled
def _crossed(
    cells: Keys,
    key: Keys,
    value: Float32,
    late_key: Keys,
    late_value: Float32,
    most_m: np.float32,
) -> npt.NDArray[np.bool_]:
    """See ``_Told.crossed``."""
    found = np.empty((6, len(cells)), np.bool_)
    at, late = np.zeros(8, np.int64), np.zeros(8, np.int64)
    here = np.empty(8, np.float32)
    for i in range(len(cells)):
        for c in range(8):
            corner = cells[i] + CELL_CORNERS[c]
            at[c] = _place(key, corner, at[c])
            if at[c] < len(key) and key[at[c]] == corner:
                here[c] = value[at[c]]
            else:
                late[c] = _place(late_key, corner, late[c])
                here[c] = late_value[late[c]]
        for face in range(6):
            low, high, known = np.float32(np.inf), np.float32(-np.inf), True
            for c in range(8):
                if c >> (face >> 1) & 1 == face & 1:
                    known &= not np.isnan(here[c])
                    low, high = min(low, here[c]), max(high, here[c])
            found[face, i] = known and low <= 0 and high > 0 and high - low < most_m
    return found


@compiled
def _place(keys: Keys, key: int, start: int) -> int:
    """Where a key stands among sorted keys, or would, not before ``start``: found by strides that
    double, since it mostly is near (Bentley and Yao 1976)."""
    stride, low = 1, start
    while low + stride < len(keys) and keys[low + stride] < key:
        low += stride
        stride *= 2
    high = min(low + stride, len(keys))
    while low < high:
        middle = (low + high) // 2
        if keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    return low


@compiled
def union(a: Keys, b: Keys) -> Keys:
    """The keys of both, sorted, each once; both are."""
    found = np.empty(len(a) + len(b), np.int64)
    i = j = count = 0
    while i < len(a) and j < len(b):
        found[count] = min(a[i], b[j])
        i, j = i + (a[i] <= found[count]), j + (b[j] <= found[count])
        count += 1
    for rest, first in ((a, i), (b, j)):
        for k in range(first, len(rest)):
            found[count] = rest[k]
            count += 1
    return found[:count].copy()


@compiled
def without(keys: Keys, known: Keys) -> Keys:
    """The sorted keys that are not among sorted known ones."""
    found = np.empty(len(keys), np.int64)
    count = at = 0
    for key in keys:
        at = _place(known, key, at)
        if at == len(known) or known[at] != key:
            found[count] = key
            count += 1
    return found[:count].copy()


@compiled
def _merged(key: Keys, value: Float32, new: Keys, distance: Float32) -> tuple[Keys, Float32]:
    """Sorted keys with their values, and new ones among them, none of which is there."""
    count = len(key) + len(new)
    keys, values = np.empty(count, np.int64), np.empty(count, np.float32)
    i = j = 0
    for k in range(count):
        if j == len(new) or (i < len(key) and key[i] < new[j]):
            keys[k], values[k] = key[i], value[i]
            i += 1
        else:
            keys[k], values[k] = new[j], distance[j]
            j += 1
    return keys, values
