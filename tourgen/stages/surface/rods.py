"""Rods: rails, bars and legs so thin that a point or two lie across them are drawn as tubes.

A rail of 20 mm seen from two sides by beams 12 mm apart leaves rows of points without neighbours
across, from which no tangent plane follows; its back has none at all, and cells as wide as the
spacing could not draw it. What is known is its shape: points that lie on no flat and run on in one
direction are put together to sticks, a cylinder is fitted to each, axis and radius, by least
squares on the distance to it (Lukács, Martin and Marshall 1998; with a soft loss, since a stick's
ends touch what it stands on), and goes on as far as points lie on it. A stick is a rod where its
points lie on the cylinder within the noise, all along it, and nothing else stands beside it: a
moulding is none. What bends is traced (``bent_rods``).

On the demo's rails (radius 10 mm, one to three points a centimetre, noise 1.3 mm) the cylinders lie
0.5 mm (median) from the truth. Tangent planes all around the cylinder instead of a tube: cells of
12 mm drew it 2 mm off, 9 mm at the 90th percentile. Fitted to the smoothed points: these are a
ribbon, of any radius. Without the width as a belief: a rail seen from one side alone is flat. With
the axis free to lie on either side: that of a short arc came out before what was seen, 6 mm off.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Float64, Int32
from tourgen.neighbours import Neighbours
from tourgen.stages.mesh_arrays import components
from tourgen.stages.surface.bent_rods import bent, traced
from tourgen.stages.surface.tangent_planes import TangentPlanes
from tourgen.stages.surface.tubes import ON, RADII_M, WIDTH_TRUST, Rod, behind, fits
from tourgen.symmetric import axes_of
from tourgen.voxels import voxel_groups

_REACH = 4.0
"""How far around a point its direction is taken from, in spacings."""
_NEIGHBOURS = 24
_LEAST = 5
_THIN = 0.5
"""Spread across over spread along of the points around, at most."""
_ALONG = np.cos(np.radians(25.0))
_ASIDE_M = 0.03
"""A point farther off the line through another one is of another stick."""
_STARTS_M = (0.006, 0.012, 0.020)
"""Where the search for the radius begins."""
_LENGTH_M = 0.10
_POINTS = 12
_WIDTH = (0.05, 0.95)
"""Quantiles of the points sideways: half of what lies between is about the radius."""
_CROWDED, _HOPELESS = 0.35, 0.6
"""The part of its length along which a rod may pass other points, and a stick before the fit."""
_STRAYS = 0.1
"""The part of the points at one place that may be others, and do not crowd it."""
_APART_M = 0.022
"""How far apart points are taken where they lie closer than half of it: on a leg of 32 mm, points
4 mm apart are spread as much across as along."""
_GAP = 9.0
"""Longest stretch without a point, in spacings."""
_FLANK, _FLANK_M = 2.0, 0.08
"""How far aside a row of points on a surface has others on it, in the spacing of these; at most."""
_FLANK_STEP_M = 0.04

Mask = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]


def rods(
    planes: TangentPlanes, raw: Float32, rest: Mask, spacing_m: float
) -> tuple[tuple[Rod, ...], Mask]:
    """Find the rods.

    Args:
        planes: n tangent planes.
        raw: (n, 3) the points that they were fitted to, metres: those of a rod have been smoothed
            into a ribbon.
        rest: (n,) which of them may be of one: they lie on no flat, or on a mere strip.
        spacing_m: Distance between neighbouring points in the middle of the room.

    Returns:
        The rods, and the mask of the points that are theirs.
    """
    tree = cKDTree(raw, compact_nodes=False, balanced_tree=False)  # asked for a few places only
    if spacing_m > _APART_M / 2:
        return _rods(planes, raw, rest, tree, spacing_m)
    return _of_dense(planes, raw, rest, tree)


def _of_dense(
    planes: TangentPlanes, raw: Float32, rest: Mask, tree: cKDTree
) -> tuple[tuple[Rod, ...], Mask]:
    """The same where points lie close: looked for among some of them, fitted to all."""
    order, starts = voxel_groups(raw, _APART_M)
    some = np.sort(order[starts])
    told, _ = _rods(planes.take(some), raw[some], rest[some], cKDTree(raw[some]), _APART_M)
    taken = np.zeros(len(raw), bool)
    found = []
    for rough in told:
        at = np.flatnonzero(rest & ~taken)
        own = at[_beside(rough, raw[at], _APART_M / 4)]
        rod = _fitted(raw[own], planes.normals[own], planes.noise_m, _APART_M) or rough
        on = taken.copy()
        on[at[np.abs(rod.of(raw[at])[1]) < ON * planes.noise_m]] = True
        if _crowding(rod, tree, on, _APART_M) < _CROWDED:
            found.append(rod)
            taken[at[_beside(rod, raw[at], ON * planes.noise_m)]] = True
    return tuple(found), taken


def _rods(
    planes: TangentPlanes, raw: Float32, rest: Mask, tree: cKDTree, spacing_m: float
) -> tuple[tuple[Rod, ...], Mask]:
    """The rods that points so far apart tell, and which are theirs; ``tree`` holds the points."""
    at = np.flatnonzero(rest)
    points = raw[at]
    taken = np.zeros(len(raw), bool)

    def crowding(rod: Rod, members: Ints) -> float:
        of_rods = taken.copy()
        of_rods[members] = True
        return _crowding(rod, tree, of_rods, spacing_m)

    rods_found = []
    for stick in sorted(_sticks(points, spacing_m), key=len, reverse=True):
        own = at[stick]
        own = own[~taken[own]]
        if len(own) < _POINTS or crowding(_outline(raw[own]), own) > _HOPELESS:
            continue
        if _is_flanked(planes, raw, own, tree):
            continue
        rod = _fitted(raw[own], planes.normals[own], planes.noise_m, spacing_m)
        if rod:
            rod, on = _lengthened(rod, points, planes.noise_m, spacing_m)
            found: tuple[Rod, Ints] | None = (rod, at[on])
        else:
            found = _bent(planes, raw, at[~taken[at]], own, spacing_m)
        if found and crowding(*found) < _CROWDED:
            rod, members = found
            rods_found.append(rod)
            taken[members] = True
            taken[at[_beside(rod, points, spacing_m)]] = True
    return tuple(rods_found), taken


def _bent(
    planes: TangentPlanes, raw: Float32, at: Ints, own: Ints, spacing_m: float
) -> tuple[Rod, Ints] | None:
    """The bent rod that a stick is a piece of, and which points, of some, are on it."""
    piece = bent(raw[own], planes.normals[own], planes.noise_m)
    found = piece and traced(piece, raw[at], planes.noise_m, spacing_m)
    return (found[0], at[found[1]]) if found else None


def _sticks(points: Float32, spacing_m: float) -> Iterator[Ints]:
    """Points that run on in one direction, (k,) each."""
    if len(points) <= _LEAST:
        return
    count = min(_NEIGHBOURS + 1, len(points))
    near = Neighbours.of(points, count).nearest(points, count, _REACH * spacing_m)[0][:, 1:]
    along, thin = _ways(points, near)
    stick = components(_joined(points, near, along, thin), len(points))
    of_many = np.flatnonzero((np.bincount(stick) >= _POINTS)[stick])
    order = of_many[np.argsort(stick[of_many], kind="stable")]
    if len(order):
        yield from np.split(order, np.flatnonzero(np.diff(stick[order])) + 1)


@compiled
def _ways(points: Float32, near: Int32) -> tuple[Float32, Mask]:
    """(n, 3) the way in which the points around each are spread, and (n,) whether in it alone."""
    along, thin = np.zeros((len(points), 3), np.float32), np.zeros(len(points), np.bool_)
    size, axes = np.empty(3), np.empty((3, 3))
    for i in range(len(points)):
        x = y = z = xx = xy = xz = yy = yz = zz = 0.0
        count = 0
        for j in near[i]:
            if j < 0:
                break
            a, b, c = (
                points[j, 0] - points[i, 0],
                points[j, 1] - points[i, 1],
                points[j, 2] - points[i, 2],
            )
            x, y, z = x + a, y + b, z + c
            xx, xy, xz = xx + a * a, xy + a * b, xz + a * c
            yy, yz, zz = yy + b * b, yz + b * c, zz + c * c
            count += 1
        if count < _LEAST:
            continue
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
        along[i] = axes[2]
        thin[i] = max(size[1], 0.0) < _THIN**2 * size[2]
    return along, thin


@compiled
def _joined(points: Float32, near: Int32, along: Float32, thin: Mask) -> Ints:
    """(p, 2) neighbours that run on in each other's direction."""
    pairs = np.empty((near.size, 2), np.int64)
    found = 0
    for i in np.flatnonzero(thin):
        for j in near[i]:
            if j < 0 or not thin[j]:
                continue
            x, y, z = (
                points[j, 0] - points[i, 0],
                points[j, 1] - points[i, 1],
                points[j, 2] - points[i, 2],
            )
            a, b, c = along[i, 0], along[i, 1], along[i, 2]
            aside = (y * c - z * b) ** 2 + (z * a - x * c) ** 2 + (x * b - y * a) ** 2
            alike = abs(a * along[j, 0] + b * along[j, 1] + c * along[j, 2])
            if aside < _ASIDE_M**2 and alike > _ALONG:
                pairs[found, 0], pairs[found, 1] = i, j
                found += 1
    return pairs[:found]


def _fitted(points: Float32, normals: Float32, noise_m: float, spacing_m: float) -> Rod | None:
    """The cylinder of a stick; None where it is no rod."""
    middle = points.mean(axis=0).astype(np.float64)
    apart = points - middle
    axis = np.linalg.svd(apart, full_matrices=False)[2][0].astype(np.float64)
    if np.ptp(apart @ axis) < _LENGTH_M:
        return None
    across = behind(axis, normals)
    low, high = RADII_M
    wide_m = float(np.clip(np.ptp(np.quantile(apart @ across[1], _WIDTH)) / 2, low, high))
    belief = noise_m / (WIDTH_TRUST * wide_m) * np.sqrt(len(points)) / 2

    def line(told: Float64) -> tuple[Float64, Float64]:
        way = axis + told[2:4] @ across
        return middle + told[:2] @ across, way / np.linalg.norm(way)

    def cost(told: Float64) -> Float64:
        return np.append(_off_m(points, *line(told), told[4]), belief * (told[4] - wide_m))

    def slopes(told: Float64) -> Float64:
        start, along = line(told)
        apart = points - start
        reach = apart @ along
        away = apart - np.outer(reach, along)
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
        shifted = -away @ across.T
        turned = shifted * (reach / np.linalg.norm(axis + told[2:4] @ across))[:, None]
        by_point = np.column_stack([shifted, turned, np.full(len(points), -1.0)])
        return np.vstack([by_point, [0, 0, 0, 0, belief]])

    tried = [
        least_squares(
            cost,
            np.array([radius, 0, 0, 0, radius]),
            slopes,
            # The axis lies behind what was seen: noise makes a short arc look hollow.
            bounds=([0, -0.1, -1, -1, low], [0.1, 0.1, 1, 1, high]),
            loss="soft_l1",
            f_scale=noise_m,
            max_nfev=60,
        )
        for radius in _STARTS_M
    ]
    told = min(tried, key=lambda each: float(each.cost)).x
    start, along = line(told)
    rod = Rod(np.stack([start, start + along]), float(told[4]))
    _, off = rod.of(points)
    on = np.abs(off) < ON * noise_m
    sound = on.sum() >= _POINTS and fits(rod.radius_m, off, noise_m)
    return _between(rod, points[on], spacing_m) if sound else None


def _off_m(points: Float32, start: Float64, along: Float64, radius_m: float) -> Float64:
    """How far off an endless cylinder each of (n, 3) points lies."""
    apart = points - start
    beside = apart - np.outer(apart @ along, along)
    return np.asarray(np.linalg.norm(beside, axis=1) - radius_m)


def _between(rod: Rod, points: Float32, spacing_m: float) -> Rod | None:
    """The rod from the first of its points to the last; None where too long a stretch has none."""
    reach = np.sort(rod.of(points)[0])
    length_m = float(reach[-1] - reach[0])
    if length_m < max(_LENGTH_M, 4 * rod.radius_m) or np.diff(reach).max() > _GAP * spacing_m:
        return None
    # The last point lies up to a spacing before the end.
    return rod.cut(reach[0] - spacing_m / 2, reach[-1] + spacing_m / 2)


def _lengthened(rod: Rod, points: Float32, noise_m: float, spacing_m: float) -> tuple[Rod, Ints]:
    """The rod as far as points lie on its cylinder, and which these are."""
    reach, off = rod.of(points)
    on = np.flatnonzero(np.abs(off) < ON * noise_m)
    on = on[np.argsort(reach[on])]
    run = np.concatenate([[0], np.cumsum(np.diff(reach[on]) > _GAP / 2 * spacing_m)])
    inside = (reach[on] > 0) & (reach[on] < rod.length_m)
    mine = run == np.bincount(run[inside]).argmax()
    longer = _between(rod, points[on[mine]], spacing_m)
    if longer is None or longer.length_m < rod.length_m:
        return rod, on[inside]
    return longer, on[mine]


def _outline(points: Float32) -> Rod:
    """A stick as thin as can be."""
    apart = points - points.mean(axis=0)
    along = np.linalg.svd(apart, full_matrices=False)[2][0].astype(np.float64)
    reach = apart @ along
    ends = np.array([reach.min(), reach.max()])
    return Rod(points.mean(axis=0) + ends[:, None] * along, RADII_M[0])


def _crowding(rod: Rod, tree: cKDTree, of_rods: Mask, spacing_m: float) -> float:
    """The part of a rod's length along which others than points of rods stand beside it."""
    steps = np.arange(0, rod.length_m, spacing_m)
    if not len(steps):
        return 1.0
    beside = tree.query_ball_point(rod.places(steps), rod.radius_m + spacing_m / 2)
    crowded = [(~of_rods[each]).sum() > _STRAYS * np.size(each) for each in beside]
    return float(np.mean(crowded))


def _is_flanked(planes: TangentPlanes, raw: Float32, own: Ints, tree: cKDTree) -> bool:
    """Whether along most of a stick others lie on both sides of it, on one surface with it.

    Then it is a row of beams that fell on a wall where all others lie far apart: on a board that a
    station sees at a grazing angle, 2 m long and 20 mm from the next row, it came out as a tube.
    """
    middle = raw[own].mean(axis=0)
    along = np.linalg.svd(raw[own] - middle, full_matrices=False)[2][0]
    normal = planes.normals[own].mean(axis=0)
    normal -= (normal @ along) * along
    normal /= max(float(np.linalg.norm(normal)), 1e-9)
    reach = (raw[own] - middle) @ along
    steps = np.arange(reach.min(), reach.max(), _FLANK_STEP_M)
    near = tree.query_ball_point(middle + steps[:, None] * along, _FLANK_M)
    around = np.setdiff1d(np.concatenate(near).astype(np.int64), own)
    apart = raw[around] - middle
    aside = apart @ np.cross(along, normal)
    on = np.abs(apart @ normal) < ON * planes.noise_m
    on &= np.abs(aside) < _FLANK * planes.spacing_m[around]
    place = np.floor((apart @ along - reach.min()) / _FLANK_STEP_M).astype(np.int64)
    on &= (place >= 0) & (place < len(steps))
    sides = [np.bincount(place[on & (way * aside > 0)], minlength=len(steps)) for way in (1, -1)]
    return bool(np.minimum(*sides).astype(bool).mean() > _HOPELESS)


def _beside(rod: Rod, points: Float32, near_m: float) -> Mask:
    """Which of the points lie no farther off a rod: what is on no flat there was mixed of both."""
    reach, off = rod.of(points)
    return np.asarray((off < near_m) & (reach > 0) & (reach < rod.length_m))
