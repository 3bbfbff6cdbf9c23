"""Mirrors: the room that a scanner saw behind a looking glass.

Behind a mirror a scan shows the room a second time, reflected. Its points form clusters apart from
the room, seen from each station through one patch of a wall. Whether that patch is a mirror or a
window is told by folding the cluster back: reflected at the mirror's plane it falls onto the room.
The plane starts from the points around the patch in the station's picture, the mirror's frame, and
is moved until the two agree best. Then all goes that lies behind the glass on a beam through it,
also what is too near the wall to be a cluster apart: onto the glass, where each beam met it, so
that the mirror becomes a surface that shows what it showed to the scanner, and no hole in the wall.
Only where it is not told which station measured a point, it is dropped.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError, cKDTree

from tourgen.geometry import Float32, Float64
from tourgen.stages.sift.strays import clusters
from tourgen.stages.sift.views import View

Mask = npt.NDArray[np.bool_]
_LEAST_POINTS = 40
_FRAME = 12
_TRIED = 500
_ROOM_POINTS = 400_000
_RIM_M = 0.03
_FAR_M = 0.15
_SAME_M = 0.03
_BESIDE = 4.0  # spacings: farther from a picture's points it has a gap
_SAME_SHARE = 0.6
_OFFSETS_M = np.arange(-0.08, 0.081, 0.02)


@dataclass(frozen=True, slots=True)
class Mirror:
    """A flat looking glass.

    Attributes:
        normal: (3,) unit, into the room.
        place: (3,) metres, on the glass.
        across: (2, 3) unit vectors in the glass.
        outline: (h, 3) of the half planes a x + b y + c <= 0, in the glass about its place, that
            bound it.
    """

    normal: Float64
    place: Float64
    across: Float64
    outline: Float64

    def hides(self, station: Float64, points: Float32, behind_m: float) -> Mask:
        """Mask of the (n, 3) points that a beam from a station meets behind the glass."""
        start = (station - self.place) @ self.normal
        depth = (points - self.place) @ self.normal
        behind = (depth < -behind_m) & (start > 0)
        at = np.flatnonzero(behind)
        flat = (self.crossing(station, points[at]) - self.place) @ self.across.T
        behind[at] = (flat @ self.outline[:, :2].T + self.outline[:, 2] <= 0).all(axis=1)
        return behind

    def crossing(self, station: Float64, points: Float32) -> Float64:
        """(n, 3) where the beams from a station to (n, 3) points behind the glass pass it."""
        start = (station - self.place) @ self.normal
        share = start / (start - (points - self.place) @ self.normal)
        return np.asarray(station + share[:, None] * (points - station))


@dataclass(frozen=True, slots=True)
class Reflections:
    """What lies behind mirrors.

    Attributes:
        gone: (n,) mask of the points to drop.
        moved: (k,) numbers of the points to move.
        onto: (k, 3) metres, where to.
    """

    gone: Mask
    moved: npt.NDArray[np.int64]
    onto: Float32


def reflections(
    points: Float32,
    cluster: npt.NDArray[np.int32],
    seen: Sequence[View],
    behind_m: float,
) -> Reflections:
    """The points that lie behind mirrors.

    Args:
        points: (n, 3) metres.
        cluster: (n,) number of the cluster apart that each point lies in, 0 for the room itself,
            -1 for strays.
        seen: The stations' views.
        behind_m: What lies less behind the glass is not told from it.
    """
    gone = np.zeros(len(points), np.bool_)
    moved, onto = [np.empty(0, np.int64)], [np.empty((0, 3), np.float32)]
    room = np.flatnonzero(cluster == 0)
    rng = np.random.default_rng(0)
    tree = cKDTree(points[rng.choice(room, min(len(room), _ROOM_POINTS), replace=False)])
    for view, at in _apart(cluster, seen):
        at = at[~gone[view.index[at]]]
        if len(at) < _LEAST_POINTS:
            continue
        frame = _frame(view, at, cluster == 0)
        if len(frame) < _FRAME:
            continue
        ghosts = points[view.index[at]].astype(np.float64)
        glass = _glass(points[view.index[frame]].astype(np.float64), view.station, ghosts, tree)
        if glass is None:
            continue
        crossing = [
            _crossing(*glass, each.station, points[each.index[part]], tree)
            for each, part in _apart(cluster, seen)
        ]
        mirror = outlined(*glass, np.concatenate(crossing))
        if mirror is None:
            continue
        shown: list[tuple[npt.NDArray[np.int64], Float32]] = []
        for each in seen:
            hidden = mirror.hides(each.station, points[each.index], behind_m)
            # Another station may have measured a wall there, where it is not told which did.
            hidden &= each.told | (cluster[each.index] != 0)
            fresh = each.index[hidden & each.told]
            fresh = fresh[~gone[fresh]]
            shown.append((fresh, mirror.crossing(each.station, points[fresh]).astype(np.float32)))
            gone[each.index[hidden]] = True
        for numbers, places in _one_picture(shown):
            moved.append(numbers)
            onto.append(places)
    at = np.concatenate(moved)
    gone[at] = False
    return Reflections(gone, at, np.concatenate(onto))


def _one_picture(
    shown: list[tuple[npt.NDArray[np.int64], Float32]],
) -> Iterator[tuple[npt.NDArray[np.int64], Float32]]:
    """Of what stations saw in a mirror, points and places, the fullest, and what it lacks."""
    taken = np.empty((0, 3), np.float32)
    for numbers, places in sorted(shown, key=lambda each: -len(each[0])):
        if len(taken) > 1 and len(places):
            tree = cKDTree(taken)
            apart_m = _BESIDE * float(np.median(tree.query(taken, k=[2])[0]))
            lacks = np.isinf(np.asarray(tree.query(places, distance_upper_bound=apart_m)[0]))
            numbers, places = numbers[lacks], places[lacks]
        taken = np.concatenate([taken, places])
        yield numbers, places


def _apart(
    cluster: npt.NDArray[np.int32], seen: Sequence[View]
) -> Iterator[tuple[View, npt.NDArray[np.int64]]]:
    """What each view shows of each cluster that is apart from the room."""
    for view in seen:
        own = cluster[view.index]
        numbers, count = np.unique(own[own > 0], return_counts=True)
        for number in numbers[count >= _LEAST_POINTS]:
            yield view, np.flatnonzero(own == number)


def _frame(view: View, at: npt.NDArray[np.int64], of_room: Mask) -> npt.NDArray[np.int64]:
    """The points of the room next to others in a picture, and nearer to the station."""
    near = np.unique(view.around(at, _FRAME).neighbours(at, _FRAME))
    return near[of_room[view.index[near]] & (view.range_m[near] < np.median(view.range_m[at]))]


def _apart_m(normal: Float64, place: Float64, ghosts: Float64, room: cKDTree) -> Float64:
    """How far from the room each ghost falls that is folded back at a plane."""
    folded = ghosts - 2 * ((ghosts - place) @ normal)[:, None] * normal
    distance, _ = room.query(folded, distance_upper_bound=_FAR_M)
    return np.minimum(distance, _FAR_M)


def _glass(
    frame: Float64, station: Float64, ghosts: Float64, room: cKDTree
) -> tuple[Float64, Float64] | None:
    """Normal and place of the plane at which the ghosts fold onto the room; None where none is."""
    place = np.median(frame, axis=0)
    distance = np.linalg.norm(frame - place, axis=1)
    frame = frame[distance <= 2 * np.median(distance)]
    normal = np.linalg.svd(frame - frame.mean(axis=0), full_matrices=False)[2][2]
    normal *= np.sign((station - place) @ normal) or 1.0
    some = ghosts[:: max(1, len(ghosts) // _TRIED)]
    across = _across(normal)

    def plane(values: Float64) -> tuple[Float64, Float64]:
        tilted = normal + values[1:] @ across
        tilted /= np.linalg.norm(tilted)
        return tilted, place + values[0] * tilted

    def misfit(values: Float64) -> float:
        return float(_apart_m(*plane(values), some, room).mean())

    start = np.array([min(_OFFSETS_M, key=lambda off: misfit(np.array([off, 0, 0]))), 0, 0])
    corners = start + np.vstack([np.zeros(3), np.diag([0.01, 0.02, 0.02])])
    options: Any = {"initial_simplex": corners, "xatol": 1e-5, "fatol": 1e-6}
    found: Any = minimize(misfit, start, method="Nelder-Mead", options=options)
    fits = _apart_m(*plane(found.x), ghosts, room) < _SAME_M
    return plane(found.x) if fits.mean() >= _SAME_SHARE else None


def _crossing(
    normal: Float64, place: Float64, station: Float64, ghosts: Float32, room: cKDTree
) -> Float64:
    """(k, 3) where the beams to those that fold onto the room pass the plane, from its place; none
    where most do not."""
    start = (station - place) @ normal
    fits = _apart_m(normal, place, ghosts.astype(np.float64), room) < _SAME_M
    depth = (ghosts - place) @ normal
    if start <= 0 or fits.mean() < _SAME_SHARE:
        return np.empty((0, 3))
    through = fits & (depth < 0)
    share = (start / (start - depth[through]))[:, None]
    return np.asarray(station + share * (ghosts[through] - station) - place)


def _across(normal: Float64) -> Float64:
    """(2, 3) unit vectors square to a normal and to each other."""
    other = np.zeros(3)
    other[np.argmin(np.abs(normal))] = 1
    first = np.cross(normal, other)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def outlined(normal: Float64, place: Float64, crossing: Float64) -> Mirror | None:
    """The mirror as large as the patch through which ghosts are seen, and its rim.

    A few ghosts that fold onto the room by chance are seen beside it, through nothing.
    """
    across = _across(normal)
    patch = clusters(crossing.astype(np.float32), _RIM_M)
    crossing = crossing[(np.bincount(patch) >= _LEAST_POINTS)[patch]]
    try:
        outline = ConvexHull(crossing @ across.T).equations
    except (QhullError, ValueError):
        return None
    outline[:, 2] -= _RIM_M
    return Mirror(normal, place, across, outline)
