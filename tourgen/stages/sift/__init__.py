"""Sift: drop what is not there, by what each station must have seen through, and by statistics.

In this order, since each step trusts what the ones before left:

- *reflected*: what lies behind a mirror (``mirrors.py``).
- *passed*: what another station looked through (``through.py``), a passer-by above all, and the
  rest of a body most of which was (``grown.py``).
- *mixed*: returns of beams that struck two surfaces at once (``mixed.py``, ``rejoin.py``).
- *strays*: points and clusters apart from all else (``strays.py``).

Stations that are known, and which of them measured each point, make the first three; where a scan
does not tell who measured a point, every station that may see it is asked. Where no station is
known, statistics are left.

What makes it quick is to ask few points: those on a smooth surface, five sixths of a room, are
told by the planes of each station's picture (``picture.py``) and need no search for neighbours.

Measured by tests/peers/cleaning.py on the demo's three rooms, from the E57 and from the merged
PLY: all strays and passers-by gone, 99.9 % of reflections, 90 to 95 % of the mixed pixels more than
10 mm off; 0.03 to 0.07 % of the true points go too, and 0.10 to 0.20 % of the true area seen is
left without a point within 10 mm. A gallery by another simulator: all strays, 86 % of such mixed
pixels, 0.13 % of the area. 9 to 14 CPU-seconds a million points on two busy cores. Where it is not
known who measured a point, only a third of the mixed pixels go, and no passer-by.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tourgen.errors import InputError
from tourgen.geometry import Float32, Float64, PointCloud
from tourgen.stages.sift.grown import bodies, grown
from tourgen.stages.sift.mirrors import reflections
from tourgen.stages.sift.mixed import mixed
from tourgen.stages.sift.strays import clusters, islands, isolated
from tourgen.stages.sift.through import passed
from tourgen.stages.sift.views import View, views

VERSION = 8
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Settings:
    """How strict to be.

    Attributes:
        min_points: Fewest points that make a room.
        margin_m: How far behind a place a beam must end to have passed it.
        behind_m: What lies farther behind a mirror, on a beam through it, is a reflection.
        mixed_m: A mixed pixel this near to points that stay may stay too.
        neighbours: Points that make a neighbourhood in space.
        isolation_ratio: A point is a stray when its mean distance to its neighbours exceeds
            theirs by this factor.
        island_gap_m: Clusters farther apart than this are separate.
        island_share: A cluster with less than this share of the points is an island.
        bridge_share: Strays before a mirror join what is behind it to the room in so dense a scan
            that they lie everywhere; places with less than this share of the points that there
            mostly are join nothing.
    """

    min_points: int = 10_000
    margin_m: float = 0.02
    behind_m: float = 0.003
    mixed_m: float = 0.010
    neighbours: int = 8
    isolation_ratio: float = 2.5
    island_gap_m: float = 0.15
    island_share: float = 0.002
    bridge_share: float = 0.02


@dataclass(frozen=True, slots=True)
class Sifted:
    """What is left, and what went.

    Attributes:
        cloud: The kept points in their order.
        removed: How many points went, by cause; those reflected went onto the mirror.
    """

    cloud: PointCloud
    removed: Mapping[str, int]


def sift(cloud: PointCloud, stations: Float64, settings: Settings) -> Sifted:
    """Drop what is not there.

    Args:
        cloud: n points, unthinned.
        stations: (s, 3) metres from the cloud's origin, those that ``cloud.station`` counts
            through; may be empty.
        settings: See ``Settings``.

    Raises:
        InputError: Fewer than ``min_points`` points, before or after.
    """
    _require(len(cloud), settings.min_points, "")
    left, reflected = _without_reflections(cloud, stations, settings)
    left, gone = _without(left, _passed(left, stations, settings))
    seen = list(views(left, stations))
    lonely = mixed(left.points, seen, settings.mixed_m)
    rough = ~_smooth(len(left), seen)[~lonely]
    left, spoiled = _without(left, lonely)
    left, strays = _without(left, _strays(left.points, rough, settings))
    _require(len(left), settings.min_points, " after cleaning")
    return Sifted(
        left,
        {"reflected": reflected, "passed": gone, "mixed": spoiled, "strays": strays},
    )


def _without(cloud: PointCloud, gone: Mask) -> tuple[PointCloud, int]:
    return cloud.take(~gone), int(gone.sum())


def _smooth(count: int, seen: list[View]) -> Mask:
    """Mask of the points that lie on a plane with all others around, in some view."""
    found = np.zeros(count, np.bool_)
    for view in seen:
        found[view.index[view.smooth]] = True
    return found


def _without_reflections(
    cloud: PointCloud, stations: Float64, settings: Settings
) -> tuple[PointCloud, int]:
    if not len(stations):
        return cloud, 0
    cluster = clusters(cloud.points, settings.island_gap_m, settings.bridge_share)
    seen = list(views(cloud, stations))
    found = reflections(cloud.points, cluster, seen, settings.behind_m)
    points = cloud.points.copy()
    points[found.moved] = found.onto
    left, gone = _without(replace(cloud, points=points), found.gone)
    return left, gone + len(found.moved)


def _passed(cloud: PointCloud, stations: Float64, settings: Settings) -> Mask:
    known = cloud.station >= 0
    gone, body = np.zeros((2, len(cloud)), np.bool_)
    if len(stations) > 1 and known.any():
        told = cloud.take(known)
        seen = list(views(told, stations))
        found = passed(told.points, seen, settings.margin_m)
        gone[known], body[known] = found, bodies(told.points, found, seen)
    return grown(cloud, gone, body)


def _strays(points: Float32, suspect: Mask, settings: Settings) -> Mask:
    gone = islands(points, settings.island_gap_m, settings.island_share)
    rest = np.flatnonzero(~gone)
    suspect = suspect[rest]
    alone = isolated(points[rest], suspect, settings.neighbours, settings.isolation_ratio)
    gone[rest[alone]] = True
    return gone


def _require(found: int, needed: int, when: str) -> None:
    if found < needed:
        raise InputError(
            f"expected at least {needed} points{when}, found {found}",
            "check the export, `unit` and `keep`, or lower `clean.min_points`",
        )
