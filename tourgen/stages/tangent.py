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

import numpy as np

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Int32
from tourgen.neighbours import Grid, Neighbours, nearest_to
from tourgen.symmetric import axes_of
from tourgen.threads import in_parts

_PART = 1 << 13
_NOISE_SAMPLE = 20_000
_RIVALS = 12
_TUKEY = 3.0
"""Where a neighbour's weight ends, in standard deviations of the noise."""
_NOT_FLAT = 1.5
"""Times the noise: root mean square residual beyond which other planes may compete."""
_ROUNDS = 3
_LEAST_NOISE_M = 1e-4
_EVERYWHERE = np.float32(np.inf)


def tangent_planes(points: Float32, first_neighbours: int, neighbours: int) -> Float32:
    """Directions of the surface.

    Args:
        points: (n, 3) metres, at least three.
        first_neighbours: Points of the first fit, the point itself among them.
        neighbours: Points that the robust fit chooses from.

    Returns:
        (n, 3) unit normals; which of the two sides they look at is arbitrary.
    """
    count, first, wide = (
        len(points),
        min(first_neighbours, len(points)),
        min(neighbours, len(points)),
    )
    around = Neighbours.of(points, wide)
    normal, refined = np.empty((2, count, 3), np.float32)
    height_m = np.empty(count, np.float32)

    def begin(start: int, end: int) -> None:
        _begin(around.grid, start, end, first, normal, height_m)

    in_parts(begin, count, _PART)
    noise_m = _noise(height_m, first)
    rivals = np.unique(np.geomspace(1, 0.65 * wide, _RIVALS).astype(np.int32) - 1)

    def finish(start: int, end: int) -> None:
        _finish(around.grid, start, end, wide, rivals, normal, noise_m, refined)

    in_parts(finish, count, _PART)
    found = np.empty((count, 3), np.float32)
    found[around.number] = refined
    return found


def _noise(height_m: Float32, count: int) -> np.float32:
    """Standard deviation of the points about their planes, metres: the median over the cloud."""
    chosen = np.random.default_rng(0).permutation(len(height_m))[:_NOISE_SAMPLE]
    freedom = max(count - 3, 1)  # a plane has three parameters
    rms = float(np.median(height_m[chosen])) * np.sqrt(count / freedom)
    return np.float32(max(rms, _LEAST_NOISE_M))


@compiled
def _begin(
    grid: Grid, start: int, end: int, count: int, normal: Float32, height_m: Float32
) -> None:
    """The direction of least spread of the nearest points, and how far these lie off it."""
    points = grid[0]
    index, square = np.empty(count, np.int32), np.empty(count, np.float32)
    size, axes = np.empty(3), np.empty((3, 3))
    for i in range(start, end):
        nearest_to(
            grid, points[i, 0], points[i, 1], points[i, 2], _EVERYWHERE, _EVERYWHERE, index, square
        )
        x = y = z = xx = xy = xz = yy = yz = zz = 0.0
        for k in index:
            dx, dy, dz = (
                points[k, 0] - points[i, 0],
                points[k, 1] - points[i, 1],
                points[k, 2] - points[i, 2],
            )
            x, y, z = x + dx, y + dy, z + dz
            xx, xy, xz = xx + dx * dx, xy + dx * dy, xz + dx * dz
            yy, yz, zz = yy + dy * dy, yz + dy * dz, zz + dz * dz
        axes_of(
            xx - x * x / count,
            xy - x * y / count,
            xz - x * z / count,
            yy - y * y / count,
            yz - y * z / count,
            zz - z * z / count,
            size,
            axes,
        )
        normal[i] = axes[0]
        height_m[i] = np.sqrt(max(size[0], 0.0) / count)


@compiled
def _finish(
    grid: Grid,
    start: int,
    end: int,
    count: int,
    rivals: Int32,
    normal: Float32,
    noise_m: np.float32,
    refined: Float32,
) -> None:
    """The robust fit of some points."""
    points = grid[0]
    limit = np.float32((_TUKEY * noise_m) ** 2)
    index, square = np.empty(count, np.int32), np.empty(count, np.float32)
    x, y, z = np.empty((3, count), np.float32)
    height, weight, nearness = np.empty((3, count), np.float32)
    own, best = np.empty(3, np.float32), np.empty(3, np.float32)
    for i in range(start, end):
        nearest_to(
            grid, points[i, 0], points[i, 1], points[i, 2], _EVERYWHERE, _EVERYWHERE, index, square
        )
        wide = np.float32(1.2) * square[count - 1] + np.float32(1e-12)
        for k in range(count):
            j = index[k]
            x[k], y[k], z[k] = (
                points[j, 0] - points[i, 0],
                points[j, 1] - points[i, 1],
                points[j, 2] - points[i, 2],
            )
            nearness[k] = 1 - square[k] / wide
        own[:] = normal[i]
        off = 0.0
        for k in range(count):
            off += (x[k] * own[0] + y[k] * own[1] + z[k] * own[2]) ** 2
        if off / count > (_NOT_FLAT * noise_m) ** 2:
            most = np.float32(-1)
            for rival in rivals:
                other = normal[index[rival]]
                votes = np.float32(0)
                for k in range(count):
                    h = x[k] * other[0] + y[k] * other[1] + z[k] * other[2]
                    close = max(1 - h * h / limit, np.float32(0))
                    votes += close * close * nearness[k]
                if votes > most:
                    most = votes
                    best[:] = other
            own[:] = best
        shift = np.float32(0)
        for _ in range(_ROUNDS):
            shift = _turn(x, y, z, nearness, own, shift, limit, height, weight)
            shift = min(max(shift, -2 * noise_m), 2 * noise_m)
        refined[i] = own


@compiled
def _turn(
    x: Float32,
    y: Float32,
    z: Float32,
    nearness: Float32,
    own: Float32,
    shift: np.float32,
    limit: np.float32,
    height: Float32,
    weight: Float32,
) -> np.float32:
    """Weighted least squares of the heights over a plane: turns it; returns how high it lies."""
    count = len(x)
    ux, uy, uz, vx, vy, vz = _across(own[0], own[1], own[2])
    total = ma = mb = mh = np.float32(0)
    for k in range(count):
        h = x[k] * own[0] + y[k] * own[1] + z[k] * own[2]
        close = max(1 - (h - shift) * (h - shift) / limit, np.float32(0))
        w = close * close * nearness[k]
        height[k], weight[k] = h, w
        total += w
        ma += w * (x[k] * ux + y[k] * uy + z[k] * uz)
        mb += w * (x[k] * vx + y[k] * vy + z[k] * vz)
        mh += w * h
    total += np.float32(1e-9)
    ma, mb, mh = ma / total, mb / total, mh / total
    aa = ab = bb = ah = bh = np.float32(0)
    for k in range(count):
        a = x[k] * ux + y[k] * uy + z[k] * uz - ma
        b = x[k] * vx + y[k] * vy + z[k] * vz - mb
        rise, w = height[k] - mh, weight[k]
        aa, ab, bb = aa + w * a * a, ab + w * a * b, bb + w * b * b
        ah, bh = ah + w * a * rise, bh + w * b * rise
    aa, ab, bb, ah, bh = aa / total, ab / total, bb / total, ah / total, bh / total
    determinant = aa * bb - ab * ab
    if determinant <= np.float32(0.01) * (aa + bb) ** 2:  # they lie on a line, which tilts nothing
        return mh
    slope_a, slope_b = (ah * bb - bh * ab) / determinant, (bh * aa - ah * ab) / determinant
    own[0] -= slope_a * ux + slope_b * vx
    own[1] -= slope_a * uy + slope_b * vy
    own[2] -= slope_a * uz + slope_b * vz
    own /= np.sqrt(own[0] ** 2 + own[1] ** 2 + own[2] ** 2)
    return mh - slope_a * ma - slope_b * mb


@compiled
def _across(
    x: np.float32, y: np.float32, z: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Two unit vectors across a normal (Duff et al. 2017)."""
    sign = np.float32(1) if z >= 0 else np.float32(-1)
    a = -1 / (sign + z)
    b = x * y * a
    return 1 + sign * x * x * a, sign * b, -sign * x, b, sign + y * y * a, -y


def across(normal: Float32) -> tuple[Float32, Float32]:
    """Two unit vectors across each normal (Duff et al. 2017)."""
    x, y, z = normal.T
    sign = np.where(z >= 0, np.float32(1), np.float32(-1))
    a = -1 / (sign + z)
    b = x * y * a
    u = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1)
    v = np.stack([b, sign + y * y * a, -y], axis=1)
    return u, v
