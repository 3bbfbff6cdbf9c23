"""Sift: drop what is not there, by what each station must have seen through, and by statistics.

In this order, since each step trusts what the ones before left:

- *reflected*: what lies behind a mirror (``mirrors.py``).
- *passed*: what another station looked through (``through.py``), a passer-by above all.
- *mixed*: returns of beams that struck two surfaces at once (``mixed.py``).
- *strays*: points and clusters apart from all else (``strays.py``).

The first takes a scan that tells which station measured each point; the second takes stations,
and is more careful where it must guess which of them measured a point. Where no station is known,
statistics are left.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.errors import InputError
from tourgen.geometry import Float64, PointCloud
from tourgen.stages.sift.mirrors import reflections
from tourgen.stages.sift.mixed import mixed
from tourgen.stages.sift.strays import clusters, islands, isolated
from tourgen.stages.sift.through import confirmed, grown, passed
from tourgen.stages.sift.views import views

VERSION = 1
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Settings:
    """How strict to be.

    Attributes:
        min_points: Fewest points that make a room.
        margin_m: How far behind a place a beam must end to have passed it.
        behind_m: What lies farther behind a mirror, on a beam through it, is a reflection.
        mixed_m: A mixed pixel this near to a surface may stay.
        confirm_m: A point that another station measured within this stays.
        neighbours: Points that make a neighbourhood in space.
        isolation_ratio: A point is a stray when its mean distance to its neighbours exceeds
            theirs by this factor.
        island_gap_m: Clusters farther apart than this are separate.
        island_share: A cluster with less than this share of the points is an island.
    """

    min_points: int = 10_000
    margin_m: float = 0.02
    behind_m: float = 0.003
    mixed_m: float = 0.006
    confirm_m: float = 0.006
    neighbours: int = 8
    isolation_ratio: float = 2.5
    island_gap_m: float = 0.15
    island_share: float = 0.002


@dataclass(frozen=True, slots=True)
class Sifted:
    """What is left, and what went.

    Attributes:
        cloud: The kept points in their order.
        removed: How many points went, by cause.
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
    steps = {"reflected": _reflected, "passed": _passed, "mixed": _mixed, "strays": _strays}
    rest = np.ones(len(cloud), np.bool_)
    removed = {}
    for cause, step in steps.items():
        gone = step(cloud.take(rest), stations, settings)
        rest[np.flatnonzero(rest)[gone]] = False
        removed[cause] = int(gone.sum())
    kept = cloud.take(rest)
    _require(len(kept), settings.min_points, " after cleaning")
    return Sifted(kept, removed)


def _reflected(cloud: PointCloud, stations: Float64, settings: Settings) -> Mask:
    if not len(stations):
        return np.zeros(len(cloud), np.bool_)
    cluster = clusters(cloud.points, settings.island_gap_m)
    return reflections(cloud.points, cluster, list(views(cloud, stations)), settings.behind_m)


def _passed(cloud: PointCloud, stations: Float64, settings: Settings) -> Mask:
    known = cloud.station >= 0
    gone = np.zeros(len(cloud), np.bool_)
    if len(stations) > 1 and known.any():
        told = cloud.take(known)
        gone[known] = passed(told, list(views(told, stations)), settings.margin_m)
        gone = grown(cloud, gone)
    return gone


def _mixed(cloud: PointCloud, stations: Float64, settings: Settings) -> Mask:
    found = mixed(len(cloud), views(cloud, stations), settings.mixed_m)
    at = np.flatnonzero(found)
    every = np.ones(len(cloud), np.bool_)
    found[at[confirmed(cloud, at, every, settings.confirm_m)]] = False
    return found


def _strays(cloud: PointCloud, _: Float64, settings: Settings) -> Mask:
    gone = islands(cloud.points, settings.island_gap_m, settings.island_share)
    rest = np.flatnonzero(~gone)
    alone = isolated(cloud.points[rest], settings.neighbours, settings.isolation_ratio)
    gone[rest[alone]] = True
    return gone


def _require(found: int, needed: int, when: str) -> None:
    if found < needed:
        raise InputError(
            f"expected at least {needed} points{when}, found {found}",
            "check the export and the keep box, or lower `clean.min_points`",
        )
