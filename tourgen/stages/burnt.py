"""Burnt out: where a camera gave all that it can give.

White balance scales a channel that was clipped before: it ends below 255, though hardly below
235, where nothing needs to have burnt out.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tourgen.geometry import UInt8

_WITHIN = 5
_LOWEST_END = 235


def ends(colors: UInt8) -> UInt8:
    """(3,) the highest value of each channel of (..., 3) sRGB of one camera, at least 235."""
    return np.asarray(colors.reshape(-1, 3).max(0, initial=_LOWEST_END), np.uint8)


def burnt_out(colors: UInt8) -> npt.NDArray[np.bool_]:
    """Where all three channels of a picture are at their end.

    Args:
        colors: (..., 3) sRGB of one camera.

    Returns:
        (...) mask.
    """
    return np.asarray((colors >= ends(colors) - _WITHIN).all(-1))
