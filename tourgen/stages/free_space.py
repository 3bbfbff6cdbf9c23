"""Free space: what stations know to be empty, since their beams went on through it.

A place is empty when the beams around its direction all went farther. Beams are looked up by their
own directions, not in the cells of a depth buffer: on a wall seen at a grazing angle a cell of
0.75° holds ranges that differ by decimetres, and whatever hung as far in front of such a wall could
not be told from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Float64, Int32, PointCloud
from tourgen.neighbours import Grid, nearest_to
from tourgen.stages.sift.views import View, views
from tourgen.threads import in_parts

LOWEST_DEG = -58.0
"""Lower edge of a scanner's field of view, as most have it."""
_BEAMS = 6
_AROUND = 20
"""Beams by which the rim between them is drawn."""
_HEM, _ROUND, _MIXED = np.float32(0.05), np.float32(1e-3), np.float32(0.12)
"""Of the line that parts beams: what the farthest weighs; how flat a row of beams tells none; the
share of them on its wrong side from which on it parts nothing."""
_SPARE_STEPS = 0.1
"""How far a rim is thought to go on past that line, in their steps."""
_PART = 1 << 11
_VOID_STEPS = 2.5
_SAMPLE = 20_000
_ENOUGH = 3_000_000
"""Beams that tell what is empty to a centimetre in a room; more of them would only cost."""

Mask = npt.NDArray[np.bool_]
_Asked = tuple[Grid, Float32, Float32, np.float32, np.float32, np.float32, np.float32]


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """What stations know to be empty.

    Attributes:
        views: The points of each station.
        step_rad: Angle between neighbouring beams of each station.
        void_rad: Of each station: where no beam lies nearer in direction, none returned.
        lowest_deg: Lower edge of the scanners' field of view.
        margin_m: How far in front of what was measured a place is known to be empty.
    """

    views: tuple[View, ...]
    step_rad: tuple[float, ...]
    void_rad: tuple[float, ...]
    lowest_deg: float
    margin_m: float

    def holds(self, points: Float32) -> Mask:
        """Mask of the (n, 3) places where a surface would have been measured and was not."""
        free = np.zeros(len(points), bool)
        for number in range(len(self.views)):
            distance, reach_m, seen = self._beams(number, points)
            free |= (distance + self.margin_m < reach_m) & seen
        return free

    def leads_out(self, points: Float32) -> Mask:
        """Mask of the (n, 3) places in whose direction a station measured nothing at all."""
        out = np.zeros(len(points), bool)
        for number in range(len(self.views)):
            _, reach_m, seen = self._beams(number, points)
            out |= np.isinf(reach_m) & seen
        return out

    def depth_m(self, places: Float32, normals: Float32) -> Float32:
        """How deep places lie in what beams went through.

        A rim runs straight, for a few beams, between those that it stopped and those that went on
        past it; where no line parts them, half way between the nearest of either. A
        beam that ended on the very sheet which a place belongs to went past nothing: at a grazing
        angle it only met it farther on.

        Args:
            places: (n, 3)
            normals: (n, 3) unit normals of the sheets that the places may belong to.

        Returns:
            (n,) metres from the rim, negative behind it, minus infinity where nothing is known.
        """
        depth_m = np.full(len(places), -np.inf, np.float32)
        for view, step_rad, void_rad in zip(self.views, self.step_rad, self.void_rad, strict=True):
            asked = (
                view.beams.grid,
                view.beam_m,
                view.station.astype(np.float32),
                np.float32(void_rad),
                np.float32(np.sin(np.radians(self.lowest_deg))),
                np.float32(self.margin_m),
                np.float32(_SPARE_STEPS * step_rad),
            )

            def tell(first: int, last: int, asked: _Asked = asked) -> None:
                _deepen(*asked, places[first:last], normals[first:last], depth_m[first:last])

            in_parts(tell, len(places), _PART)
        return depth_m

    def _beams(self, number: int, points: Float32) -> tuple[Float32, Float32, Mask]:
        """Range of each place, least range of the beams around it, and whether there may be any."""
        view = self.views[number]
        way = points - view.station.astype(np.float32)
        distance = np.maximum(np.linalg.norm(way, axis=1), np.float32(1e-6))
        way /= distance[:, None]
        index, _ = view.beams.nearest(way, _BEAMS, self.void_rad[number])
        range_m = np.append(view.range_m, np.float32(np.inf))
        seen = way[:, 2] > np.sin(np.radians(self.lowest_deg))
        return distance, range_m[index].min(axis=1), np.asarray(seen)


def free_space(
    cloud: PointCloud,
    stations: Float64,
    void_deg: float,
    lowest_deg: float,
    margin_m: float,
    most_beams: int = _ENOUGH,
) -> FreeSpace:
    """What (s, 3) stations that measured a cloud know to be empty.

    Args:
        cloud: Unthinned, of which some are taken; a point that does not tell its station counts
            for each that sees it.
        stations: Metres from the cloud's origin.
        void_deg: Where no beam lies nearer in direction, none returned; more where beams are
            farther apart than 0.4 of it.
        lowest_deg: Lower edge of the scanners' field of view.
        margin_m: How far in front of what was measured a place is known to be empty.
        most_beams: So many are taken at most.
    """
    if len(cloud) > most_beams:
        cloud = cloud.take(np.random.default_rng(0).permutation(len(cloud))[:most_beams])
    seen = tuple(views(cloud, stations))
    step_rad = tuple(_step_rad(view) for view in seen)
    void_rad = tuple(max(float(np.radians(void_deg)), _VOID_STEPS * step) for step in step_rad)
    return FreeSpace(seen, step_rad, void_rad, lowest_deg, margin_m)


def _step_rad(view: View) -> float:
    """Angle between neighbouring beams, radians."""
    sample = view.direction[:: max(1, len(view) // _SAMPLE)]
    _, distance = view.beams.nearest(sample, min(5, len(view)))
    return float(np.median(distance[:, -1]) * np.sqrt(np.pi / 4))


@compiled
def _deepen(
    beams: Grid,
    range_m: Float32,
    station: Float32,
    void_rad: np.float32,
    lowest: np.float32,
    margin_m: np.float32,
    spare_rad: np.float32,
    places: Float32,
    normals: Float32,
    depth_m: Float32,
) -> None:
    """Raise the depths of some places to what one station tells; see ``FreeSpace.depth_m``."""
    directions = beams[0]
    index, square = np.empty(_AROUND, np.int32), np.empty(_AROUND, np.float32)
    kind, aside = np.empty(_AROUND, np.float32), np.empty((_AROUND, 2), np.float32)
    way, normal = np.empty(3, np.float32), np.empty(3, np.float32)
    for i in range(len(places)):
        way[:], normal[:] = places[i] - station, normals[i]
        distance = max(np.sqrt((way * way).sum()), np.float32(1e-6))
        height = (way * normal).sum()
        way /= distance
        if way[2] <= lowest:
            continue
        most = void_rad**2
        found = nearest_to(beams, way[0], way[1], way[2], most, most, index, square)
        if found < _BEAMS:
            continue
        stopped, went_on = square[found - 1], np.float32(np.inf)
        for k in range(found - 1, -1, -1):
            reach = range_m[index[k]]
            above = reach * (directions[index[k]] * normal).sum() - height
            if reach > distance + margin_m and above < -margin_m:
                went_on, kind[k] = square[k], 1
            else:
                stopped, kind[k] = square[k], -1
        before, behind = np.sqrt(stopped), np.sqrt(went_on)
        past = (before - behind) / 2
        if abs(kind[:found].sum()) < found:
            _set_aside(directions, index[:found], way, aside)
            parted = _parted(kind[:found], aside, square)
            past = past if np.isnan(parted) else min(max(parted, -behind), before)
        depth_m[i] = max(depth_m[i], (past - spare_rad) * distance)


@compiled
def _set_aside(directions: Float32, index: Int32, way: Float32, aside: Float32) -> None:
    """How far some directions lie to the right of a way and above it, radians."""
    level = max(np.sqrt(way[0] ** 2 + way[1] ** 2), np.float32(1e-6))
    x, y = -way[1] / level, way[0] / level
    for k, j in enumerate(index):
        off = directions[j] - way
        aside[k, 0] = x * off[0] + y * off[1]
        aside[k, 1] = level * off[2] - way[2] * (y * off[0] - x * off[1])


@compiled
def _parted(kind: Float32, aside: Float32, square: Float32) -> np.float32:
    """How far the origin lies past the straight line that parts two kinds of places.

    Fisher's, by least squares: nearer places count for more. Not a number where there is none,
    since too many would lie on its wrong side, as about a thin board.
    """
    count = len(kind)
    weight = _HEM + 1 - square[:count] / square[count - 1]
    weight /= weight.sum()
    x, y = aside[:count, 0], aside[:count, 1]
    mean, mean_x, mean_y = (weight * kind).sum(), (weight * x).sum(), (weight * y).sum()
    kind_off, x_off, y_off = weight * (kind - mean), x - mean_x, y - mean_y
    xx, xy, yy = (
        (weight * x_off * x_off).sum(),
        (weight * x_off * y_off).sum(),
        (weight * y_off * y_off).sum(),
    )
    xk, yk = (kind_off * x_off).sum(), (kind_off * y_off).sum()
    size = xx * yy - xy * xy
    if not size > _ROUND * xx * yy:
        return np.float32(np.nan)
    slope_x, slope_y = (yy * xk - xy * yk) / size, (xx * yk - xy * xk) / size
    told = mean + slope_x * x_off + slope_y * y_off
    if (weight * (told * kind < 0)).sum() > _MIXED:
        return np.float32(np.nan)
    past = mean - slope_x * mean_x - slope_y * mean_y
    return np.float32(past / max(np.sqrt(slope_x**2 + slope_y**2), np.float32(1e-9)))
