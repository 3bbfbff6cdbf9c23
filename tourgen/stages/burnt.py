"""Burnt out: where a camera gave all that it can give."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tourgen.geometry import UInt8

_WITHIN = 5
_LOWEST_END = 235


def burnt_out(colors: UInt8) -> npt.NDArray[np.bool_]:
    """Where all three channels of a picture are at their end.

    White balance scales a channel that was clipped before: it ends below 255, though hardly below
    235, where nothing needs to have burnt out.

    Args:
        colors: (..., 3) sRGB of one camera.

    Returns:
        (...) mask.
    """
    ends = np.maximum(colors.reshape(-1, 3).max(0, initial=0), _LOWEST_END).astype(np.int16)
    return np.asarray((colors >= ends - _WITHIN).all(-1))
