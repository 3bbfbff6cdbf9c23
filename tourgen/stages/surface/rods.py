"""Rods: rails, bars and legs so thin that a point or two lie across them are drawn as tubes.

A rail of 20 mm seen from two sides by beams 12 mm apart leaves rows of points without neighbours
across, from which no tangent plane follows; its back has none at all, and cells as wide as the
spacing could not draw it. What is known is its shape: points that lie on no flat and run on in one
direction are put together to sticks, a cylinder is fitted to each, axis and radius, by least
squares on the distance to it (Lukács, Martin and Marshall 1998; with a soft loss, since a stick's
ends touch what it stands on), and goes on as far as points lie on it. A stick is a rod where its
points lie on the cylinder within the noise, all along it, and nothing else stands beside it: a
moulding is none.

On the demo's rails (radius 10 mm, one to three points a centimetre, noise 1.3 mm) the cylinders lie
0.5 mm (median) from the truth. Tangent planes all around the cylinder instead of a tube: cells of
12 mm drew it 2 mm off, 9 mm at the 90th percentile. Fitted to the smoothed points: these are a
ribbon, of any radius. Without the width as a belief: a rail seen from one side alone is flat. With
the axis free to lie on either side: that of a short arc came out before what was seen, 6 mm off.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64, Mesh
from tourgen.stages.mesh_arrays import components
from tourgen.stages.surface.tangent_planes import TangentPlanes

_REACH = 4.0
"""How far around a point its direction is taken from, in spacings."""
_NEIGHBOURS = 24
_LEAST = 5
_THIN = 0.5
"""Spread across over spread along of the points around, at most."""
_ALONG = np.cos(np.radians(25.0))
_ASIDE_M = 0.03
"""A point farther off the line through another one is of another stick."""
_RADII_M = (0.005, 0.025)
"""The thinnest and the thickest rod."""
_STARTS_M = (0.006, 0.012, 0.020)
"""Where the search for the radius begins."""
_FREE = 1.1
"""A radius as near to the thinnest or the thickest is none that the points ask for."""
_LENGTH_M = 0.10
_POINTS = 12
_MEMBERS = 0.7
"""The part of a stick's points that must lie on its cylinder."""
_WIDTH = (0.05, 0.95)
"""Quantiles of the points sideways: half of what lies between is about the radius."""
_WIDTH_TRUST = 0.5
"""By what part that may be wrong."""
_CROWDED, _HOPELESS = 0.35, 0.6
"""The part of its length along which a rod may pass other points, and a stick before the fit."""
_ON = 3.0
"""How far off its cylinder a point of a rod may lie, in deviations."""
_OFF = 1.6
"""The same, root mean square over all."""
_GAP = 6.0
"""Longest stretch without a point, in spacings."""
_AROUND = 16

Mask = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Rod:
    """A cylinder.

    Attributes:
        start: (3,) one end of its axis, metres.
        along: (3,) unit.
        length_m: Of the axis.
        radius_m: Of it.
    """

    start: Float64
    along: Float64
    length_m: float
    radius_m: float

    def off_m(self, points: Float32 | Float64) -> Float64:
        """How far off the endless cylinder each of (n, 3) points lies."""
        apart = points - self.start
        beside = apart - np.outer(apart @ self.along, self.along)
        return np.asarray(np.linalg.norm(beside, axis=1) - self.radius_m)


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
    at = np.flatnonzero(rest)
    tree = cKDTree(raw)
    taken = np.zeros(len(raw), bool)
    found = []
    for stick in sorted(_sticks(raw[at], spacing_m), key=len, reverse=True):
        own = at[stick]
        own = own[~taken[own]]
        if len(own) < _POINTS or (_crowding(_outline(raw[own]), tree, own, spacing_m) > _HOPELESS):
            continue
        rod = _fitted(raw[own], planes.normals[own], planes.noise_m, spacing_m)
        if rod is None:
            continue
        rod, on = _lengthened(rod, raw[at], planes.noise_m, spacing_m)
        members = at[on]
        if _crowding(rod, tree, members, spacing_m) < _CROWDED:
            found.append(rod)
            taken[members] = True
            taken[at[_beside(rod, raw[at], spacing_m)]] = True
    return tuple(found), taken


def with_tubes(mesh: Mesh, found: tuple[Rod, ...], step_m: float) -> Mesh:
    """A mesh, and rods as closed tubes beside it.

    Args:
        mesh: Faces counter-clockwise seen from the free space.
        found: Metres from the mesh's origin.
        step_m: Length of a tube's faces.
    """
    tubes = [_tube(rod, step_m) for rod in found]
    counts = np.cumsum([len(mesh.vertices)] + [len(vertices) for vertices, _ in tubes])
    return Mesh(
        mesh.origin,
        np.concatenate([mesh.vertices, *(vertices for vertices, _ in tubes)]),
        np.concatenate(
            [mesh.faces]
            + [faces + np.int32(k) for (_, faces), k in zip(tubes, counts, strict=False)]
        ),
    )


def _sticks(points: Float32, spacing_m: float) -> Iterator[Ints]:
    """Points that run on in one direction, (k,) each."""
    if len(points) <= _LEAST:
        return
    rank = np.arange(2, _NEIGHBOURS + 2)
    distance, near = cKDTree(points).query(
        points, k=rank, distance_upper_bound=_REACH * spacing_m, workers=-1
    )
    there = np.isfinite(distance)
    offset = points[np.where(there, near, 0)] - points[:, None]
    offset[~there] = 0
    count = there.sum(axis=1)
    apart = offset - (offset.sum(axis=1) / np.maximum(count, 1)[:, None])[:, None]
    apart[~there] = 0
    spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", apart, apart))
    spread = np.sqrt(np.maximum(spread, 0))
    thin = (count >= _LEAST) & (spread[:, 1] < _THIN * spread[:, 2])
    along = axes[:, :, 2].astype(np.float32)
    first = np.repeat(np.arange(len(points)), there.shape[1])[there.ravel()]
    second = np.asarray(near)[there]
    aside = np.linalg.norm(np.cross(offset[there], along[first]), axis=1)
    alike = np.abs(np.einsum("ij,ij->i", along[first], along[second])) > _ALONG
    joined = alike & (aside < _ASIDE_M) & thin[first] & thin[second]
    stick = components(np.stack([first[joined], second[joined]], axis=1), len(points))
    order = np.argsort(stick, kind="stable")
    for own in np.split(order, np.flatnonzero(np.diff(stick[order])) + 1):
        if len(own) >= _POINTS:
            yield own


def _fitted(points: Float32, normals: Float32, noise_m: float, spacing_m: float) -> Rod | None:
    """The cylinder of a stick; None where it is no rod."""
    middle = points.mean(axis=0).astype(np.float64)
    apart = points - middle
    axis = np.linalg.svd(apart, full_matrices=False)[2][0].astype(np.float64)
    if np.ptp(apart @ axis) < _LENGTH_M:
        return None
    across = np.linalg.svd(axis[None])[2][1:]
    inward = -(normals.mean(axis=0) @ across.T)
    inward /= max(float(np.linalg.norm(inward)), 1e-9)
    across = np.array([inward, (-inward[1], inward[0])]) @ across
    low, high = _RADII_M
    wide_m = float(np.clip(np.ptp(np.quantile(apart @ across[1], _WIDTH)) / 2, low, high))
    belief = noise_m / (_WIDTH_TRUST * wide_m) * np.sqrt(len(points)) / 2

    def cylinder(told: Float64) -> Rod:
        way = axis + told[2:4] @ across
        centre = middle + told[:2] @ across
        return Rod(centre, way / np.linalg.norm(way), 0.0, float(told[4]))

    def cost(told: Float64) -> Float64:
        return np.append(cylinder(told).off_m(points), belief * (told[4] - wide_m))

    tried = [
        least_squares(
            cost,
            np.array([radius, 0, 0, 0, radius]),
            # The axis lies behind what was seen: noise makes a short arc look hollow.
            bounds=([0, -0.1, -1, -1, low], [0.1, 0.1, 1, 1, high]),
            loss="soft_l1",
            f_scale=noise_m,
            max_nfev=60,
        )
        for radius in _STARTS_M
    ]
    rod = cylinder(min(tried, key=lambda each: float(each.cost)).x)
    off = rod.off_m(points)
    on = np.abs(off) < _ON * noise_m
    sound = (
        low * _FREE < rod.radius_m < high / _FREE
        and on.sum() >= max(_POINTS, _MEMBERS * len(points))
        and np.sqrt(np.square(off[on]).mean()) < _OFF * noise_m
    )
    return _between(rod, points[on], spacing_m) if sound else None


def _between(rod: Rod, points: Float32, spacing_m: float) -> Rod | None:
    """The rod from the first of its points to the last; None where too long a stretch has none."""
    reach = np.sort((points - rod.start) @ rod.along)
    length_m = float(reach[-1] - reach[0])
    if length_m < max(_LENGTH_M, 4 * rod.radius_m) or np.diff(reach).max() > _GAP * spacing_m:
        return None
    # The last point lies up to a spacing before the end.
    start = rod.start + (reach[0] - spacing_m / 2) * rod.along
    return Rod(start, rod.along, length_m + spacing_m, rod.radius_m)


def _lengthened(rod: Rod, points: Float32, noise_m: float, spacing_m: float) -> tuple[Rod, Ints]:
    """The rod as far as points lie on its cylinder, and which these are."""
    on = np.flatnonzero(np.abs(rod.off_m(points)) < _ON * noise_m)
    reach = (points[on] - rod.start) @ rod.along
    order = np.argsort(reach)
    on, reach = on[order], reach[order]
    run = np.concatenate([[0], np.cumsum(np.diff(reach) > _GAP / 2 * spacing_m)])
    inside = (reach > 0) & (reach < rod.length_m)
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
    start = points.mean(axis=0) + reach.min() * along
    return Rod(start, along, float(np.ptp(reach)), _RADII_M[0])


def _crowding(rod: Rod, tree: cKDTree, members: Ints, spacing_m: float) -> float:
    """The part of a rod's length along which others than its own points stand beside it."""
    steps = np.arange(0, rod.length_m, spacing_m)
    places = rod.start + steps[:, None] * rod.along
    if not len(places):
        return 1.0
    own = set(members.tolist())
    beside = tree.query_ball_point(places, rod.radius_m + spacing_m / 2)
    others = [bool(set(np.atleast_1d(each).tolist()) - own) for each in beside]
    return float(np.mean(others))


def _beside(rod: Rod, points: Float32, near_m: float) -> Mask:
    """Which of the points lie no farther off a rod: what is on no flat there was mixed of both."""
    reach = (points - rod.start) @ rod.along
    return np.asarray((rod.off_m(points) < near_m) & (reach > 0) & (reach < rod.length_m))


def _tube(rod: Rod, step_m: float) -> tuple[Float32, npt.NDArray[np.int32]]:
    """Vertices and faces of a closed tube."""
    across = np.linalg.svd(rod.along[None])[2][1:]
    if np.linalg.det(np.vstack([across, rod.along])) < 0:
        across = across[::-1]
    angle = np.arange(_AROUND) * (2 * np.pi / _AROUND)
    circle = rod.radius_m * np.stack([np.cos(angle), np.sin(angle)], axis=1) @ across
    rings = max(2, int(np.ceil(rod.length_m / step_m)) + 1)
    centre = rod.start + np.linspace(0, rod.length_m, rings)[:, None] * rod.along
    vertices = np.concatenate([(centre[:, None] + circle).reshape(-1, 3), centre[[0, -1]]])
    low = np.arange(_AROUND)
    high = np.roll(low, -1)
    wall = np.concatenate(
        [np.stack([low, high, high + _AROUND]), np.stack([low, high + _AROUND, low + _AROUND])], 1
    ).T
    walls = (wall[None] + _AROUND * np.arange(rings - 1)[:, None, None]).reshape(-1, 3)
    bottom, top = rings * _AROUND, rings * _AROUND + 1
    last = (rings - 1) * _AROUND
    caps = np.concatenate(
        [
            np.stack([high, low, np.full(_AROUND, bottom)], axis=1),
            np.stack([last + low, last + high, np.full(_AROUND, top)], axis=1),
        ]
    )
    return vertices.astype(np.float32), np.concatenate([walls, caps]).astype(np.int32)
