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

from tourgen.geometry import Float32, Float64, PointCloud
from tourgen.stages.sift.views import View, views

_BEAMS = 6
_VOID_STEPS = 2.5
_SAMPLE = 20_000
_ENOUGH = 3_000_000
"""Beams that tell what is empty to a centimetre in a room; more of them would only cost."""

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """What stations know to be empty.

    Attributes:
        views: The points of each station.
        void_rad: Of each station, radians: where no beam lies nearer in direction, none returned.
        lowest_deg: Lower edge of the scanners' field of view.
        margin_m: How far in front of what was measured a place is known to be empty.
    """

    views: tuple[View, ...]
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

    def _beams(self, number: int, points: Float32) -> tuple[Float32, Float32, Mask]:
        """Range of each place, least range of the beams around it, and whether there may be any."""
        view = self.views[number]
        way = points - view.station.astype(np.float32)
        distance = np.maximum(np.linalg.norm(way, axis=1), np.float32(1e-6))
        way /= distance[:, None]
        _, index = view.tree.query(
            way,
            k=np.arange(1, _BEAMS + 1),
            distance_upper_bound=self.void_rad[number],
            workers=-1,
        )
        range_m = np.append(view.range_m, np.float32(np.inf))
        seen = way[:, 2] > np.sin(np.radians(self.lowest_deg))
        return distance, range_m[index].min(axis=1), np.asarray(seen)


def free_space(
    cloud: PointCloud, stations: Float64, void_deg: float, lowest_deg: float, margin_m: float
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
    """
    if len(cloud) > _ENOUGH:
        cloud = cloud.take(np.random.default_rng(0).permutation(len(cloud))[:_ENOUGH])
    seen = tuple(views(cloud, stations))
    void_rad = tuple(max(float(np.radians(void_deg)), _VOID_STEPS * _step_rad(v)) for v in seen)
    return FreeSpace(seen, void_rad, lowest_deg, margin_m)


def _step_rad(view: View) -> float:
    """Angle between neighbouring beams, radians."""
    sample = view.direction[:: max(1, len(view) // _SAMPLE)]
    distance, _ = view.tree.query(sample, k=[min(5, len(view))], workers=-1)
    return float(np.median(distance) * np.sqrt(np.pi / 4))
