"""Burnt out: where a camera gave all that it can give.

White balance scales a channel that was clipped before: it ends below 255, though hardly below
235, where nothing needs to have burnt out. What a lamp burns out piles up there; a few points
beyond it were another station's (in the second chamber 4 of 2.4 million, which hid the lamp).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tourgen.geometry import UInt8

_WITHIN = 5
_PILED = 1e-4
"""Share of the points that lie at a channel's end, at least."""
_LOWEST_END = 235


def ends(colors: UInt8) -> UInt8:
    """(3,) the end of each channel of (..., 3) sRGB of one camera, at least 235."""
    every = colors.reshape(-1, 3)
    found = []
    for channel in every.T:
        from_top = np.cumsum(np.bincount(channel, minlength=256)[::-1])
        found.append(255 - int(np.argmax(from_top > _PILED * len(every))))
    return np.maximum(found, _LOWEST_END).astype(np.uint8)


def burnt_out(colors: UInt8) -> npt.NDArray[np.bool_]:
    """Where all three channels of a picture are at their end.

    Args:
        colors: (..., 3) sRGB of one camera.

    Returns:
        (...) mask.
    """
    return np.asarray((colors >= ends(colors) - _WITHIN).all(-1))
