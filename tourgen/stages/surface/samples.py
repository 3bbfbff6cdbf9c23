"""Samples: what every surface method asks of its points before it starts."""

from __future__ import annotations

import numpy as np

from tourgen.errors import InputError, StageError
from tourgen.geometry import OrientedCloud

_LEAST = 4
_LEAST_WIDTH = 1e-3
"""Least width of a surface over its length: a thinner one is a line."""


def distinct_samples(oriented: OrientedCloud) -> OrientedCloud:
    """The points without those at the place of another.

    Args:
        oriented: n points with normals.

    Returns:
        The same object where no point repeats; else the first at each place, in their order.

    Raises:
        StageError: The points lie in one spot or on one line: no surface runs through them.
    """
    points = oriented.cloud.points
    view = np.ascontiguousarray(points + np.float32(0)).view(np.dtype((np.void, 12)))
    _, first = np.unique(view.reshape(-1), return_index=True)
    if len(first) < _LEAST:
        raise StageError(
            f"surface: expected points at {_LEAST} places or more, found {len(first)}",
            "check the scan, or thin it less",
        )
    away = points[first] - points[first].mean(axis=0, dtype=np.float64).astype(np.float32)
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(away, rowvar=False)), 0))
    if spread[1] < _LEAST_WIDTH * spread[2]:
        raise StageError(
            "surface: expected points on a surface, found them on a line", "check the scan"
        )
    if len(first) == len(points):
        return oriented
    kept = np.sort(first)
    return OrientedCloud(oriented.cloud.take(kept), oriented.normals[kept], oriented.stations)


def require_range(name: str, value: float, low: float, high: float) -> None:
    """Refuse a setting outside its range.

    Raises:
        InputError: It lies outside, or is no number.
    """
    if not low <= value <= high:
        raise InputError(
            f"surface: {name}: expected {low:.7g} to {high:.7g}, found {value:.7g}",
            "give a value in the range, or leave it out",
        )
