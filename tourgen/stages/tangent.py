"""Tangent planes: the direction of a surface around each point, sharp along its creases.

A plain PCA (Hoppe et al. 1992) has to choose: few neighbours follow the noise, many cut every
corner. So each point gets a small PCA first and then a wide, robust fit:

1. PCA of the nearest ``first_neighbours``. Neighbours are counted, not measured, so that the
   neighbourhood follows the density.
2. Where those do not lie flat, the planes of neighbours compete for the point, as far away as
   the wide neighbourhood reaches: the one with most neighbours close to its parallel through the
   point wins. Near a crease that is a plane of the point's own side (the idea of shifting the
   neighbourhood off the edge: Boulch and Marlet 2012 vote among planes of random triples; planes
   fitted nearby are fewer, and better than any triple).
3. The plane is fitted anew to ``neighbours`` with Tukey's biweight on their distance to it
   (iteratively reweighted least squares), in units of the noise that step 1 measured. What lies
   beyond the crease has left the plane by more than that and weighs nothing.

Measured by tests/peers/orientation.py on a quarter of chamber1, angle to the true normal in
degrees, flat ground (median, 95th percentile) and 10 to 20 mm from a crease (median): PCA of 10
neighbours 3.8, 10.5, 8.3; of 32: 1.3, 3.6, 14.9; this 0.9, 2.3, 2.2. Rejected: no competition,
only reweighting (10-20 mm: 3.5; 5-10 mm: 14 instead of 4); weights by the neighbours' normals as
well (a bilateral fit: 1.9, but twice the time); Gaussian weights (the same, but exp() takes
half of the time); a third round of competition (the same).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.geometry import Float32

_CHUNK = 4000
"""Points at a time: their neighbourhoods stay in the processor's cache."""
_NOISE_SAMPLE = 20_000
_RIVALS = 12
_TUKEY = 3.0
"""Where a neighbour's weight ends, in standard deviations of the noise."""
_NOT_FLAT = 1.5
"""Times the noise: root mean square residual beyond which other planes may compete."""
_ROUNDS = 3
_LEAST_NOISE_M = 1e-4
_Columns = tuple[Float32, Float32, Float32]


def tangent_planes(points: Float32, first_neighbours: int, neighbours: int) -> Float32:
    """Directions of the surface.

    Args:
        points: (n, 3) metres, at least three.
        first_neighbours: Points of the first fit, the point itself among them.
        neighbours: Points that the robust fit chooses from.

    Returns:
        (n, 3) unit normals; which of the two sides they look at is arbitrary.
    """
    tree = cKDTree(points)
    columns = _columns(points)
    normal = np.empty_like(points)
    first = min(first_neighbours, len(points))
    wide = min(neighbours, len(points))

    def begin(part: slice) -> None:
        normal[part] = _principal(*_around(tree, columns, points[part], first)[1])

    def finish(part: slice) -> None:
        index, offset = _around(tree, columns, points[part], wide)
        refined[part] = _refined(normal, part, index, offset, noise_m)

    _in_parts(begin, len(points))
    noise_m = _noise(tree, points, normal, first)
    refined = np.empty_like(points)
    _in_parts(finish, len(points))
    return refined


def _in_parts(job: Callable[[slice], None], count: int) -> None:
    """Run chunk by chunk on all cores; numpy and the tree let go of the interpreter's lock."""
    parts = [slice(start, start + _CHUNK) for start in range(0, count, _CHUNK)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(job, parts))


def _columns(points: Float32) -> _Columns:
    """x, y and z apart: arithmetic over rows of three is several times slower."""
    x, y, z = (np.ascontiguousarray(points[:, axis]) for axis in range(3))
    return x, y, z


def _around(
    tree: cKDTree, columns: _Columns, points: Float32, count: int
) -> tuple[npt.NDArray[np.int64], _Columns]:
    """(m, k) nearest points, nearest first, and where they lie as seen from each of (m, 3)."""
    index = np.asarray(tree.query(points, k=np.arange(1, count + 1))[1])
    x, y, z = (column[index] - points[:, axis, None] for axis, column in enumerate(columns))
    return index, (x, y, z)


def _principal(x: Float32, y: Float32, z: Float32) -> Float32:
    """Directions of least spread of m neighbourhoods of k points."""
    centred = np.stack([column - column.mean(axis=1, keepdims=True) for column in (x, y, z)], 1)
    return np.asarray(np.linalg.eigh(centred @ centred.transpose(0, 2, 1))[1][:, :, 0])


def _noise(tree: cKDTree, points: Float32, normal: Float32, count: int) -> np.float32:
    """Standard deviation of the points about their planes, metres: the median over the cloud."""
    chosen = np.random.default_rng(0).permutation(len(points))[:_NOISE_SAMPLE]
    index = _around(tree, _columns(points), points[chosen], count)[0]
    height = np.einsum("mkj,mj->mk", points[index], normal[chosen])
    height -= height.mean(axis=1, keepdims=True)
    freedom = max(count - 3, 1)  # a plane has three parameters
    rms = np.sqrt(np.median((height**2).sum(axis=1) / freedom))
    return np.float32(max(rms, _LEAST_NOISE_M))


def _refined(
    normal: Float32,
    part: slice,
    index: npt.NDArray[np.int64],
    offset: _Columns,
    noise_m: np.float32,
) -> Float32:
    """The robust fit of some points."""
    limit = np.float32((_TUKEY * noise_m) ** 2)
    own = normal[part].copy()
    x, y, z = offset
    distance = x * x + y * y + z * z
    nearness = 1 - distance / (1.2 * distance[:, -1:] + np.float32(1e-12))
    residual = np.square(_heights(offset, own)).mean(axis=1)
    uneven = np.flatnonzero(residual > (_NOT_FLAT * noise_m) ** 2)
    theirs = (x[uneven], y[uneven], z[uneven])
    own[uneven] = _best_plane(normal, index[uneven], theirs, nearness[uneven], limit)
    shift = np.zeros((len(own), 1), np.float32)
    for _ in range(_ROUNDS):
        height = _heights(offset, own)
        weight = _biweight(np.square(height - shift), limit) * nearness
        own, shift = _fitted(offset, own, height, weight)
        np.clip(shift, -2 * noise_m, 2 * noise_m, out=shift)
    return own


def _best_plane(
    normal: Float32,
    index: npt.NDArray[np.int64],
    offset: _Columns,
    nearness: Float32,
    limit: np.float32,
) -> Float32:
    """Of the planes of some neighbours the one that most neighbours lie close to."""
    best = np.full(len(index), -1, np.float32)
    winner = np.empty((len(index), 3), np.float32)
    reach = index.shape[1]
    for rival in np.unique(np.geomspace(1, 0.65 * reach, _RIVALS).astype(int) - 1):
        plane = normal[index[:, rival]]
        close = _biweight(np.square(_heights(offset, plane)), limit)
        votes = np.einsum("mk,mk->m", close, nearness)
        better = votes > best
        best[better], winner[better] = votes[better], plane[better]
    return winner


def _fitted(
    offset: _Columns, normal: Float32, height: Float32, weight: Float32
) -> tuple[Float32, Float32]:
    """Weighted least squares of the heights over the plane; new normals, and their heights."""
    u, v = across(normal)
    a, b = _heights(offset, u), _heights(offset, v)
    total = weight.sum(axis=1, keepdims=True) + np.float32(1e-9)
    weight = weight / total

    def mean(values: Float32) -> Float32:
        return np.asarray(np.einsum("mk,mk->m", weight, values))[:, None]

    mean_a, mean_b, mean_h = mean(a), mean(b), mean(height)
    a, b, rise = a - mean_a, b - mean_b, height - mean_h
    aa, ab, bb, ah, bh = mean(a * a), mean(a * b), mean(b * b), mean(a * rise), mean(b * rise)
    determinant = aa * bb - ab * ab
    sound = determinant > 0.01 * (aa + bb) ** 2  # else they lie on a line, which tilts nothing
    determinant = np.where(sound, determinant, 1)
    slope_a: Float32 = np.where(sound, (ah * bb - bh * ab) / determinant, 0)
    slope_b: Float32 = np.where(sound, (bh * aa - ah * ab) / determinant, 0)
    turned = normal - slope_a * u - slope_b * v
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return turned, mean_h - slope_a * mean_a - slope_b * mean_b


def _heights(offset: _Columns, direction: Float32) -> Float32:
    """(m, k) coordinates of the neighbours along each point's direction."""
    x, y, z = offset
    height = x * direction[:, 0:1]
    height += y * direction[:, 1:2]
    height += z * direction[:, 2:3]
    return height


def _biweight(square: Float32, limit: np.float32) -> Float32:
    weight = np.maximum(1 - square / limit, 0)
    weight *= weight
    return np.asarray(weight)


def across(normal: Float32) -> tuple[Float32, Float32]:
    """Two unit vectors across each normal (Duff et al. 2017)."""
    x, y, z = normal.T
    sign = np.where(z >= 0, np.float32(1), np.float32(-1))
    a = -1 / (sign + z)
    b = x * y * a
    u = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1)
    v = np.stack([b, sign + y * y * a, -y], axis=1)
    return u, v
