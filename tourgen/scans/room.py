"""Reads the scans of a room into one cloud, cropped on the way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from tourgen.errors import InputError
from tourgen.extent import extent
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
        bounds: (s, 2, 3) float64, metres, lowest and highest corner of what each scan left; NaN
            where that is nothing.
        dropped_repeated: At the very place of another one.
    """

    points_read: int
    dropped_invalid: int
    dropped_cropped: int
    warnings: tuple[str, ...]
    bounds: Float64 = field(default_factory=lambda: np.empty((0, 2, 3)))
    dropped_repeated: int = 0


@dataclass(slots=True)
class _Part:
    """What one of the scans holds, as far as it was read.

    Attributes:
        scan: The scan.
        first: Where its points start in the room's arrays.
        bounds: (2, 3) float64, lowest and highest corner, metres; and
        kept: of what the crop left; NaN where that is nothing.
        colored: Whether points of it have colours, and
        lit: whether one of these is not black.
    """

    scan: Scan
    first: int
    bounds: Float64 = field(default_factory=lambda: np.full((2, 3), np.nan))
    kept: Float64 = field(default_factory=lambda: np.full((2, 3), np.nan))
    colored: bool = False
    lit: bool = False

    def add(self, chunk: Chunk, inside: Chunk) -> None:
        """Take note of a chunk and of what the crop left of it."""
        self.bounds = _spanned(self.bounds, chunk.points)
        self.kept = _spanned(self.kept, inside.points)
        self.colored |= chunk.colors is not None
        self.lit |= chunk.colors is not None and bool(chunk.colors.any())

    @property
    def black(self) -> bool:
        """Whether its colours tell nothing."""
        return self.colored and not self.lit

    @property
    def warnings(self) -> Iterator[str]:
        """What the publisher should know, one line each."""
        yield from self.scan.warnings
        if self.black:
            yield f"scan `{self.scan.name}`: has colours that are all black, its points are grey"
        if np.isnan(self.kept[0, 0]) and not np.isnan(self.bounds[0, 0]):
            yield f"scan `{self.scan.name}`: `keep` and `remove` leave none of its points"


def _spanned(bounds: Float64, points: Float64) -> Float64:
    """Bounds wide enough for more points."""
    if not len(points):
        return bounds
    low, high = extent(points)
    return np.array([np.fmin(bounds[0], low), np.fmax(bounds[1], high)])


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
    parts: list[_Part] = []
    used = invalid = cropped = 0
    for scan, first_station in _numbered(scans):
        part = _Part(scan, used)
        for chunk in scan.chunks():
            if origin is None and len(chunk.points):
                origin = _origin(chunk.points)
            inside = _cropped(chunk, keep, remove)
            end = used + len(inside.points)
            points[used:end] = inside.points if origin is None else inside.points - origin
            colors[used:end] = GREY if inside.colors is None else inside.colors
            known = inside.station >= 0
            station[used:end] = np.where(known, inside.station + first_station, -1)
            invalid += chunk.dropped
            cropped += len(chunk.points) - len(inside.points)
            used = end
            part.add(chunk, inside)
        if part.black:
            colors[part.first : used] = GREY
        parts.append(part)
    facts = ReadFacts(
        points_read=used + invalid + cropped,
        dropped_invalid=invalid,
        dropped_cropped=cropped,
        warnings=tuple(warning for part in parts for warning in part.warnings),
        bounds=np.stack([part.kept for part in parts]),
    )
    if used < max(1, min_points):
        raise _too_few(parts, used, max(1, min_points), facts)
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


def _numbered(scans: Sequence[Scan]) -> Iterator[tuple[Scan, int]]:
    """Each scan with the number of its first station, counted on from those of the scan before."""
    first = 0
    for scan in scans:
        yield scan, first
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


def _corners(bounds: Float64) -> tuple[str, str]:
    """The lowest and the highest of several corners, as tour.toml writes them."""
    low, high = np.nanmin(bounds, axis=0), np.nanmax(bounds, axis=0)
    first, second = (
        ", ".join(f"{value:.2f}" for value in np.round(corner, 2) + 0.0) for corner in (low, high)
    )
    return f"[{first}]", f"[{second}]"


def _too_few(parts: Sequence[_Part], used: int, needed: int, facts: ReadFacts) -> InputError:
    names = " + ".join(f"`{part.scan.name}`" for part in parts)
    causes = [
        f"{count} {why}"
        for count, why in (
            (facts.dropped_invalid, "invalid ones dropped"),
            (facts.dropped_cropped, "cropped away"),
        )
        if count
    ]
    hint = "check the export, or lower `clean.min_points`"
    if facts.dropped_cropped:
        low, high = _corners(np.concatenate([part.bounds for part in parts]))
        hint = f"the points reach from {low} to {high}: check `keep`, `remove`, `unit` and `up`"
    wanted = f"at least {needed} points" if needed > 1 else "points"
    return InputError(
        f"scan {names}: expected {wanted}, found {', '.join([str(used), *causes])}",
        hint,
    )
