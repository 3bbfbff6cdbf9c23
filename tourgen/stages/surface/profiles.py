"""Profiles: mouldings, beams and the edges of boards are read along their length.

A moulding's facets are 20 mm wide, points 12 mm apart: no neighbourhood is small enough to lie on
one facet and large enough to tell its plane from the noise. But a profile is the same all along,
for metres. So where the surface runs on in one direction, space is compressed in that direction and
tangent planes are fitted there: neighbours then come from an ellipsoid that is long and thin, and a
section of the profile has several times the points across. The fit itself is the same one
(``stages.tangent``, robust to creases, then ``tangent_planes``); where more of the neighbours agree
with it than with the one in plain space, it holds.

The directions are those in which many neighbourhoods' normals do not turn: the axis of a
generalised cylinder is the direction across which its normals spread.

On the demo's second chamber (most creases lie between facets of 15 to 60 mm) 50 % of the creases
lay within 4 mm before and 56 % after, and walls stayed as flat as they were. Without the guards
below it was 59 %, but columns of a scan were taken for facets: normals of walls 5.6° off instead of
2.9°. Compressed fourfold or sixteenfold instead of eightfold: fewer creases.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Int32, OrientedCloud, PointCloud
from tourgen.neighbours import Neighbours
from tourgen.stages import tangent
from tourgen.stages.surface.tangent_planes import Smoothing, TangentPlanes, tangent_planes
from tourgen.symmetric import axes_of
from tourgen.threads import each, in_parts

_PART = 1 << 14
_COMPRESSED = np.float32(8.0)
_NEIGHBOURS = 32
"""Points whose normals tell the direction in which the surface runs on."""
_STEADY, _BENT = 0.06, 0.02
"""Mean square of the normals along that direction, at most, and across, at least."""
_PEAK = np.cos(np.radians(3.0))
_APART = np.cos(np.radians(6.0))
_DIRECTIONS = 12
_LEAST_SHARE = 0.005
"""Part of the sampled points that run on in a direction that is tried."""
_SAMPLE = 20_000
_ALONG = np.cos(np.radians(15.0))
"""How far off a direction a point's own may be for it to be tried."""
_FIRST, _WIDE = 24, 48
"""Neighbours of the robust fit; see ``tangent.tangent_planes``. They have to reach from one column
of a scan to the next where the columns run in the direction: of a single one any plane can be
fitted."""
_SPARSE = 1.8
"""Where points lie farther apart, in the median of the room, columns are too far apart for that."""
_TURNED = 0.7
"""Cosine between a normal and the one in plain space, at least."""
_BETTER = 0.15
"""By how much more of the neighbours must agree."""
_LEAST = 64
_FLATTEST = 0.8
"""Length across the direction of a normal that the fit finds, at least."""

Ints = npt.NDArray[np.int64]


def along_profiles(
    planes: TangentPlanes, raw: Float32, rest: npt.NDArray[np.bool_], smoothing: Smoothing
) -> TangentPlanes:
    """Fit tangent planes anew where the surface runs on in one direction.

    Args:
        planes: n tangent planes.
        raw: (n, 3) the points that they were fitted to, metres.
        rest: (n,) mask of those to be looked at: what lies on a broad flat needs no better plane.
        smoothing: As they were fitted.

    Returns:
        n tangent planes.
    """
    sparse_m = _SPARSE * float(np.median(planes.spacing_m))
    at = np.flatnonzero(rest & (planes.spacing_m < sparse_m))
    if len(at) < _LEAST:
        return planes
    own, runs_on = _directions(planes.points[at], planes.normals[at])
    points, normals = planes.points.copy(), planes.normals.copy()
    best, support = planes.support + np.float32(_BETTER), planes.support.copy()

    def fit(way: Float32) -> tuple[Ints, TangentPlanes] | None:
        tried = at[runs_on & (np.abs(own @ way) > _ALONG)]
        if len(tried) < _LEAST:
            return None
        return tried, _fitted(raw[tried], planes.normals[tried], way, smoothing)

    for tried, fitted in filter(None, each(fit, _peaks(own[runs_on]))):
        turned = np.einsum("ij,ij->i", fitted.normals, planes.normals[tried])
        better = (fitted.support > best[tried]) & (turned > _TURNED)
        won = tried[better]
        points[won], normals[won] = fitted.points[better], fitted.normals[better]
        best[won] = support[won] = fitted.support[better]
    return replace(planes, points=points, normals=normals, support=support)


def _directions(points: Float32, normals: Float32) -> tuple[Float32, npt.NDArray[np.bool_]]:
    """(n, 3) direction in which the surface runs on around each point; (n,) whether it does."""
    count = min(_NEIGHBOURS, len(points))
    near = Neighbours.of(points, count).nearest(points, count)[0]
    ways, runs_on = np.empty_like(points), np.empty(len(points), np.bool_)

    def find(first: int, last: int) -> None:
        _runs_on(normals, near[first:last], ways[first:last], runs_on[first:last])

    in_parts(find, len(points), _PART)
    return ways, runs_on


@compiled
def _runs_on(normals: Float32, near: Int32, ways: Float32, runs_on: npt.NDArray[np.bool_]) -> None:
    """Write the direction across which the normals of each neighbourhood spread."""
    size, axes = np.empty(3), np.empty((3, 3))
    count = near.shape[1]
    for i in range(len(near)):
        xx = xy = xz = yy = yz = zz = 0.0
        for j in near[i]:
            x, y, z = normals[j, 0], normals[j, 1], normals[j, 2]
            xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
            yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
        axes_of(xx / count, xy / count, xz / count, yy / count, yz / count, zz / count, size, axes)
        ways[i] = axes[0]
        runs_on[i] = size[0] < _STEADY and size[1] > _BENT


def _peaks(directions: Float32) -> list[Float32]:
    """(3,) each, the directions that most share, most first."""
    chosen = np.random.default_rng(0).permutation(len(directions))[:_SAMPLE]
    left = directions[chosen]
    least = max(_LEAST_SHARE * len(left), 1)
    found: list[Float32] = []
    while len(left) and len(found) < _DIRECTIONS:
        some = left[:: max(1, len(left) // 1000)]
        fits = np.abs(some @ left.T) > _PEAK
        peak = some[fits.sum(axis=1).argmax()]
        mine = np.abs(left @ peak) > _PEAK
        if mine.sum() < least:
            break
        found.append(np.linalg.eigh(left[mine].T @ left[mine])[1][:, 2])
        left = left[np.abs(left @ found[-1]) < _APART]
    return found


def _fitted(points: Float32, normals: Float32, way: Float32, smoothing: Smoothing) -> TangentPlanes:
    """Tangent planes along a direction, from points in a space that is compressed in it."""
    lost = ((1 - 1 / _COMPRESSED) * (points @ way))[:, None] * way
    thin = points - lost
    found = tangent.tangent_planes(thin, _FIRST, _WIDE)
    found = found - (found @ way)[:, None] * way
    length = np.linalg.norm(found, axis=1, keepdims=True)
    found /= np.maximum(length, 1e-6)
    found *= np.sign(np.einsum("ij,ij->i", found, normals))[:, None]
    found = np.where(length > _FLATTEST, found, normals)
    nobody, black = np.full(len(thin), -1, np.int16), np.zeros((len(thin), 3), np.uint8)
    cloud = PointCloud(np.zeros(3), thin, black, nobody)
    fitted = tangent_planes(OrientedCloud(cloud, found, np.empty((0, 3))), smoothing)
    return replace(fitted, points=fitted.points + lost)
