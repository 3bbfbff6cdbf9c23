"""Voxels: which cube of a grid each point lies in, and the points sorted by their cubes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.extent import extent
from tourgen.geometry import Float32
from tourgen.sorting import order_of

Ints = npt.NDArray[np.int64]
Kinds = npt.NDArray[np.integer]


def voxel_groups(points: Float32, voxel_m: float) -> tuple[Ints, Ints]:
    """Sort points by voxel.

    Returns:
        ``order`` (n,), positions sorted by voxel, and ``starts`` (v,), where each voxel begins.
    """
    return grouped(voxels(points, voxel_m)[0])


def voxels(points: Float32, voxel_m: float) -> tuple[Ints, Ints]:
    """Voxels from the lowest corner of the points on.

    Returns:
        (n,) the number of each point's voxel, by x, then y, then z; (3,) how many there are along
        each axis.
    """
    if not len(points):
        return np.empty(0, np.int64), np.zeros(3, np.int64)
    low, high = extent(points)
    shape = np.floor((high - low) / np.float32(voxel_m)).astype(np.int64) + 1
    return _numbers(points, low, np.float32(voxel_m), shape), shape


def grouped(number: Ints) -> tuple[Ints, Ints]:
    """Sort by (n,) numbers, none negative.

    Returns:
        ``order`` (n,), positions by number, equal ones in their order, and ``starts`` (v,), where
        each number begins.
    """
    order = order_of(number)
    return order, _starts(number, order)


def means(values: npt.NDArray[np.generic], order: Ints, starts: Ints) -> Float32:
    """(v, k) the mean of (n, k) values over each group of ``grouped``."""
    mean = np.empty((len(starts), values.shape[1]), np.float32)
    _average(values, order, np.append(starts, len(order)), mean)
    return mean


@compiled
def _average(values: npt.NDArray[np.generic], order: Ints, ends: Ints, mean: Float32) -> None:
    """Write the mean of each group, summed in double precision."""
    total = np.empty(values.shape[1])
    for group in range(len(ends) - 1):
        total[:] = 0
        for i in range(ends[group], ends[group + 1]):
            for k in range(len(total)):
                total[k] += values[order[i], k]
        mean[group] = total / (ends[group + 1] - ends[group])


@compiled
def _numbers(points: Float32, low: Float32, voxel_m: np.float32, shape: Ints) -> Ints:
    number = np.empty(len(points), np.int64)
    for i in range(len(points)):
        x = np.int64((points[i, 0] - low[0]) / voxel_m)
        y = np.int64((points[i, 1] - low[1]) / voxel_m)
        z = np.int64((points[i, 2] - low[2]) / voxel_m)
        number[i] = (x * shape[1] + y) * shape[2] + z
    return number


@compiled
def _starts(number: Ints, order: Ints) -> Ints:
    """Where in the order a number begins."""
    found = np.empty(len(order), np.int64)
    count = 0
    for i in range(len(order)):
        if i == 0 or number[order[i]] != number[order[i - 1]]:
            found[count] = i
            count += 1
    return found[:count].copy()
