"""What every format is read into: a `Scan`, whose points come in chunks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from tourgen.errors import InputError
from tourgen.geometry import Float64, Panorama, UInt8

CHUNK_POINTS: Final = 200_000
"""Points read at a time: 20 MB at work, whatever the size of the scan; larger chunks leave the
processor's cache and are slower."""

FARTHEST_M: Final = 1e8
"""Coordinates beyond this are no place on Earth, in any reference system in use."""

_UP: Final = {
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "x": ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
}


@dataclass(frozen=True, slots=True)
class Chunk:
    """Some points of a scan.

    Attributes:
        points: (n, 3) float64, metres, z up, finite, in the frame of the scan.
        colors: (n, 3) uint8, sRGB; None where the scan has no colour.
        station: (n,) int16, index into the scan's stations, -1 where the scan does not say.
        dropped: How many points beside these were invalid: marked so, not a number, infinite.
    """

    points: Float64
    colors: UInt8 | None
    station: npt.NDArray[np.int16]
    dropped: int = 0


@dataclass(frozen=True, slots=True)
class Source:
    """What a format knows of a file from its header, and the way to its points.

    Attributes:
        point_count: As the header says.
        has_color: Whether the points carry colours.
        stations: (s, 3) float64, where the scanner stood, as far as the file tells.
        read: Yields the points in the file's own unit and axes, invalid ones possibly among them.
        warnings: What the publisher should know, one line each.
        panorama_count: Pictures with a pose, as the header says.
        read_panoramas: Reads those that can be decoded, in the file's own unit and axes.
    """

    point_count: int
    has_color: bool
    stations: Float64
    read: Callable[[], Iterator[Chunk]]
    warnings: tuple[str, ...] = ()
    panorama_count: int = 0
    read_panoramas: Callable[[], tuple[Panorama, ...]] = tuple


@dataclass(frozen=True, slots=True)
class Frame:
    """Carries the file's coordinates into the room's: metres, z up.

    Attributes:
        matrix: (3, 3) float64.
        shift: (3,) float64, metres, applied after `matrix`.
    """

    matrix: Float64 = field(default_factory=lambda: np.eye(3))
    shift: Float64 = field(default_factory=lambda: np.zeros(3))

    @staticmethod
    def of(unit_m: float, up: str, pose: Float64 | None = None) -> Frame:
        """Unit and axis first, then `pose`, a (4, 4) rigid motion in metres."""
        matrix = np.array(_UP[up], dtype=np.float64) * unit_m
        if pose is None:
            return Frame(matrix)
        return Frame(pose[:3, :3] @ matrix, pose[:3, 3].copy())

    def apply(self, points: Float64) -> Float64:
        """(n, 3) to (n, 3); the same array where nothing is to be done."""
        if not self.shift.any() and np.array_equal(self.matrix, np.eye(3)):
            return points
        return points @ self.matrix.T + self.shift

    def turn(self, rotation: Float64) -> Float64:
        """(3, 3) rotation into the file's axes to one into the room's."""
        unit_m = np.cbrt(np.linalg.det(self.matrix))
        return np.asarray(self.matrix / unit_m @ rotation)


@dataclass(frozen=True, slots=True)
class Scan:
    """A scan whose header was read.

    Attributes:
        name: How messages call it.
        point_count: As the header says, invalid points included.
        has_color: Whether the points carry colours.
        stations: (s, 3) float64, metres, z up, in the frame of the scan; empty where unknown.
        warnings: What the publisher should know, one line each.
        source: The file.
        frame: From the file's coordinates to the scan's frame.
        one_station: Whether `stations` was given from outside, for all points.
    """

    name: str
    point_count: int
    has_color: bool
    stations: Float64
    warnings: tuple[str, ...]
    source: Source
    frame: Frame
    one_station: bool

    def chunks(self) -> Iterator[Chunk]:
        """Read the points.

        Raises:
            InputError: The file breaks off, or cannot be read.
        """
        try:
            for raw in self.source.read():
                yield self._placed(raw)
        except InputError as error:
            raise named(error, self.name) from None

    def panoramas(self) -> tuple[Panorama, ...]:
        """Read the pictures that have a pose; positions are in the frame of the scan.

        Raises:
            InputError: The file breaks off, or cannot be read.
        """
        try:
            found = self.source.read_panoramas()
        except InputError as error:
            raise named(error, self.name) from None
        return tuple(
            replace(
                each,
                position=self.frame.apply(each.position[None])[0],
                rotation=self.frame.turn(each.rotation),
            )
            for each in found
        )

    def _placed(self, raw: Chunk) -> Chunk:
        station = np.zeros_like(raw.station) if self.one_station else raw.station
        with np.errstate(invalid="ignore", over="ignore"):
            points = self.frame.apply(raw.points)
            distance = np.abs(points)
            if distance.max(initial=0.0) < FARTHEST_M:  # false if one is not a number
                return Chunk(points, raw.colors, station, raw.dropped)
            valid = np.asarray((distance < FARTHEST_M).all(axis=1))
        return Chunk(
            points[valid],
            None if raw.colors is None else raw.colors[valid],
            station[valid],
            raw.dropped + int(len(valid) - valid.sum()),
        )


def named(error: InputError, name: str) -> InputError:
    """The same error, told of the scan `name`."""
    return InputError(f"scan `{name}`: {error.message}", error.hint)


def color_range(highest: float) -> float:
    """What stands for full brightness where the highest value found is `highest`."""
    return next((full for full in (1.0, 255.0) if highest <= full), 65535.0)


def to_8_bit(colors: npt.NDArray[np.generic], full: float) -> UInt8:
    """(n, 3) colours of any type, `full` being full brightness, to uint8; no number is black."""
    if full == 255.0 and colors.dtype == np.uint8:
        return colors.astype(np.uint8, copy=False)
    within = np.nan_to_num(np.clip(colors, 0, full)).astype(np.float32)
    scaled: UInt8 = np.rint(within * np.float32(255.0 / full)).astype(np.uint8)
    return scaled
