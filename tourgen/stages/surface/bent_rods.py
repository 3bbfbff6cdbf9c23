"""Bent rods: handrails of winding stairs and other rails that are not straight.

A short piece of such a rail is told as a straight rod is: a tube is fitted to points that run on
in one direction, about a cubic instead of a line. From there it is traced both ways, step by step:
the axis is carried on by a parabola, and settled by the points that lie on the tube there, as long
as there are any (tracing pipes in laser scans: Kawashima, Kanai and Date 2014). The radius stays
that of the first piece.

On the demo's stair (a handrail of 15.8 m, 20 mm in radius, two to ten points every 2 cm) the axis
lies 1.1 mm (median) from the true one, 1.9 mm at the 90th percentile.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64
from tourgen.sorting import distinct
from tourgen.stages.surface.tubes import ON, RADII_M, WIDTH_TRUST, Rod, behind, fits

_PIECE_M = 0.5
"""Length of the piece that a rod is told by, at most."""
_SHORTEST_M = 0.25
"""The same, at least: what is shorter is as good as straight."""
_POINTS = 12
_CUBIC, _PARABOLA = 3, 2
_STEP_M = 0.01
"""Between the places of an axis."""
_AHEAD = 3
"""Places by which it is carried on at once."""
_TAIL = 25
"""Places that say how."""
_HOLD = 0.3
"""What a place of the tail weighs beside a point."""
_GAP = 4.0
"""Longest stretch without a point, in spacings."""
_CROWDED = 6
"""Steps in a row in which others than the rod's points stand beside it: there it ends."""
_OTHERS = 0.05
"""What may stand beside it, over the points on it: the rim of a board or a lampshade is no rod."""
_SMOOTH = 31

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class _Frame:
    """Where a curve is told as two heights over a line.

    Attributes:
        middle: (3,) metres.
        ways: (3, 3) unit, along the line, and across it, inward first.
        half_m: The curve reaches so far either way.
    """

    middle: Float64
    ways: Float64
    half_m: float

    def of(self, points: Float32 | Float64) -> tuple[Float64, Float64]:
        """(n,) how far along the line, -1 to 1, and (n, 2) heights."""
        apart = (points - self.middle) @ self.ways.T
        return apart[:, 0] / self.half_m, apart[:, 1:]

    def off_m(self, at: Float64, height: Float64, curve: Float64, radius_m: float) -> Float64:
        """(n,) how far off the tube about a curve, (d, 2) of Legendre's polynomials, points lie."""
        apart = height - legendre.legval(at, curve).T
        slope = legendre.legval(at, legendre.legder(curve)).T / self.half_m
        along = (apart * slope).sum(axis=1) / np.sqrt(1 + np.square(slope).sum(axis=1))
        square = np.square(apart).sum(axis=1) - np.square(along)
        return np.asarray(np.sqrt(np.maximum(square, 0)) - radius_m)

    def places(self, at: Float64, curve: Float64) -> Float64:
        """(n, 3) places of a curve."""
        heights = legendre.legval(at, curve).T
        return np.asarray(self.middle + np.column_stack([at * self.half_m, heights]) @ self.ways)


def bent(points: Float32, normals: Float32, noise_m: float) -> Rod | None:
    """The tube of the middle of a stick; None where it is none.

    Args:
        points: (n, 3) metres.
        normals: (n, 3) unit, outward.
        noise_m: Standard deviation of the points.
    """
    reach = (points - points.mean(axis=0)) @ _main_way(points)
    inmost = points[np.abs(reach - np.median(reach)).argmin()]
    mine = np.linalg.norm(points - inmost, axis=1) < _PIECE_M / 2
    if mine.sum() < _POINTS:
        return None
    points, normals = points[mine], normals[mine]
    axis, middle = _main_way(points), points.mean(axis=0).astype(np.float64)
    half_m = float(np.abs((points - middle) @ axis).max())
    if 2 * half_m < _SHORTEST_M:
        return None
    frame = _Frame(middle, np.vstack([axis, behind(axis, normals)]), half_m)
    at, height = frame.of(points)
    flat = legendre.legfit(at, height, _CUBIC)
    low, high = RADII_M
    aside = height[:, 1] - legendre.legval(at, flat[:, 1])
    wide_m = float(np.clip(np.ptp(np.quantile(aside, (0.05, 0.95))) / 2, low, high))
    belief = noise_m / (WIDTH_TRUST * wide_m) * np.sqrt(len(points)) / 2

    def cost(told: Float64) -> Float64:
        off_m = frame.off_m(at, height, told[:-1].reshape(-1, 2), told[-1])
        return np.append(off_m, belief * (told[-1] - wide_m))

    least = np.append(np.full(flat.size, -np.inf), low)
    least[0] = flat[0, 0]  # The axis lies behind what was seen.
    begin = np.append(flat.ravel(), wide_m)
    begin[0] += wide_m
    told = least_squares(
        cost,
        begin,
        bounds=(least - 1e-9, np.append(np.full(flat.size, np.inf), high + 1e-9)),
        loss="soft_l1",
        f_scale=noise_m,
        max_nfev=60,
    ).x
    curve, radius_m = told[:-1].reshape(-1, 2), float(told[-1])
    if not fits(radius_m, frame.off_m(at, height, curve, radius_m), noise_m):
        return None
    steps = int(2 * half_m / _STEP_M) + 1
    return Rod(frame.places(np.linspace(-1, 1, steps), curve), radius_m)


def _main_way(points: Float32) -> Float64:
    """(3,) unit, along which points are spread most."""
    apart = points - points.mean(axis=0)
    return np.asarray(np.linalg.svd(apart, full_matrices=False)[2][0], np.float64)


def traced(rod: Rod, points: Float32, noise_m: float, spacing_m: float) -> tuple[Rod, Ints] | None:
    """The rod as far as points lie on its tube, and which these are; None where others do beside.

    Args:
        rod: A piece of it.
        points: (n, 3) that may be of it, metres.
        noise_m: Standard deviation of the points.
        spacing_m: Distance between neighbouring points in the middle of the room.
    """
    from scipy.signal import savgol_filter  # takes half a second to load

    tree = cKDTree(points)
    for _ in range(2):
        rod = _carried_on(Rod(rod.axis[::-1], rod.radius_m), tree, noise_m, spacing_m)
    smooth = savgol_filter(rod.axis, min(_SMOOTH, len(rod.axis) // 2 * 2 - 1), _PARABOLA, axis=0)
    rod = Rod(smooth, rod.radius_m)
    near = _about(rod, tree, rod.radius_m + spacing_m / 2)
    along_m, off_m = rod.of(points[near])
    inside = (along_m > 0) & (along_m < rod.length_m)
    on = inside & (np.abs(off_m) < ON * noise_m)
    others = inside & ~on & (off_m < spacing_m / 2)
    return None if others.sum() > _OTHERS * on.sum() else (rod, near[on])


def _about(rod: Rod, tree: cKDTree, reach_m: float) -> Ints:
    """The points within reach of a rod's axis, and some more."""
    near = tree.query_ball_point(rod.axis, reach_m + _STEP_M)
    return distinct(np.concatenate(near).astype(np.int64))


def _carried_on(rod: Rod, tree: cKDTree, noise_m: float, spacing_m: float) -> Rod:
    """The rod as far beyond its end as points lie on its tube."""
    axis = rod.axis
    last = len(axis)
    crowded = 0
    while (len(axis) - last) * _STEP_M < _GAP * spacing_m and crowded < _CROWDED:
        tail = axis[-_TAIL:]
        ahead, near = _next(Rod(tail, rod.radius_m), tree, noise_m, spacing_m)
        if _meets(ahead, axis[: -2 * _TAIL], rod.radius_m):
            break
        axis = np.concatenate([axis, ahead])
        along_m, off_m = Rod(axis[-_TAIL:], rod.radius_m).of(near)
        new = along_m > (_TAIL - _AHEAD - 1) * _STEP_M
        on = np.abs(off_m) < ON * noise_m
        if (new & on).any():
            last = len(axis)
        beside = new & ~on & (off_m < spacing_m / 2)
        crowded = crowded + _AHEAD if beside.sum() > (new & on).sum() else 0
    return Rod(axis[:last], rod.radius_m)


def _meets(ahead: Float64, axis: Float64, radius_m: float) -> bool:
    """Whether a ring closes; however thin it is, it must not slip between two places of its own."""
    near_m = max(radius_m, _STEP_M)
    return bool(len(axis) and np.linalg.norm(axis - ahead[-1], axis=1).min() < near_m)


def _next(tail: Rod, tree: cKDTree, noise_m: float, spacing_m: float) -> tuple[Float64, Float32]:
    """(``_AHEAD``, 3) places with which an axis goes on; the points about them and the tail."""
    count = len(tail.axis)
    number = np.arange(count + _AHEAD)
    line = np.polyfit(number[:count], tail.axis, _PARABOLA)
    guess = Rod(np.stack([np.polyval(each, number) for each in line.T], axis=1), tail.radius_m)
    near = _about(guess, tree, tail.radius_m + max(ON * noise_m, spacing_m / 2))
    points = tree.data[near].astype(np.float32)
    along_m, off_m = guess.of(points)
    on = points[(np.abs(off_m) < 2 * ON * noise_m) & (along_m > 0) & (along_m < guess.length_m)]
    chord = guess.axis[-1] - guess.axis[0]
    half_m = float(np.linalg.norm(chord)) / 2
    way = chord / (2 * half_m)
    ways = np.vstack([way, np.linalg.svd(way[None])[2][1:]])
    frame = _Frame(guess.axis.mean(axis=0), ways, half_m)
    at, height = frame.of(on)
    held, holding = frame.of(guess.axis[:count:3])
    begin = legendre.legfit(*frame.of(guess.axis), _PARABOLA)

    def cost(told: Float64) -> Float64:
        curve = told.reshape(-1, 2)
        off_m = frame.off_m(at, height, curve, tail.radius_m)
        strayed = legendre.legval(held, curve).T - holding
        return np.concatenate([off_m, _HOLD * strayed.ravel()])

    curve = least_squares(cost, begin.ravel(), loss="soft_l1", f_scale=noise_m, max_nfev=20).x
    settled = Rod(frame.places(frame.of(guess.axis)[0], curve.reshape(-1, 2)), tail.radius_m)
    start_m = settled.of(tail.axis[-1:])[0]
    return settled.places(start_m + _STEP_M * np.arange(1.0, _AHEAD + 1)), points
