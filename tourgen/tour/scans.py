"""The scans that a tour file names, as far as their headers tell."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tourgen.errors import Faults, InputError
from tourgen.remote import local
from tourgen.scans import Scan, open_scan
from tourgen.tour.tables import Room, ScanRef, Tour


def open_scans(room: Room, folder: Path) -> tuple[Scan, ...]:
    """Read the headers of a room's scans.

    Args:
        room: The room.
        folder: Where its paths start.

    Raises:
        InputError: A scan cannot be read; the first one that cannot.
    """
    return tuple(_open(room, scan, folder) for scan in room.scans)


def check_scans(tour: Tour) -> tuple[str, ...]:
    """Read the headers of all scans.

    Returns:
        What the publisher should know although a build will succeed, one line each.

    Raises:
        Faults: Every scan that cannot be read, every room of too few points.
    """
    faults, warnings = check_headers(tour.rooms, tour.folder)
    if faults:
        raise Faults(faults)
    return warnings


def check_headers(
    rooms: Iterable[Room], folder: Path
) -> tuple[tuple[InputError, ...], tuple[str, ...]]:
    """Faults and warnings of the scans of these rooms, of which paths start in a folder."""
    faults: list[InputError] = []
    warnings: list[str] = []
    for room in rooms:
        scans: list[Scan] = []
        for reference in room.scans:
            try:
                scans.append(_open(room, reference, folder))
            except InputError as error:
                faults.append(InputError(f"room `{room.id}`: {error.message}", error.hint))
        warnings += (f"room `{room.id}`: {each}" for scan in scans for each in scan.warnings)
        found = sum(scan.point_count for scan in scans)
        if len(scans) == len(room.scans) and found < room.clean.min_points:
            names = " + ".join(f"`{scan.name}`" for scan in scans)
            faults.append(
                InputError(
                    f"room `{room.id}`: scan {names}: expected at least {room.clean.min_points} "
                    f"points, found {found}",
                    "check the export, or lower `clean.min_points`",
                )
            )
    return tuple(faults), tuple(warnings)


def _open(room: Room, scan: ScanRef, folder: Path) -> Scan:
    return open_scan(
        local(folder, scan.file),
        room.unit_m,
        room.up,
        name=scan.file,
        pose=scan.pose,
        station=scan.station,
    )
