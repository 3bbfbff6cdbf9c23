"""Meetings: where two flats end beside each other, both go on to the line in which they meet.

Beams that fall on a crease come back from both of its sides, or from what lies behind; so the last
points on either flat lie some millimetres from it, and some centimetres where a side is seen at a
grazing angle or hardly at all. Tangent planes there are fitted across the crease, or there are
none and the surface is left to the solve: it comes out rounded, chipped or open. But the crease
itself is known as well as the two flats are. So each is sampled as far as the line wherever both
have points near it and neither goes on beyond (completing shapes from primitives: Schnabel,
Degener and Klein 2009). What lies on neither, right at the line, is what the scanner mixed of
them: it goes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_closing
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64
from tourgen.stages.surface.flats import Flats
from tourgen.stages.surface.tangent_planes import TangentPlanes

_REACH = 4.0
"""How far from the line the points of a flat may end, in spacings."""
_BEYOND = 0.8
"""A flat with points farther than this beyond the line goes on there, in spacings."""
_MIXED = 1.0
"""How far from a line what lies on neither flat may come from both, in spacings."""
_CLOSED = 3
"""Places along a line, a spacing each, that are bridged where those beside them are met."""
_LEAST = 4
"""Met places along a line, at least."""
_BLUNT = np.cos(np.radians(30.0))
"""Flats that meet at a blunter angle leave no crease."""
_CELL = 2.0
"""Edge of the cells in which flats are found to be near each other, in spacings."""
_NEIGHBOURS = 24
_FIRST = 0.25
"""Where the first sample lies from the line, in spacings."""

Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]


def met(planes: TangentPlanes, flats: Flats, spacing_m: float) -> TangentPlanes:
    """Sample flats as far as the lines in which they meet.

    Args:
        planes: n tangent planes, those of flats on them.
        flats: Which are on which.
        spacing_m: Distance between neighbouring points in the middle of the room.

    Returns:
        The planes but those between two flats that meet, and the samples after them.
    """
    rest = np.flatnonzero(flats.of < 0)
    mixed = cKDTree(planes.points[rest]) if len(rest) else None
    gone = np.zeros(len(planes.points), bool)
    points = [np.empty((0, 3))]
    of = [np.empty(0, np.int64)]
    for first, second, near in _pairs(planes.points, flats, spacing_m):
        line = _Line.between(flats, first, second)
        found = _meeting(line, planes.points[near], flats.of[near], (first, second), spacing_m)
        if found is None:
            continue
        for number, at in zip((first, second), found.samples, strict=True):
            points.append(line.start + at)
            of.append(np.full(len(at), number))
        gone[near[found.beyond]] = True
        if mixed is not None:
            close = mixed.query_ball_point(found.places + line.start, _MIXED * spacing_m)
            gone[rest[np.unique(np.concatenate([np.asarray(c, np.int64) for c in close]))]] = True
    number = np.concatenate(of)
    count = len(number)
    kept = planes.take(~gone)
    return TangentPlanes(
        np.concatenate([kept.points, np.concatenate(points).astype(np.float32)]),
        np.concatenate([kept.normals, flats.normals[number].astype(np.float32)]),
        np.concatenate([kept.spacing_m, np.full(count, spacing_m, np.float32)]),
        np.concatenate([kept.support, np.ones(count, np.float32)]),
        planes.noise_m,
    )


def _pairs(points: Float32, flats: Flats, spacing_m: float) -> Iterator[tuple[int, int, Ints]]:
    """Flats that come near each other at an angle, and the points of both that do."""
    own = np.flatnonzero(flats.of >= 0)
    if not len(own):
        return
    edge_m = _CELL * spacing_m
    cell = np.floor((points[own] - points[own].min(axis=0)) / edge_m).astype(np.int64)
    key = np.ravel_multi_index(
        (*cell.T, flats.of[own]), (*(cell.max(axis=0) + 1), len(flats.normals))
    )
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    number = flats.of[own][order[starts]]
    count = np.diff(np.append(starts, len(own)))
    middle = np.add.reduceat(points[own][order], starts) / count[:, None]
    distance, near = cKDTree(middle).query(
        middle,
        k=np.arange(2, _NEIGHBOURS + 2),
        distance_upper_bound=(_REACH + _CELL) * spacing_m,
        workers=-1,
    )
    one = np.repeat(np.arange(len(middle)), _NEIGHBOURS)[np.isfinite(distance).ravel()]
    other = near.ravel()[np.isfinite(distance).ravel()]
    low, high = np.minimum(number[one], number[other]), np.maximum(number[one], number[other])
    cosine = np.abs(np.einsum("ij,ij->i", flats.normals[low], flats.normals[high]))
    good = (cosine < _BLUNT) & ~(flats.narrow[low] & flats.narrow[high])
    one, other, pair = one[good], other[good], (low * len(flats.normals) + high)[good]
    by_pair = np.argsort(pair, kind="stable")
    for chosen in np.split(by_pair, np.flatnonzero(np.diff(pair[by_pair])) + 1):
        if len(chosen):
            cells = np.unique(np.concatenate([one[chosen], other[chosen]]))
            members = [order[starts[c] : starts[c] + count[c]] for c in cells]
            first, second = divmod(int(pair[chosen[0]]), len(flats.normals))
            yield first, second, own[np.concatenate(members)]


@dataclass(frozen=True, slots=True)
class _Line:
    """Where two planes meet.

    Attributes:
        start: (3,) a place on it.
        along: (3,) unit.
        aside: (2, 3) unit, across it, in either plane.
        facing: (2,) whether that way leads to the front of the other plane, 1 or -1.
    """

    start: Float64
    along: Float64
    aside: Float64
    facing: Float64

    @staticmethod
    def between(flats: Flats, first: int, second: int) -> _Line:
        normals = flats.normals[[first, second]]
        along = np.cross(normals[0], normals[1])
        along /= np.linalg.norm(along)
        matrix = np.vstack([normals, along])
        start = np.linalg.solve(matrix, [*flats.offsets_m[[first, second]], 0.0])
        aside = np.cross(along, normals)
        facing = np.sign([aside[0] @ normals[1], aside[1] @ normals[0]])
        return _Line(start, along, aside, facing)


@dataclass(frozen=True, slots=True)
class _Meeting:
    """Of two flats.

    Attributes:
        samples: (a, 3) and (b, 3) on either, from the line's start, metres.
        places: (m, 3) of the line where they meet, the same.
        beyond: Of the points asked for, positions of those beyond it.
    """

    samples: tuple[Float64, Float64]
    places: Float64
    beyond: Ints


def _meeting(
    line: _Line, points: Float32, of: Ints, pair: tuple[int, int], spacing_m: float
) -> _Meeting | None:
    """Where along a line two flats meet; None where nowhere."""
    apart = (points - line.start) / spacing_m
    along = apart @ line.along
    place = np.floor(along).astype(np.int64)
    low = int(place.min())
    place -= low
    length = int(place.max()) + 1
    aside = [apart @ way for way in line.aside]
    ends, sides = [], []
    for number, across in zip(pair, aside, strict=True):
        mine = (of == number) & (np.abs(across) < _REACH)
        side, end = _ended(place[mine], across[mine], length)
        sides.append(side)
        ends.append(end)
    front = [side * facing for side, facing in zip(sides, line.facing, strict=True)]
    both = (front[0] != 0) & (front[0] == front[1])
    turn = 1 if (both & (front[0] > 0)).sum() * 2 >= both.sum() else -1
    both &= front[0] == turn
    if both.sum() < _LEAST:
        return None
    wide = np.pad(both, _CLOSED)
    clear = (sides[0] * line.facing[0] != -turn) & (sides[1] * line.facing[1] != -turn)
    bridged = binary_closing(wide, np.ones(_CLOSED + 1))[_CLOSED:-_CLOSED] & (clear | both)
    at = np.flatnonzero(bridged)
    where = (at + low + 0.5)[:, None] * line.along
    samples = []
    beyond = np.zeros(len(points), bool)
    for k, number in enumerate(pair):
        side = turn * line.facing[k]
        end = np.interp(at, np.flatnonzero(both), ends[k][both])
        rows = np.arange(_FIRST, _REACH)
        wanted, row = np.nonzero(rows < end[:, None] - _FIRST)
        samples.append((where[wanted] + (side * rows[row])[:, None] * line.aside[k]) * spacing_m)
        beyond |= (of == number) & (aside[k] * side < 0) & bridged[place]
    return _Meeting((samples[0], samples[1]), where * spacing_m, np.flatnonzero(beyond))


def _ended(place: Ints, across: Float64, length: int) -> tuple[Float64, Float64]:
    """On which side of a line a flat lies at each place, 0 where on none or on both; how near."""
    plus = np.bincount(place[across > _BEYOND], minlength=length) > 0
    minus = np.bincount(place[across < -_BEYOND], minlength=length) > 0
    side = plus.astype(float) - minus
    near = np.full(length, np.inf)
    np.minimum.at(near, place, np.maximum(across * side[place], 0))
    return side, near
