"""PLY: ASCII and binary of both byte orders, read in chunks.

Own code, because trimesh, Open3D and plyfile each read a file whole: a scan of 15 million points
would lie in memory two or three times over before the first one is cropped. What is left to do is
little: a header, then records of one size, which numpy reads itself (`fromfile` and `loadtxt`).

Format: Greg Turk, "The PLY Polygon File Format", 1994; the names of types and properties are
those that CloudCompare, MeshLab, PDAL, Open3D and surveyors' programs write.
"""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np
import numpy.typing as npt

from tourgen.errors import InputError
from tourgen.geometry import UInt8
from tourgen.scans.scan import CHUNK_POINTS, Chunk, Source, color_range, to_8_bit

_TYPES: Final = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_ORDERS: Final = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST_HEADER: Final = 1 << 20
_COLOR: Final = re.compile(r"(?P<prefix>.*?)(?P<channel>red|green|blue|r|g|b)")


@dataclass(frozen=True, slots=True)
class _Property:
    """One column; a list has the type of its length before the type of its items."""

    name: str
    type: str
    length_type: str = ""


@dataclass(frozen=True, slots=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]

    @property
    def has_lists(self) -> bool:
        return any(column.length_type for column in self.properties)

    def record(self, order: str) -> np.dtype[np.void]:
        """One record of an element without lists; columns are named by position."""
        return np.dtype([(str(i), order + column.type) for i, column in enumerate(self.properties)])


@dataclass(frozen=True, slots=True)
class _Header:
    """A header: byte order ("" for ASCII), elements, and the byte at which the data start."""

    order: str
    elements: tuple[_Element, ...]
    end: int


def open_ply(path: Path) -> Source:
    """Read the header of a PLY file.

    Raises:
        InputError: It is no PLY file, has no points, no positions, or is shorter than it says.
    """
    with path.open("rb") as file:
        header = _read_header(file)
        vertex = next((e for e in header.elements if e.name == "vertex"), None)
        if vertex is None:
            raise InputError("expected an element `vertex`, found none")
        if vertex.has_lists:
            raise InputError("expected numbers as properties of a vertex, found a list")
        xyz = _columns(vertex, ("x", "y", "z"))
        if xyz is None:
            names = ", ".join(column.name for column in vertex.properties)
            raise InputError(f"expected properties x, y and z, found {names or 'none'}")
        before = list(itertools.takewhile(lambda e: e is not vertex, header.elements))
        start = _skip(file, header, before)
        _check_length(path.stat().st_size - start, header.order, vertex)
    rgb = _color_columns(vertex)
    reader = _Reader(path, header.order, vertex, start, (*xyz, *(rgb or ())))
    return Source(
        point_count=vertex.count,
        has_color=rgb is not None,
        stations=np.empty((0, 3)),
        read=reader.chunks,
    )


# ------------------------------------------------------------------ header


def _read_header(file: BinaryIO) -> _Header:
    text = file.read(_LONGEST_HEADER)
    if not text:
        raise InputError("expected a PLY file, found an empty file", "export it again")
    if not re.match(rb"ply[ \t]*[\r\n]", text):
        raise InputError("expected a PLY file, found another format", "export it as PLY")
    end = re.search(rb"[\r\n][ \t]*end_header[ \t]*(\r\n|\n|\r|$)", text)
    if end is None:
        raise InputError("expected `end_header`, found none", "export it again")
    # a lone carriage return ends a line only where the header has no line feeds at all; the
    # byte after the header may be a line feed by chance
    stop = end.end()
    if end[1] == b"\r\n" and b"\n" not in text[: end.start(1)]:
        stop -= 1
    lines = text[: end.start()].decode("latin-1").splitlines()
    order, elements = "?", list[_Element]()
    for line in lines[1:]:
        match line.split():
            case ["format", name, *_]:
                order = _ORDERS.get(name, "?")
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count), ()))
            case ["property", *words] if elements:
                last = elements[-1]
                columns = (*last.properties, _parse_property(line, words))
                elements[-1] = _Element(last.name, last.count, columns)
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise InputError(f"expected a line of a PLY header, found `{line.strip()[:60]}`")
    if order == "?":
        raise InputError(f"expected a format among {', '.join(_ORDERS)}, found none of them")
    return _Header(order, tuple(elements), stop)


def _parse_property(line: str, words: Sequence[str]) -> _Property:
    match words:
        case ["list", length_type, item_type, name] if {length_type, item_type} <= _TYPES.keys():
            return _Property(name, _TYPES[item_type], _TYPES[length_type])
        case [item_type, name] if item_type in _TYPES:
            return _Property(name, _TYPES[item_type])
        case _:
            raise InputError(f"expected a property of a known type, found `{line.strip()[:60]}`")


def _columns(vertex: _Element, names: Sequence[str]) -> tuple[int, ...] | None:
    """Positions of the columns of these names, whatever their case; None if one is missing."""
    known = [column.name.lower() for column in vertex.properties]
    return tuple(map(known.index, names)) if set(names) <= set(known) else None


def _color_columns(vertex: _Element) -> tuple[int, ...] | None:
    """Red, green and blue under one prefix: red, r, diffuse_red, ..., the shortest prefix first."""
    found: dict[tuple[str, bool], dict[str, int]] = {}
    for position, column in enumerate(vertex.properties):
        match = _COLOR.fullmatch(column.name.lower())
        if match and (not match["prefix"] or match["prefix"][-1] in "_-."):
            family = (match["prefix"], len(match["channel"]) == 1)
            found.setdefault(family, {})[match["channel"][0]] = position
    whole = sorted(family for family, columns in found.items() if len(columns) == 3)
    if not whole:
        return None
    best = min(whole, key=lambda family: len(family[0]))
    return tuple(found[best][channel] for channel in "rgb")


# ------------------------------------------------------------------ data


def _check_length(size: int, order: str, vertex: _Element) -> None:
    """Tell a truncated file before it is read; of ASCII only what is certain."""
    if order:
        holds = size // vertex.record(order).itemsize
        found = str(holds)
    else:
        holds = (size + 1) // (2 * len(vertex.properties))  # a digit and a space each
        found = f"room for {holds}"
    if holds < vertex.count:
        raise _truncated(vertex.count, found)


def _skip(file: BinaryIO, header: _Header, elements: Sequence[_Element]) -> int:
    """The byte at which the data behind `elements` start."""
    file.seek(header.end)
    for element in elements:
        if not header.order:
            for _ in range(element.count):
                file.readline()
        elif not element.has_lists:
            file.seek(element.count * element.record(header.order).itemsize, 1)
        else:
            for _ in range(element.count):
                _skip_record(file, header.order, element)
    return file.tell()


def _skip_record(file: BinaryIO, order: str, element: _Element) -> None:
    for column in element.properties:
        size = np.dtype(column.type).itemsize
        if column.length_type:
            length_type = np.dtype(order + column.length_type)
            length = file.read(length_type.itemsize)
            if len(length) < length_type.itemsize:
                raise InputError(
                    f"expected {element.count} records of `{element.name}`, found fewer",
                    "the file is truncated: copy or export it again",
                )
            size *= max(0, int(np.frombuffer(length, length_type)[0]))
        file.seek(size, 1)


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads the vertices of one file.

    Attributes:
        path: The file.
        order: Byte order, "" for ASCII.
        vertex: The element.
        start: The byte at which the vertices start.
        columns: Positions of x, y, z and, where there are colours, red, green and blue.
    """

    path: Path
    order: str
    vertex: _Element
    start: int
    columns: tuple[int, ...]

    def chunks(self) -> Iterator[Chunk]:
        """Yield the vertices, in the file's unit and axes."""
        full = self._full_brightness()
        for table in self._tables(self.columns):
            count = len(table[0])
            points = np.stack([np.asarray(column, np.float64) for column in table[:3]], axis=1)
            yield Chunk(
                points,
                self._colors(table[3:], full) if len(table) > 3 else None,
                np.full(count, -1, np.int16),
            )

    def _colors(self, channels: Sequence[npt.NDArray[np.generic]], full: float) -> UInt8:
        return to_8_bit(np.stack(channels, axis=1), full)

    def _full_brightness(self) -> float:
        """255 for bytes; else by the highest value of the whole file: 1, 255 or 65535."""
        rgb = self.columns[3:]
        if all(self.vertex.properties[i].type in ("u1", "i1") for i in rgb):
            return 255.0
        highest = 0.0
        for table in self._tables(rgb):
            for channel in table:
                values = np.asarray(channel, np.float64)
                highest = max(highest, values[np.isfinite(values)].max(initial=0.0))
        return color_range(highest)

    def _tables(self, columns: Sequence[int]) -> Iterator[list[npt.NDArray[np.generic]]]:
        """The columns asked for, a chunk of rows at a time."""
        read = self._binary if self.order else self._ascii
        count = 0
        for table in read(columns):
            count += len(table[0])
            yield table
        if count < self.vertex.count:
            raise _truncated(self.vertex.count, str(count))

    def _binary(self, columns: Sequence[int]) -> Iterator[list[npt.NDArray[np.generic]]]:
        record = self.vertex.record(self.order)
        with self.path.open("rb") as file:
            file.seek(self.start)
            for size in self._sizes():
                rows = np.fromfile(file, record, size)
                # some programs declare bytes of colour as `char`
                yield [
                    rows[str(i)].view(np.uint8) if record[i] == np.int8 and i in self.columns[3:]
                    else rows[str(i)]
                    for i in columns
                ]  # fmt: skip

    def _ascii(self, columns: Sequence[int]) -> Iterator[list[npt.NDArray[np.generic]]]:
        with self.path.open("rb") as file:
            file.seek(self.start)
            with io.TextIOWrapper(file, encoding="latin-1", newline=None) as text:
                lines = _Lines(text)
                for size in self._sizes():
                    rows = itertools.islice(lines, size)
                    first = next(rows, None)
                    if first is None:
                        return
                    chunk = itertools.chain([first], rows)
                    try:
                        table = np.loadtxt(chunk, usecols=columns, comments=None, ndmin=2)
                    except ValueError:
                        raise self._unreadable(lines) from None
                    yield list(table.T)

    def _unreadable(self, lines: _Lines) -> InputError:
        """What is to be said of the line that was read last."""
        number, line = lines.number, lines.last
        if next(lines, None) is None:
            return _truncated(self.vertex.count, str(number - 1))
        shown = "".join(letter if letter.isprintable() else "?" for letter in line.strip()[:40])
        return InputError(
            f"expected {len(self.vertex.properties)} numbers for point {number}, found `{shown}`"
        )

    def _sizes(self) -> Iterator[int]:
        for first in range(0, self.vertex.count, CHUNK_POINTS):
            yield min(CHUNK_POINTS, self.vertex.count - first)


class _Lines:
    """The lines of a text that are not blank.

    Attributes:
        number: How many were read.
        last: The one that was read last.
    """

    def __init__(self, text: Iterable[str]) -> None:
        self._lines = (line for line in text if not line.isspace())
        self.number = 0
        self.last = ""

    def __iter__(self) -> _Lines:
        return self

    def __next__(self) -> str:
        self.last = next(self._lines)
        self.number += 1
        return self.last


def _truncated(expected: int, found: str) -> InputError:
    return InputError(
        f"expected {expected} points, found {found}",
        "the file is truncated: copy or export it again",
    )
