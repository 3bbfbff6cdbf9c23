"""E57 (ASTM E2807), through libE57Format as pye57 wraps it, block by block.

pye57's own `read_scan` reads a scan whole, refuses fields of extensions, takes the parts of a
pose by their order rather than their names, and knows colours of 8 bits only; so libe57's readers
are called here directly.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from tourgen.errors import InputError
from tourgen.geometry import Float64, Panorama, UInt8
from tourgen.scans.e57_images import count_of, panoramas_of
from tourgen.scans.scan import CHUNK_POINTS, Chunk, Source, color_range, to_8_bit

_CARTESIAN: Final = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL: Final = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLOR: Final = ("colorRed", "colorGreen", "colorBlue")


@dataclass(frozen=True, slots=True)
class _Part:
    """One of the scans in the file.

    Attributes:
        index: Its place in the file.
        count: Points, invalid ones included.
        fields: Names of what each point carries.
        rotation: (3, 3), and
        translation: (3,): from the scanner's frame to the file's.
        station: Index of its station in the file, -1 where it is unknown.
        full: What stands for full brightness of a colour.
    """

    index: int
    count: int
    fields: frozenset[str]
    rotation: Float64
    translation: Float64
    station: int
    full: float

    @property
    def has_color(self) -> bool:
        return self.fields.issuperset(_COLOR)


def open_e57(path: Path) -> Source:
    """Read the headers of the scans in an E57 file.

    Raises:
        InputError: It is no E57 file, is damaged, or has no points.
    """
    with _image_file(path) as file:
        parts = _parts(file)
        pictures = count_of(_pictures(file))
    stations = [part.translation for part in parts if part.station >= 0]
    without = [part.index + 1 for part in parts if not part.has_color]
    some = without and len(without) < len(parts)
    return Source(
        point_count=sum(part.count for part in parts),
        has_color=len(without) < len(parts),
        stations=np.array(stations, dtype=np.float64).reshape(-1, 3),
        read=lambda: _read(path, parts),
        warnings=(f"scan {', '.join(map(str, without))} in it has no colour",) if some else (),
        panorama_count=pictures,
        read_panoramas=lambda: _read_panoramas(path),
    )


def _pictures(file: Any) -> Any:
    root = file.root()
    return root["images2D"] if root.isDefined("images2D") else ()


def _read_panoramas(path: Path) -> tuple[Panorama, ...]:
    with _image_file(path) as file:
        return panoramas_of(_pictures(file), _pose)


@contextmanager
def _image_file(path: Path) -> Iterator[Any]:
    """The open file; whatever libe57 says against it becomes one line."""
    from pye57 import libe57

    try:
        file = libe57.ImageFile(str(path), "r")
        try:
            yield file
        finally:
            file.close()
    except (libe57.E57Exception, RuntimeError) as error:
        reason = str(error).strip().splitlines()[0].split(" (Error")[0]
        raise InputError(
            f"expected an E57 file that can be read, found: {reason[:1].lower()}{reason[1:]}",
            "copy or export it again",
        ) from None


# ------------------------------------------------------------------ headers


def _parts(file: Any) -> tuple[_Part, ...]:
    root = file.root()
    nodes = root["data3D"] if root.isDefined("data3D") else ()
    if not len(nodes):
        raise InputError("expected at least one scan in the file, found none")
    poses = [_pose(nodes[index]) for index in range(len(nodes))]
    apart = any(not np.array_equal(translation, poses[0][1]) for _, translation in poses)
    parts: list[_Part] = []
    stations = 0
    for index, pose in enumerate(poses):
        part = _part(nodes[index], index, pose, apart, stations)
        stations += part.station >= 0
        parts.append(part)
    return tuple(parts)


def _part(
    node: Any, index: int, pose: tuple[Float64, Float64], apart: bool, stations: int
) -> _Part:
    from pye57 import libe57

    points = node["points"]
    prototype = libe57.StructureNode(points.prototype())
    fields = frozenset(prototype[i].elementName() for i in range(len(prototype)))
    if not (fields.issuperset(_CARTESIAN) or fields.issuperset(_SPHERICAL)):
        raise InputError(
            f"expected cartesian or spherical coordinates, found {', '.join(sorted(fields))}"
        )
    rotation, translation = pose
    return _Part(
        index=index,
        count=int(points.childCount()),
        fields=fields,
        rotation=rotation,
        translation=translation,
        station=stations if apart or _is_measured_from_origin(node, fields) else -1,
        full=_full_brightness(node, prototype) if fields.issuperset(_COLOR) else 255.0,
    )


def _is_measured_from_origin(node: Any, fields: frozenset[str]) -> bool:
    """Whether the origin of the scan's own frame is where the scanner stood.

    It is for a scan on the scanner's grid (rows and columns) or in spherical coordinates, and
    where the scans of a file have their poses in different places. For others the origin is just
    where a program put it: merged clouds are written with an identity pose too, or with a pose
    that only carries a shift of the coordinates.
    """
    on_grid = {"rowIndex", "columnIndex"} <= fields
    return on_grid or fields.issuperset(_SPHERICAL) or node.isDefined("sphericalBounds")


def _pose(node: Any) -> tuple[Float64, Float64]:
    """Rotation matrix and translation; either may be left out of the file."""
    if not node.isDefined("pose"):
        return np.eye(3), np.zeros(3)
    pose = node["pose"]
    w, x, y, z = _numbers(pose, "rotation", "wxyz")
    translation = np.array(_numbers(pose, "translation", "xyz"))
    norm = w * w + x * x + y * y + z * z
    if not (np.isfinite(norm) and np.isfinite(translation).all()):
        raise InputError("expected a pose of finite numbers, found others")
    if norm == 0.0:
        return np.eye(3), translation
    s = 2.0 / norm
    rotation = np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
            [s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)],
            [s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)],
        ]
    )
    return rotation, translation


def _numbers(node: Any, name: str, keys: str) -> list[float]:
    if not node.isDefined(name):
        return [0.0] * len(keys)
    table = node[name]
    return [float(table[key].value()) if table.isDefined(key) else 0.0 for key in keys]


def _full_brightness(node: Any, prototype: Any) -> float:
    """From the scan's colour limits, else from the range of the field's type."""
    if node.isDefined("colorLimits"):
        limits = node["colorLimits"]
        names = [f"{name}Maximum" for name in _COLOR]
        highest = [float(limits[name].value()) for name in names if limits.isDefined(name)]
    else:
        channel = prototype[_COLOR[0]]
        scaled = hasattr(channel, "scaledMaximum")
        highest = [float(channel.scaledMaximum() if scaled else channel.maximum())]
    top = max(highest, default=255.0)
    return top if 255.0 < top <= 65535.0 else color_range(min(top, 255.0))


# ------------------------------------------------------------------ points


def _read(path: Path, parts: tuple[_Part, ...]) -> Iterator[Chunk]:
    with _image_file(path) as file:
        for part in parts:
            yield from _read_part(file, part)


def _read_part(file: Any, part: _Part) -> Iterator[Chunk]:
    from pye57 import libe57

    if part.count == 0:
        return
    cartesian = part.fields.issuperset(_CARTESIAN)
    position = _CARTESIAN if cartesian else _SPHERICAL
    state = "cartesianInvalidState" if cartesian else "sphericalInvalidState"
    capacity = min(part.count, CHUNK_POINTS)
    wanted = (*position, *_COLOR, state)
    columns = {name: np.empty(capacity) for name in wanted if name in part.fields}
    buffers = libe57.VectorSourceDestBuffer()
    for name, column in columns.items():
        buffers.append(libe57.SourceDestBuffer(file, name, column, capacity, True, True))
    reader = file.root()["data3D"][part.index]["points"].reader(buffers)
    total = 0
    while count := int(reader.read()):
        total += count
        block = {name: column[:count] for name, column in columns.items()}
        yield _chunk(part, block, position, state)
    reader.close()
    if total < part.count:
        raise InputError(f"expected {part.count} points, found {total}", "export it again")


def _chunk(
    part: _Part, block: dict[str, Float64], position: tuple[str, str, str], state: str
) -> Chunk:
    points = np.stack([block[name] for name in position], axis=1)
    if position == _SPHERICAL:
        points = _to_cartesian(points)
    valid = np.ones(len(points), np.bool_)
    if part.station >= 0:  # a return without range lies in the scanner itself
        valid &= points.any(axis=1)
    if state in block:
        valid &= block[state] == 0
    colors: UInt8 | None = None
    if part.has_color:
        colors = to_8_bit(np.stack([block[name] for name in _COLOR], axis=1), part.full)[valid]
    return Chunk(
        points[valid] @ part.rotation.T + part.translation,
        colors,
        np.full(int(valid.sum()), part.station, np.int16),
        int(len(valid) - valid.sum()),
    )


def _to_cartesian(spherical: Float64) -> Float64:
    """(n, 3) range, azimuth, elevation in radians, to x, y, z."""
    distance, azimuth, elevation = spherical.T
    flat = distance * np.cos(elevation)
    return np.stack(
        [flat * np.cos(azimuth), flat * np.sin(azimuth), distance * np.sin(elevation)], axis=1
    )
