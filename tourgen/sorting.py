"""Sorting by whole numbers: a radix sort, which numpy has for 16 bits alone.

The cells of 15 million points: 0.6 instead of 1.7 s. And each once: `numpy.unique` keeps them in a
hash table, which takes 17 times as long as sorting a million (numpy 2.4).
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled

Keys = npt.NDArray[np.int64]
Whole = TypeVar("Whole", bound=np.integer[Any])

_BITS = 13
"""Of a key at a time: so many counters stay in the processor's cache."""


def order_of(keys: Keys) -> Keys:
    """(n,) the order that sorts (n,) keys, none negative; equal ones stay in their order."""
    order = np.arange(len(keys), dtype=np.int64)
    if len(keys):
        bits = int(keys.max()).bit_length()
        for shift in range(0, bits, _BITS):
            order = _pass(keys, order, shift)
    return order


def distinct(keys: npt.NDArray[Whole]) -> npt.NDArray[Whole]:
    """The keys sorted, each once."""
    ordered = np.sort(keys, axis=None)
    first = np.concatenate([[True], ordered[1:] != ordered[:-1]])[: len(ordered)]
    return np.asarray(ordered[first], keys.dtype)


@compiled
def _pass(keys: Keys, order: Keys, shift: int) -> Keys:
    """Sort by some bits of the keys what is sorted by those below."""
    mask = (1 << _BITS) - 1
    starts = np.zeros((1 << _BITS) + 1, np.int64)
    for i in order:
        starts[(keys[i] >> shift & mask) + 1] += 1
    for digit in range(1 << _BITS):
        starts[digit + 1] += starts[digit]
    sorted_order = np.empty(len(order), np.int64)
    for i in order:
        digit = keys[i] >> shift & mask
        sorted_order[starts[digit]] = i
        starts[digit] += 1
    return sorted_order
