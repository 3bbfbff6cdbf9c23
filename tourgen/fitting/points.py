"""Fitting the points: from a room's scans to points that know where they belong and where to look.

Each function runs one stage with settings that follow from the tour file and the scan.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tourgen.cache import stamp_of
from tourgen.errors import InputError
from tourgen.fitting.lengths import Corner, corners, detail_m
from tourgen.fitting.plausible import require_room
from tourgen.geometry import Float64, OrientedCloud, Panorama, PointCloud
from tourgen.remote import local
from tourgen.scans import ReadFacts, read_panoramas, read_room, without_repeats
from tourgen.stages import (
    crowding,
    exposure,
    floor,
    normals,
    ownership,
    register,
    sift,
    stations,
    thin,
)
from tourgen.stages.spacing import Spacing, spacing
from tourgen.tour import Room, open_scans

CROWDED_MM = (3.0, 4.0)
"""Points at most so far apart crowd each other, and where there are very many, unless finer
pictures are asked for."""
_SPACING_MM = (0.1, 1000.0)
_LEAST_POINTS = 100
"""Fewer tell no surface."""
_REPEATING = 50_000_000
"""Of more points those that repeat others go with what is crowded: a sort would take gigabytes."""


@dataclass(frozen=True, slots=True)
class Reading:
    """How scans become one cloud."""

    unit: str
    up: str
    poses: tuple[Any, ...]
    scan_stations: tuple[Any, ...]
    stations: Any
    keep: tuple[Corner, Corner] | None
    remove: tuple[tuple[Corner, Corner], ...]


@dataclass(frozen=True, slots=True)
class Thinning:
    """The voxel asked for; None is half the detail."""

    detail_mm: float | None
    thin_mm: float | None


@dataclass(frozen=True, slots=True)
class Owning:
    """How points are told apart by their stations, and which of them stay."""

    grids: ownership.Settings
    crowds: crowding.Settings


@dataclass(frozen=True, slots=True)
class RoomScan:
    """What the scans hold.

    Attributes:
        cloud: The cropped points.
        stations: (s, 3) float64, metres from the cloud's origin: as given, or as the scans tell.
        panoramas: Pictures with poses.
        facts: How reading went.
    """

    cloud: PointCloud
    stations: Float64
    panoramas: tuple[Panorama, ...]
    facts: ReadFacts


@dataclass(frozen=True, slots=True)
class Stationed:
    """A cloud and where it was measured from.

    Attributes:
        cloud: Whose ``station`` counts through the stations.
        stations: (s, 3) float64, metres from the cloud's origin.
    """

    cloud: PointCloud
    stations: Float64


def reading(room: Room) -> Reading:
    """What of a room's settings bears on reading."""
    return Reading(
        room.unit,
        room.up,
        tuple(scan.pose for scan in room.scans),
        tuple(scan.station for scan in room.scans),
        room.stations,
        corners(room.keep) if room.keep else None,
        tuple(corners(box) for box in room.remove),
    )


def read(room: Room, folder: Path, stamps: Mapping[str, str], _: Reading) -> RoomScan:
    """Read a room's scans; the settings are those of the room, gathered for the key.

    Args:
        room: Whose.
        folder: Where the files' paths start.
        stamps: Of the files when the build began, by path.

    Raises:
        InputError: A scan cannot be read, or what they hold cannot be a room, or a file is no
            longer the one that the build began with.
    """
    _require_unchanged(folder, stamps)
    scans = open_scans(room, folder)
    cloud, found, facts = read_room(scans, room.keep, room.remove, room.clean.min_points)
    _require_unchanged(folder, stamps)
    count = len(cloud)
    if count <= _REPEATING:
        cloud = without_repeats(cloud)
    facts = replace(facts, dropped_repeated=count - len(cloud))
    told = require_room(cloud.points, room, facts)
    facts = replace(facts, warnings=(*facts.warnings, *told))
    panoramas = read_panoramas(scans, cloud.origin)
    if room.stations == "auto":
        return RoomScan(cloud, found, panoramas, facts)
    given = np.array(room.stations, np.float64) - cloud.origin
    if len(found) != len(given):
        cloud = replace(cloud, station=np.full_like(cloud.station, -1))
    return RoomScan(cloud, given, panoramas, facts)


def _require_unchanged(folder: Path, stamps: Mapping[str, str]) -> None:
    for file, stamp in stamps.items():
        there = local(folder, file).exists()
        if not there or stamp_of(local(folder, file)) != stamp:
            raise InputError(
                f"scan `{file}`: expected it as it was when the build began, "
                f"found it {'changed' if there else 'gone'}",
                "build again when it is whole",
            )


def stations_of(scan: RoomScan, settings: stations.Settings) -> Float64:
    """The stations as given, or as the scan tells, or as found."""
    if len(scan.stations):
        return scan.stations
    return stations.find_stations(scan.cloud.points, settings)


def owning(room: Room) -> Owning:
    """Which points of a room show neither in a picture nor in the surface."""
    asked = (room.texture.texel_mm, room.surface.detail_mm, room.clean.thin_mm)
    voxel_mm, widest_mm = (min(each, *filter(None, asked)) for each in CROWDED_MM)
    return Owning(ownership.Settings(), crowding.Settings(voxel_mm / 1000, widest_mm / 1000))


def owned(scan: RoomScan, places: Float64, settings: Owning) -> Stationed:
    """Thin what is crowded, and tell who measured each point, where the scan has forgotten."""
    cloud = scan.cloud
    kept = crowding.crowding(cloud.points, settings.crowds)
    left = cloud if len(kept) == len(cloud) else cloud.take(kept)
    if not len(places) or np.all(left.station >= 0):
        return Stationed(left, places)
    found = ownership.ownership(cloud.points, places, settings.grids, kept)
    return Stationed(replace(left, station=found.station), found.stations)


def registered(scan: Stationed, settings: register.Settings) -> register.Registered:
    """Bring the stations together."""
    return register.register(scan.cloud, scan.stations, settings)


def sifted(joined: register.Registered, settings: sift.Settings) -> sift.Sifted:
    """Drop what is not there."""
    return sift.sift(joined.cloud, joined.stations, settings)


def exposed(
    kept: sift.Sifted, joined: register.Registered, settings: exposure.Settings
) -> PointCloud:
    """Bring the stations' colours into agreement, and drop those in glare."""
    return exposure.exposure(kept.cloud, joined.stations, settings)


def moved(panoramas: tuple[Panorama, ...], joined: register.Registered) -> tuple[Panorama, ...]:
    """The panoramas moved along with the stations that they were taken from."""
    if not len(joined.stations):
        return panoramas
    before = np.einsum("sji,sj->si", joined.rotations, joined.stations - joined.translations)
    out = []
    for each in panoramas:
        nearest = int(np.linalg.norm(before - each.position, axis=1).argmin())
        turn, shift = joined.rotations[nearest], joined.translations[nearest]
        out.append(
            replace(each, position=turn @ each.position + shift, rotation=turn @ each.rotation)
        )
    return tuple(out)


def spaced(kept: sift.Sifted) -> Spacing:
    """Estimate how far apart the points lie."""
    return spacing(kept.cloud)


def thinned(kept: sift.Sifted, spacing: Spacing, asked: Thinning) -> PointCloud:
    """Thin to half the detail, so that each cell of the octree keeps several points.

    A scan denser than the detail is thinned further, toward a point a cell: each is the mean of
    so many that more would only cost.

    Raises:
        InputError: No room can be made of so few points, or with such a detail.
    """
    spacing_mm = 1000 * spacing.median_m
    if not _SPACING_MM[0] <= spacing_mm <= _SPACING_MM[1]:
        raise InputError(
            f"scan: expected points {_SPACING_MM[0]:g} to {_SPACING_MM[1]:g} mm apart in the "
            f"middle, found {spacing_mm:.2g} mm",
            "check the export and `unit`",
        )
    cloud = kept.cloud
    most_mm = 100 * float(np.ptp(cloud.points, axis=0).max())
    if asked.detail_mm and asked.detail_mm > most_mm:
        raise InputError(
            f"surface.detail_mm: expected 1 to {most_mm:.3g}, a tenth of the room, "
            f"found {asked.detail_mm:g}",
            "leave it out: it follows from the scan",
        )
    detail = detail_m(spacing, asked.detail_mm)
    voxel_m = max(detail / 2, detail - spacing.median_m / 2)
    voxel_m = asked.thin_mm / 1000 if asked.thin_mm else voxel_m
    left = thin.thin(cloud, thin.Settings(voxel_m))
    if len(left) < _LEAST_POINTS:
        raise InputError(
            f"surface: expected {_LEAST_POINTS} points or more, found {len(left)} once they were "
            f"thinned to {1000 * voxel_m:.3g} mm",
            "lower `surface.detail_mm` or `clean.thin_mm`",
        )
    return left


def oriented(
    cloud: PointCloud, joined: register.Registered, settings: normals.Settings
) -> OrientedCloud:
    """Estimate normals, turned toward the free space."""
    return normals.normals(cloud, joined.stations, settings)


def floored(oriented: OrientedCloud, spacing: Spacing) -> OrientedCloud:
    """Lay the floor under the tripods as densely as the scan is."""
    return floor.floor(oriented, floor.Settings(spacing.median_m))
