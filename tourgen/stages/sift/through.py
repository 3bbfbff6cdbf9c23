"""Through: places that one station measured and another looked through.

Whoever walks past stands in one station's view only, and the others measured what lies behind.
A place is looked through where a station's beams around its direction all went farther by a
margin, or met a smooth surface that lies farther in that very direction. So do edges and slanted
surfaces stay. So do rods, even such as fit between two beams: what was looked through must be
wider than that, or a point without company.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_dilation, binary_opening
from scipy.spatial import cKDTree

from tourgen.geometry import Float32
from tourgen.stages.sift.views import View

Mask = npt.NDArray[np.bool_]
_LEAST_BEAMS = 5
_SQUARE = np.ones((3, 3), np.bool_)
_LINE_POINTS = 3
_LINE_SPACINGS = 2.5


def passed(points: Float32, seen: Sequence[View], margin_m: float) -> Mask:
    """Mask of the (n, 3) points that a station other than their own looked through."""
    wide, narrow = np.zeros((2, len(points)), np.bool_)
    for number, view in enumerate(seen):
        if len(view) <= _LEAST_BEAMS:
            continue
        for other, theirs in enumerate(seen):
            if other == number:
                continue
            cell, beyond_m = view.beyond_m(points[theirs.index])
            through = beyond_m > margin_m
            at, cell = theirs.index[through], cell[through]
            filled = np.zeros(view.picture.beams.shape, np.bool_)
            filled.reshape(-1)[cell] = True
            core = binary_opening(filled, _SQUARE)
            broad = binary_dilation(core, _SQUARE, iterations=2).reshape(-1)[cell]
            wide[at[broad]] = True
            narrow[at[~broad]] = True
    narrow &= ~wide
    for view in seen:
        thin = np.flatnonzero(narrow[view.index])
        narrow[view.index[thin[_in_line(view, thin, points)]]] = False
    return wide | narrow


def _in_line(view: View, at: npt.NDArray[np.int64], points: Float32) -> Mask:
    """Which of the points ``at`` of a view have several others of them close by, as a rod has."""
    if len(at) <= _LINE_POINTS:
        return np.zeros(len(at), np.bool_)
    own = points[view.index[at]]
    distance = np.asarray(cKDTree(own).query(own, k=[_LINE_POINTS + 1])[0])
    spacing_m = view.picture.step_rad * view.range_m[at]
    return np.asarray(np.asarray(distance)[:, 0] < _LINE_SPACINGS * spacing_m)
