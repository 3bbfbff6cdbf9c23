"""Loops compiled to machine code, by Numba.

What a room's points are asked point by point (neighbourhoods, planes, distances) is written as the
loop that it is: numpy would hold every neighbour of every point at once, and read and write it in
a dozen passes. The code is compiled on first use and kept beside the source, or in the user's
cache where that cannot be written; it runs without the interpreter's lock, so threads share it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

Loop = TypeVar("Loop", bound=Callable[..., object])


def compiled(loop: Loop) -> Loop:
    """Compile a function of arrays and numbers; IEEE arithmetic, nothing reordered."""
    return cast("Loop", numba.njit(cache=True, nogil=True, error_model="numpy")(loop))
