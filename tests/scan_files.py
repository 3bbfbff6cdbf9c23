"""Writes scans for tests: PLY of every flavour, E57 with what pye57's own writer leaves out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

SHARED_SCANS = Path(__file__).resolve().parents[2] / "shared" / "scans"

_PLY_TYPES = {
    "i1": "char",
    "u1": "uchar",
    "i2": "short",
    "u2": "ushort",
    "i4": "int",
    "u4": "uint",
    "f4": "float",
    "f8": "double",
}


def ply_header(
    form: str, count: int, columns: Sequence[tuple[str, str]], newline: str = "\n", extra: str = ""
) -> bytes:
    """A header with one element `vertex`; `extra` is put in before the end, a line or more."""
    lines = [
        "ply",
        f"format {form} 1.0",
        "comment element vertex 3 is not meant here",
        "obj_info made for a test",
        f"element vertex {count}",
        *(f"property {_PLY_TYPES[kind]} {name}" for name, kind in columns),
        *([extra] if extra else []),
        "end_header",
        "",
    ]
    return newline.join(lines).encode()


def write_ply(
    path: Path,
    table: Mapping[str, npt.NDArray[Any]],
    form: str = "binary_little_endian",
    newline: str = "\n",
) -> Path:
    """A PLY with these columns, each in its array's type."""
    columns = [(name, values.dtype.str[1:]) for name, values in table.items()]
    count = len(next(iter(table.values())))
    if form == "ascii":
        rows = zip(*(values.tolist() for values in table.values()), strict=True)
        body = "".join(" ".join(map(repr, row)) + newline for row in rows).encode()
    else:
        order = "<" if form == "binary_little_endian" else ">"
        records = np.zeros(count, [(name, order + kind) for name, kind in columns])
        for name, values in table.items():
            records[name] = values
        body = records.tobytes()
    path.write_bytes(ply_header(form, count, columns, newline) + body)
    return path


def cloud_table(points: npt.NDArray[Any], colors: npt.NDArray[Any] | None = None) -> dict[str, Any]:
    """Columns x, y, z and, with colours, red, green, blue."""
    table = {name: points[:, i] for i, name in enumerate("xyz")}
    if colors is not None:
        table |= {name: colors[:, i] for i, name in enumerate(("red", "green", "blue"))}
    return table


@dataclass(frozen=True)
class E57Part:
    """One scan of an E57 file.

    Attributes:
        fields: Values by the standard's names of fields; written as doubles.
        rotation: w, x, y, z; and
        translation: x, y, z: the pose; left out where None.
        color_maximum: Written as the colour limits; left out where None.
    """

    fields: Mapping[str, npt.NDArray[np.float64]]
    rotation: Sequence[float] | None = None
    translation: Sequence[float] | None = None
    color_maximum: float | None = None


def write_e57(path: Path, parts: Sequence[E57Part]) -> Path:
    """An E57 file of these scans."""
    from pye57 import libe57

    file = libe57.ImageFile(str(path), "w")
    file.extensionsAdd("", libe57.E57_V1_0_URI)
    root = file.root()
    root.set("formatName", libe57.StringNode(file, "ASTM E57 3D Imaging Data File"))
    root.set("guid", libe57.StringNode(file, "{00000000-0000-0000-0000-000000000000}"))
    root.set("versionMajor", libe57.IntegerNode(file, 1))
    root.set("versionMinor", libe57.IntegerNode(file, 0))
    data = libe57.VectorNode(file, True)
    root.set("data3D", data)

    def numbers(values: Mapping[str, float]) -> Any:
        node = libe57.StructureNode(file)
        for name, value in values.items():
            node.set(name, libe57.FloatNode(file, float(value)))
        return node

    for part in parts:
        scan = libe57.StructureNode(file)
        scan.set("guid", libe57.StringNode(file, "{00000000-0000-0000-0000-000000000001}"))
        if part.rotation is not None or part.translation is not None:
            pose = libe57.StructureNode(file)
            scan.set("pose", pose)
            # the order of the standard's text is not a rule: names are
            if part.translation is not None:
                pose.set(
                    "translation", numbers(dict(zip("zyx", part.translation[::-1], strict=True)))
                )
            if part.rotation is not None:
                pose.set("rotation", numbers(dict(zip("zyxw", part.rotation[::-1], strict=True))))
        if part.color_maximum is not None:
            names = [f"color{name}Maximum" for name in ("Red", "Green", "Blue")]
            scan.set("colorLimits", numbers(dict.fromkeys(names, part.color_maximum)))
        prototype = libe57.StructureNode(file)
        for name in part.fields:
            prototype.set(name, libe57.FloatNode(file, 0.0))
        points = libe57.CompressedVectorNode(file, prototype, libe57.VectorNode(file, True))
        scan.set("points", points)
        data.append(scan)
        count = len(next(iter(part.fields.values())))
        columns = {name: np.ascontiguousarray(v, np.float64) for name, v in part.fields.items()}
        buffers = libe57.VectorSourceDestBuffer()
        for name, column in columns.items():
            buffers.append(libe57.SourceDestBuffer(file, name, column, count, True, True))
        writer = points.writer(buffers)
        writer.write(count)
        writer.close()
    file.close()
    return path


def xyz_fields(points: npt.NDArray[np.float64]) -> dict[str, npt.NDArray[np.float64]]:
    """Cartesian fields."""
    return {f"cartesian{axis}": points[:, i] for i, axis in enumerate("XYZ")}


def rgb_fields(colors: npt.NDArray[Any]) -> dict[str, npt.NDArray[np.float64]]:
    """Colour fields."""
    return {
        f"color{name}": colors[:, i].astype(np.float64)
        for i, name in enumerate(("Red", "Green", "Blue"))
    }
