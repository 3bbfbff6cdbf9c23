"""Lengths that several stages share, from the scan's spacing and the tour file."""

from __future__ import annotations

from tourgen.stages.spacing import Spacing
from tourgen.tour import Box

_FINEST_DETAIL_M = 0.006
"""Solves a room of 7 m at octree depth 10; depth 11 takes four times the time and memory."""

Corner = tuple[float, float, float]


def corners(box: Box) -> tuple[Corner, Corner]:
    """A box as its lowest and highest corner."""
    return box.min, box.max


def detail_m(spacing: Spacing, detail_mm: float | None) -> float:
    """The finest detail: what is asked for, else what the median spacing can carry."""
    return detail_mm / 1000 if detail_mm else max(spacing.median_m, _FINEST_DETAIL_M)


def support_m(spacing: Spacing) -> float:
    """How far from every point a surface is no longer supported."""
    return max(0.03, 3 * spacing.median_m)
