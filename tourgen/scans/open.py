"""Opens a scan by the ending of its name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from tourgen.errors import InputError
from tourgen.scans.e57 import open_e57
from tourgen.scans.ply import open_ply
from tourgen.scans.scan import Frame, Scan, Source, named

FORMATS: Final[Mapping[str, Callable[[Path], Source]]] = {".ply": open_ply, ".e57": open_e57}
"""The formats that can be read, by the ending of the file's name."""


def open_scan(
    path: Path,
    unit_m: float = 1.0,
    up: str = "z",
    *,
    name: str | None = None,
    pose: npt.ArrayLike | None = None,
    station: npt.ArrayLike | None = None,
) -> Scan:
    """Read the header of a scan.

    Args:
        path: The file.
        unit_m: Metres in one unit of its coordinates.
        up: Its axis that points up: "z", "-z", "y", "-y", "x" or "-x".
        name: How messages call the scan; the file's name if left out.
        pose: (4, 4) rigid motion in metres, applied after unit and axis.
        station: (3,) metres, z up, before `pose`: where the scanner stood for all its points.

    Raises:
        InputError: The file cannot be read, or is of no known format.
    """
    name = name or path.name
    try:
        source = _open_format(path)
    except InputError as error:
        raise named(error, name) from None
    matrix = None if pose is None else np.asarray(pose, dtype=np.float64)
    frame = Frame.of(unit_m, up, matrix)
    if station is None:
        stations = frame.apply(source.stations)
    else:
        stations = np.asarray(station, dtype=np.float64).reshape(1, 3)
        if matrix is not None:
            stations = stations @ matrix[:3, :3].T + matrix[:3, 3]
    warnings = list(source.warnings)
    if not source.has_color and source.point_count:
        warnings.append("has no colours, its points are grey")
    return Scan(
        name=name,
        point_count=source.point_count,
        has_color=source.has_color,
        stations=stations,
        warnings=tuple(f"scan `{name}`: {warning}" for warning in warnings),
        source=source,
        frame=frame,
        one_station=station is not None,
    )


def _open_format(path: Path) -> Source:
    open_format = FORMATS.get(path.suffix.lower())
    if open_format is None:
        known = ", ".join(FORMATS)
        raise InputError(
            f"expected a name ending in {known}, found `{path.name}`", "export it in one of these"
        )
    try:
        if path.stat().st_size == 0:
            raise InputError("expected points, found an empty file", "export it again")
        return open_format(path)
    except OSError as error:
        raise InputError(f"expected a file that can be read, found: {error.strerror}") from None
