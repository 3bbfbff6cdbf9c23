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
_NEIGHBOURS = 32
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
        gone[near[found.gone]] = True
    on = np.concatenate(of)
    count = len(on)
    kept = planes.take(~gone)
    return TangentPlanes(
        np.concatenate([kept.points, np.concatenate(points).astype(np.float32)]),
        np.concatenate([kept.normals, flats.normals[on].astype(np.float32)]),
        np.concatenate([kept.spacing_m, np.full(count, spacing_m, np.float32)]),
        np.concatenate([kept.support, np.ones(count, np.float32)]),
        planes.noise_m,
    )


def _pairs(points: Float32, flats: Flats, spacing_m: float) -> Iterator[tuple[int, int, Ints]]:
    """Flats that come near each other at an angle, and all points near where they do."""
    if not len(flats.normals):
        return
    none = len(flats.normals)
    of = np.where(flats.of < 0, none, flats.of)
    cell = np.floor((points - points.min(axis=0)) / (_CELL * spacing_m)).astype(np.int64)
    key = np.ravel_multi_index((*cell.T, of), (*(cell.max(axis=0) + 1), none + 1))
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    stops = np.append(starts[1:], len(points))
    middle = np.add.reduceat(points[order], starts) / (stops - starts)[:, None]
    distance, found = cKDTree(middle).query(
        middle,
        k=np.arange(1, _NEIGHBOURS + 1),
        distance_upper_bound=(_REACH + _CELL) * spacing_m,
        workers=-1,
    )
    near = np.asarray(found)
    number = of[order[starts]]
    there = np.isfinite(distance).ravel()
    one, other = np.repeat(np.arange(len(middle)), _NEIGHBOURS)[there], near.ravel()[there]
    low, high = np.minimum(number[one], number[other]), np.maximum(number[one], number[other])
    real = np.flatnonzero((high < none) & (low < high))
    low, high, one = low[real], high[real], one[real]
    cosine = np.abs(np.einsum("ij,ij->i", flats.normals[low], flats.normals[high]))
    good = (cosine < _BLUNT) & ~(flats.narrow[low] & flats.narrow[high])
    pair, one = (low * none + high)[good], one[good]
    by_pair = np.argsort(pair, kind="stable")
    for chosen in np.split(by_pair, np.flatnonzero(np.diff(pair[by_pair])) + 1):
        if len(chosen):
            around = near[np.unique(one[chosen])]
            cells = np.unique(around[around < len(middle)])
            first, second = divmod(int(pair[chosen[0]]), none)
            yield first, second, order[_ranges(starts[cells], stops[cells])]


def _ranges(starts: Ints, stops: Ints) -> Ints:
    """All numbers of several ranges."""
    count = stops - starts
    before = np.cumsum(count) - count
    return np.asarray(np.arange(count.sum()) + np.repeat(starts - before, count))


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
        gone: Of the points asked for, positions of those that have no place there.
    """

    samples: tuple[Float64, Float64]
    gone: Ints


def _meeting(
    line: _Line, points: Float32, of: Ints, pair: tuple[int, int], spacing_m: float
) -> _Meeting | None:
    """Where along a line two flats meet; None where nowhere."""
    apart = (points - line.start) / spacing_m
    along = apart @ line.along
    low = int(np.floor(along.min()))
    place = np.floor(along).astype(np.int64) - low
    length = int(place.max()) + 1
    aside = [apart @ way for way in line.aside]
    mine = [(of == number) & (np.abs(a) < _REACH) for number, a in zip(pair, aside, strict=True)]
    ended = [_ended(place[own], a[own], length) for own, a in zip(mine, aside, strict=True)]
    front = [side * facing for (side, _), facing in zip(ended, line.facing, strict=True)]
    off = np.sqrt(np.maximum(np.square(apart).sum(axis=1) - along**2, 0))
    third = ~np.isin(of, pair)
    gap = np.maximum(ended[0][1], ended[1][1])
    others = third & (off > _MIXED) & (off < gap[place] + _MIXED)
    free = np.bincount(place[others], minlength=length) == 0
    turn, both, bridged = _turned(front[0], front[1], free)
    if both.sum() < _LEAST:
        return None
    at = np.flatnonzero(bridged)
    where = (at + low + 0.5)[:, None] * line.along
    rows = np.arange(_FIRST, _REACH)
    gone = third & (off < _MIXED)
    samples = []
    for k, number in enumerate(pair):
        side = turn * line.facing[k]
        end = np.interp(at, np.flatnonzero(both), ended[k][1][both])
        wanted, row = np.nonzero(rows < end[:, None] - _FIRST)
        samples.append((where[wanted] + (side * rows[row])[:, None] * line.aside[k]) * spacing_m)
        gone |= (of == number) & (aside[k] * side < 0)
    return _Meeting((samples[0], samples[1]), np.flatnonzero(gone & bridged[place]))


def _turned(first: Float64, second: Float64, free: Mask) -> tuple[int, Mask, Mask]:
    """Whether two flats meet in a corner, 1, or at an edge, -1; where; and with what is bridged.

    Args:
        first: (m,) whether one flat ends before, 1, or behind the other, -1, at each place; 0: it
            does not end there.
        second: (m,) the same of the other flat.
        free: (m,) whether nothing stands between them.
    """
    both = (first != 0) & (first == second) & free
    turn = 1 if (first * both).sum() >= 0 else -1
    both &= first == turn
    wide = binary_closing(np.pad(both, _CLOSED), np.ones(_CLOSED + 1, np.bool_))
    against = (first == -turn) | (second == -turn) | ~free
    return turn, both, np.asarray(wide[_CLOSED:-_CLOSED] & ~against)


def _ended(place: Ints, across: Float64, length: int) -> tuple[Float64, Float64]:
    """On which side of a line a flat lies at each place, 0 where on none or on both; how near."""
    plus = np.bincount(place[across > _BEYOND], minlength=length) > 0
    minus = np.bincount(place[across < -_BEYOND], minlength=length) > 0
    side = plus.astype(float) - minus
    near = np.full(length, np.inf)
    np.minimum.at(near, place, np.maximum(across * side[place], 0))
    return side, near
