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

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Float64, Int32
from tourgen.neighbours import Neighbours
from tourgen.sorting import distinct, order_of
from tourgen.stages.cells import cells_of
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
_ROWS = np.arange(_FIRST, _REACH)
"""Where all of them lie."""

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
    none = len(flats.normals)
    if not none:
        return
    cells = cells_of(points, np.where(flats.of < 0, none, flats.of), none + 1, _CELL * spacing_m)
    middle = cells.means(points)
    most_m = (_REACH + _CELL) * spacing_m
    near, _ = Neighbours.of(middle, _NEIGHBOURS).nearest(middle, _NEIGHBOURS, most_m)
    pair, one = _creased(cells.owner, near, flats.normals, flats.narrow)
    order = order_of(pair)
    for chosen in np.split(order, np.flatnonzero(np.diff(pair[order])) + 1):
        if len(chosen):
            around = near[distinct(one[chosen])]
            groups = distinct(around[around >= 0]).astype(np.int64)
            first, second = divmod(int(pair[chosen[0]]), none)
            yield first, second, cells.members(groups)


@compiled
def _creased(owner: Ints, near: Int32, normals: Float64, narrow: Mask) -> tuple[Ints, Ints]:
    """Pairs of flats that leave a crease, by the cells in which they are near each other.

    Args:
        owner: (g,) the flat of each cell, their count for none.
        near: (g, k) cells near each, -1 after the last.
        normals: (p, 3) of the flats.
        narrow: (p,) which are strips.

    Returns:
        (n,) number of each pair, the lower flat times their count plus the higher; (n,) its cell.
    """
    none = len(normals)
    pair, cell = np.empty(near.size, np.int64), np.empty(near.size, np.int64)
    found = 0
    for i in range(len(near)):
        for j in near[i]:
            if j < 0:
                break
            low, high = min(owner[i], owner[j]), max(owner[i], owner[j])
            if high == none or low == high or (narrow[low] and narrow[high]):
                continue
            one, other = normals[low], normals[high]
            if abs(one[0] * other[0] + one[1] * other[1] + one[2] * other[2]) < _BLUNT:
                pair[found], cell[found] = low * none + high, i
                found += 1
    return pair[:found], cell[:found]


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
class _Side:
    """Points about a line, as one of the flats that may meet there has it.

    Attributes:
        across: (n,) how far each lies from the line within the flat, spacings.
        mine: (n,) which are the flat's.
        front: (m,) at each place along the line, whether the flat ends before, 1, or behind the
            other flat, -1; 0: it does not end there.
        near: (m,) how near to the line, spacings.
    """

    across: Float64
    mine: Mask
    front: Float64
    near: Float64

    @staticmethod
    def of(across: Float64, mine: Mask, place: Ints, facing: float) -> _Side:
        about = mine & (np.abs(across) < _REACH)
        end, near = _ended(place[about], across[about], int(place.max()) + 1)
        return _Side(across, mine, end * facing, near)

    def rows(self, at: Ints, both: Mask) -> tuple[Ints, Ints]:
        """Which places want samples, and in which rows from the line, so that the flat reaches it.

        Args:
            at: (k,) places where the flats meet or are bridged.
            both: (m,) where they meet.
        """
        end = np.interp(at, np.flatnonzero(both), self.near[both])
        wanted, row = np.nonzero(end[:, None] - _FIRST > _ROWS)
        return wanted, row


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
    one, other = (
        _Side.of(apart @ way, of == number, place, facing)
        for way, number, facing in zip(line.aside, pair, line.facing, strict=True)
    )
    off = np.sqrt(np.maximum(np.square(apart).sum(axis=1) - along**2, 0))
    third = ~(one.mine | other.mine)
    gap = np.maximum(one.near, other.near)
    between = third & (off > _MIXED) & (off < gap[place] + _MIXED)
    free = np.bincount(place[between], minlength=len(gap)) == 0
    turn, both, bridged = _turned(one.front, other.front, free)
    if both.sum() < _LEAST:
        return None
    at = np.flatnonzero(bridged)
    where = (at + low + 0.5)[:, None] * line.along
    gone = third & (off < _MIXED)
    samples = []
    for side, way, facing in zip((one, other), line.aside, turn * line.facing, strict=True):
        wanted, row = side.rows(at, both)
        samples.append((where[wanted] + (facing * _ROWS[row])[:, None] * way) * spacing_m)
        gone |= side.mine & (side.across * facing < 0)
    return _Meeting((samples[0], samples[1]), np.flatnonzero(gone & bridged[place]))


def _turned(first: Float64, second: Float64, free: Mask) -> tuple[int, Mask, Mask]:
    """Whether two flats meet in a corner, 1, or at an edge, -1; where; and with what is bridged.

    Args:
        first: (m,) the front of one.
        second: (m,) that of the other.
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
