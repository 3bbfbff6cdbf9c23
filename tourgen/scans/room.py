"""Reads the scans of a room into one cloud, cropped on the way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from tourgen.errors import InputError
from tourgen.geometry import Float64, Panorama, PointCloud
from tourgen.scans.scan import Chunk, Scan

NEAR_M: Final = 100.0
"""A scan farther from zero than this gets an origin of its own: float32 steps by 8 µm there."""

GREY: Final = 160
"""The colour of points without one."""


class Box(Protocol):
    """A box along the axes, metres, in the frame of the scan."""

    @property
    def min(self) -> tuple[float, float, float]:
        """The lowest corner."""

    @property
    def max(self) -> tuple[float, float, float]:
        """The highest corner."""


@dataclass(frozen=True, slots=True)
class ReadFacts:
    """What became of the points.

    Attributes:
        points_read: In the files.
        dropped_invalid: Marked as invalid, not a number, or infinite.
        dropped_cropped: Outside `keep` or inside a box of `remove`.
        warnings: What the publisher should know, one line each.
    """

    points_read: int
    dropped_invalid: int
    dropped_cropped: int
    warnings: tuple[str, ...]


def read_room(
    scans: Sequence[Scan],
    keep: Box | None = None,
    remove: Sequence[Box] = (),
    min_points: int = 1,
) -> tuple[PointCloud, Float64, ReadFacts]:
    """Read all scans of a room, in their order.

    The arrays are made once, as long as the headers say, and filled chunk by chunk; pages that
    cropped points would have filled are never touched, so that memory is 17 bytes a kept point
    and one chunk.

    Args:
        scans: At least one, in one frame.
        keep: Points outside are dropped; its faces belong to it.
        remove: Points inside are dropped.
        min_points: Fewer points than this are an error.

    Returns:
        The cloud; the stations (s, 3), metres from the cloud's origin, which the cloud's
        `station` counts through; and what became of the points. The origin is zero unless the
        scans lie more than 100 m away; then it is the whole metre below the median of the first
        chunk (strays move a corner of the box, never the median; a crop moves neither).

    Raises:
        InputError: A scan cannot be read, or too few points are left.
    """
    capacity = sum(scan.point_count for scan in scans)
    points = np.empty((capacity, 3), np.float32)
    colors = np.empty((capacity, 3), np.uint8)
    station = np.empty(capacity, np.int16)
    origin: Float64 | None = None
    used = invalid = cropped = 0
    for chunk in _numbered(scans):
        if origin is None and len(chunk.points):
            origin = _origin(chunk.points)
        inside = _cropped(chunk, keep, remove)
        part = slice(used, used + len(inside.points))
        points[part] = inside.points if origin is None else inside.points - origin
        colors[part] = GREY if inside.colors is None else inside.colors
        station[part] = inside.station
        invalid += chunk.dropped
        cropped += len(chunk.points) - len(inside.points)
        used = part.stop
    facts = ReadFacts(
        points_read=used + invalid + cropped,
        dropped_invalid=invalid,
        dropped_cropped=cropped,
        warnings=tuple(warning for scan in scans for warning in scan.warnings),
    )
    if used < max(1, min_points):
        raise _too_few(scans, used, max(1, min_points), facts)
    if origin is None:
        origin = np.zeros(3)
    cloud = PointCloud(origin, points[:used], colors[:used], station[:used])
    stations = np.concatenate([np.empty((0, 3)), *(scan.stations for scan in scans)]) - origin
    return cloud, stations, facts


def read_panoramas(scans: Sequence[Scan], origin: Float64) -> tuple[Panorama, ...]:
    """The panoramas of a room's scans that have a pose.

    Args:
        scans: In one frame.
        origin: (3,) of the room's cloud; positions come out from there.

    Raises:
        InputError: A scan cannot be read.
    """
    return tuple(
        replace(each, position=each.position - origin)
        for scan in scans
        for each in scan.panoramas()
    )


def _numbered(scans: Sequence[Scan]) -> Iterator[Chunk]:
    """All chunks, the stations of one scan numbered on from those of the scan before."""
    first = 0
    for scan in scans:
        for chunk in scan.chunks():
            known = chunk.station >= 0
            station = np.where(known, chunk.station + first, -1).astype(np.int16)
            yield Chunk(chunk.points, chunk.colors, station, chunk.dropped)
        first += len(scan.stations)


def _origin(points: Float64) -> Float64:
    middle = np.median(points, axis=0)
    return np.floor(middle) if np.abs(middle).max() > NEAR_M else np.zeros(3)


def _cropped(chunk: Chunk, keep: Box | None, remove: Sequence[Box]) -> Chunk:
    if keep is None and not remove:
        return chunk
    inside = np.ones(len(chunk.points), np.bool_)
    if keep is not None:
        inside &= _within(chunk.points, keep)
    for box in remove:
        inside &= ~_within(chunk.points, box)
    colors = None if chunk.colors is None else chunk.colors[inside]
    return Chunk(chunk.points[inside], colors, chunk.station[inside])


def _within(points: Float64, box: Box) -> npt.NDArray[np.bool_]:
    within = np.ones(len(points), np.bool_)
    for axis in range(3):  # by columns: reductions over rows of three are slow
        column = points[:, axis]
        within &= (column >= box.min[axis]) & (column <= box.max[axis])
    return within


def _too_few(scans: Sequence[Scan], used: int, needed: int, facts: ReadFacts) -> InputError:
    names = " + ".join(f"`{scan.name}`" for scan in scans)
    causes = [
        f"{count} {why}"
        for count, why in (
            (facts.dropped_invalid, "invalid ones dropped"),
            (facts.dropped_cropped, "cropped away"),
        )
        if count
    ]
    hint = (
        "check `keep`, `remove`, `unit` and `up`"
        if facts.dropped_cropped
        else "check the export, or lower `clean.min_points`"
    )
    wanted = f"at least {needed} points" if needed > 1 else "points"
    return InputError(
        f"scan {names}: expected {wanted}, found {', '.join([str(used), *causes])}",
        hint,
    )
