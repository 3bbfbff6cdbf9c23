"""All that tour.toml may say: every key once, with its type, its range and its meaning.

`load_tour` reads a tour file and tells every fault of it at once, in the order of the file. The
checks that need more than one key (a link's target, a text's language, a file that must exist)
are validators of the key itself, fed by a context, so that one fault never hides another.

Coordinates are in the frame of the scan after `unit` and `up` were applied: metres, right-handed,
z up. Paths are relative to the folder of the tour file.
"""

from __future__ import annotations

import difflib
import os
import re
import tomllib
import types
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final, Literal, TypeVar, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from tourgen.errors import Faults, InputError
from tourgen.scans import Scan, open_scan

TOUR_FILE: Final = "tour.toml"
UNITS: Final[Mapping[str, float]] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048}

_READING_KEYS = {"id", "scans", "unit", "up", "clean"}
_ROOM_ID = re.compile(r"(?!(con|prn|aux|nul|com\d|lpt\d)$)[a-z0-9][a-z0-9_-]{0,63}")
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
_LANGUAGE = re.compile(r"[a-z]{2,3}(-[A-Za-z0-9]{2,8})*")

Model = TypeVar("Model", bound=BaseModel)


@dataclass
class _Context:
    """What a key is checked against beside its own value.

    Attributes:
        folder: Where the paths start.
        languages: The declared ones; empty where their declaration is itself at fault.
        rooms: Every room id of the file.
        room: Id of the room that is being validated; set by the room before its fields.
        seen: The ids of the rooms validated so far.
    """

    folder: Path
    languages: tuple[str, ...]
    rooms: tuple[str, ...]
    room: object = None
    seen: set[str] = field(default_factory=set)


def _fault(message: str, hint: str = "") -> PydanticCustomError:
    return PydanticCustomError("tour", "{message}", {"message": message, "hint": hint})


def _near(word: str, words: tuple[str, ...]) -> str:
    """The hint that names the one of `words` that looks most like `word`, or ""."""
    match = difflib.get_close_matches(word, words, 1)
    return f"did you mean `{match[0]}`?" if match else ""


def _listed(words: tuple[str, ...]) -> str:
    return f"expected one of {', '.join(words)}" if len(words) != 1 else f"expected {words[0]}"


# ------------------------------------------------------------------ values


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(abs(value) < 1e9)


def _check_position(value: object) -> object:
    if isinstance(value, list | tuple) and len(value) == 3 and all(map(_number, value)):
        return tuple(float(number) for number in value)
    raise _fault(f"expected three numbers [x, y, z], found {_shown(value)}")


def _check_pose(value: object) -> object:
    rows = value if isinstance(value, list | tuple) else ()
    if len(rows) != 4 or not all(
        isinstance(row, list | tuple) and len(row) == 4 and all(map(_number, row)) for row in rows
    ):
        raise _fault(f"expected four rows of four numbers, found {_shown(value)}")
    matrix = np.array(rows, dtype=np.float64)
    turn = matrix[:3, :3]
    rigid = np.allclose(turn @ turn.T, np.eye(3), atol=1e-3) and np.linalg.det(turn) > 0
    if not rigid or not np.allclose(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        raise _fault(
            "expected a rotation and a shift with [0, 0, 0, 1] as its last row, "
            f"found {_shown(value)}",
            "scale by `unit` instead, and turn the axes by `up`",
        )
    return tuple(tuple(float(number) for number in row) for row in matrix)


def _check_stations(value: object) -> object:
    if value == "auto":
        return value
    if isinstance(value, list | tuple) and value:
        return tuple(_check_position(position) for position in value)
    raise _fault(f'expected "auto" or a list of positions [x, y, z], found {_shown(value)}')


def _check_text(value: object, info: ValidationInfo) -> dict[str, str]:
    """A string for every language, or a table; a language without an entry takes the first one."""
    declared = info.context.languages if info.context else ()
    if isinstance(value, str):
        value = dict.fromkeys(declared or ("en",), value)
    if not isinstance(value, dict) or not value:
        raise _fault(f"expected a text or a table of texts by language, found {_shown(value)}")
    for language, text in value.items():
        if declared and language not in declared:
            raise _fault(
                f"language `{language}` is not declared, {_listed(declared)}",
                _near(language, declared) or f"add it to `tour.languages`: {_shown(language)}",
            )
        if not isinstance(text, str) or not text.strip():
            raise _fault(f"expected a text in language `{language}`, found {_shown(text)}")
    texts: dict[str, str] = value
    first = next(texts[language] for language in declared or texts if language in texts)
    return {language: texts.get(language, first) for language in declared or texts}


def _check_file(name: str, info: ValidationInfo) -> str:
    if info.context is None:
        return name
    path = info.context.folder / name
    # of os.path, which holds names that no system can have for missing files
    if not os.path.isfile(path):
        beside = os.listdir(path.parent) if os.path.isdir(path.parent) else ()
        near = difflib.get_close_matches(path.name, beside, 1)
        hint = f"did you mean `{Path(name).with_name(near[0]).as_posix()}`?" if near else ""
        raise _fault(f"expected a file, found none at `{name}`", hint)
    if path.stat().st_size == 0:
        raise _fault(f"expected a file with contents, found `{name}` empty", "export it again")
    return name


def _check_text_files(value: object, info: ValidationInfo) -> dict[str, str]:
    names = _check_text(value, info)
    return {
        language: _check_file(name.replace("{lang}", language), info)
        for language, name in names.items()
    }


def is_room_id(value: str) -> bool:
    """Whether it serves as a folder and an address on every system."""
    return bool(_ROOM_ID.fullmatch(value))


def as_room_id(name: str) -> str:
    """The room id nearest to a name: "Küche 1" becomes "kuche-1"."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    room_id = re.sub(r"[^a-z0-9_]+", "-", plain).strip("-_")[:60]
    return room_id if is_room_id(room_id) else f"room-{room_id}".strip("-")


def _check_room_id(value: str, info: ValidationInfo) -> str:
    if not is_room_id(value):
        safe = as_room_id(value)
        raise _fault(
            "expected a name of a folder and an address: a-z, 0-9, - and _, at most 64 of them, "
            f"found {_shown(value)}",
            f"for example `{safe}`",
        )
    if info.context:
        if value in info.context.seen:
            raise _fault(f"expected a name of its own, found a second room `{value}`")
        info.context.seen.add(value)
    return value


def _check_target(value: str, info: ValidationInfo) -> str:
    if info.context and value not in info.context.rooms:
        raise _fault(f"room `{value}` does not exist", _near(value, info.context.rooms))
    return value


def _check_neighbour(value: str, info: ValidationInfo) -> str:
    if info.context and value == info.context.room:
        raise _fault(f"expected another room, found a link of `{value}` to itself")
    return _check_target(value, info)


def _check_languages(value: tuple[str, ...]) -> tuple[str, ...]:
    for language in value:
        if not _LANGUAGE.fullmatch(language):
            raise _fault(
                f'expected language codes such as "en" or "pt-BR", found {_shown(language)}'
            )
    if len(set(value)) < len(value):
        raise _fault(f"expected each language once, found {_shown(list(value))}")
    return value


def _as_reference(value: object) -> object:
    return {"file": value} if isinstance(value, str) else value


@dataclass(frozen=True)
class Form:
    """How the documentation writes a kind of value."""

    words: str


Number = Annotated[float, Field(strict=True, allow_inf_nan=False), Form("number")]
Whole = Annotated[int, Field(strict=True), Form("whole number")]
Position = Annotated[
    tuple[float, float, float], BeforeValidator(_check_position), Form("`[x, y, z]`")
]
Row = tuple[float, float, float, float]
Pose = Annotated[
    tuple[Row, Row, Row, Row], BeforeValidator(_check_pose), Form("four rows of four numbers")
]
Stations = Annotated[
    Literal["auto"] | tuple[tuple[float, float, float], ...],
    BeforeValidator(_check_stations),
    Form('`"auto"` or a list of `[x, y, z]`'),
]
Text = Annotated[Mapping[str, str], BeforeValidator(_check_text), Form("text")]
TextFiles = Annotated[
    Mapping[str, str], BeforeValidator(_check_text_files), Form("file name, or table by language")
]
File = Annotated[str, AfterValidator(_check_file), Form("file name")]
RoomId = Annotated[str, Form("id of a room")]


# ------------------------------------------------------------------ tables


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Box(_Table):
    """A box along the axes."""

    min: Position = Field(description="The lowest corner, metres.")
    max: Position = Field(description="The highest corner, metres.")

    @model_validator(mode="after")
    def _has_inside(self) -> Box:
        for axis, low, high in zip("xyz", self.min, self.max, strict=True):
            if low >= high:
                raise _fault(f"expected min below max along {axis}, found {low:g} and {high:g}")
        return self


class Viewpoint(_Table):
    """Where a visitor stands and what the visitor faces."""

    position: Position = Field(description="The eye, metres.")
    look_at: Position = Field(description="What the eye looks at, metres.")

    @model_validator(mode="after")
    def _looks_somewhere(self) -> Viewpoint:
        if self.position == self.look_at:
            raise _fault("expected `look_at` away from `position`, found both at one place")
        return self


class ScanRef(_Table):
    """A scan of a room: a file name, or a table."""

    file: File = Field(description="The scan: `.ply` or `.e57`.")
    pose: Pose | None = Field(
        default=None,
        description="Rotation and shift, four rows of four numbers, that carry this scan's "
        "coordinates into the frame of the room; in metres, after `unit` and `up`.",
    )
    station: Position | None = Field(
        default=None,
        description="Where the scanner stood, in this scan's coordinates before `pose`; "
        "only for a scan from one station.",
    )


class Clean(_Table):
    """Which points are kept."""

    min_points: Whole = Field(
        default=10_000, ge=100, description="A room of fewer points is refused."
    )
    thin_mm: Number | None = Field(
        default=None,
        ge=0.5,
        le=100,
        description="Points closer together than this are merged for the surface; the colours "
        "come from all points. Left out: half of `surface.detail_mm`.",
    )


class Surface(_Table):
    """How the surface is made from the points."""

    method: Literal["poisson"] = Field(
        default="poisson", description="The method: Poisson reconstruction."
    )
    detail_mm: Number | None = Field(
        default=None,
        ge=1,
        le=500,
        description="The finest detail that the surface shall show. Left out: the spacing of the "
        "scan's points in the middle, at least 4.",
    )
    depth: Whole | None = Field(
        default=None,
        ge=5,
        le=12,
        description="The octree's depth, whatever `detail_mm` says; a step halves its cells and "
        "takes four times the memory and time. Left out: such that its cells are as wide as "
        "`detail_mm`.",
    )


class Texture(_Table):
    """How fine the pictures on the surface are."""

    texel_mm: Number = Field(
        default=4.0,
        ge=0.5,
        le=100,
        description="Edge of a texel on the surface at the finest level; never finer than the "
        "scan's own points.",
    )
    quality: Whole = Field(default=80, ge=1, le=100, description="Quality of the WebP pictures.")


class Link(_Table):
    """A door to another room."""

    to: Annotated[RoomId, AfterValidator(_check_neighbour)] = Field(
        description="The room behind the door, by its `id`."
    )
    at: Position = Field(description="Where the door's mark stands in this room, metres.")
    title: Text | None = Field(
        default=None, description="What the mark says. Left out: the title of the other room."
    )
    arrive: Viewpoint | None = Field(
        default=None,
        description="Where one arrives in the other room, in that room's coordinates. Left out: "
        "at its door back, facing away from it; else at its entry.",
    )


class Note(_Table):
    """A mark that tells something about one place of the room."""

    at: Position = Field(description="Where the mark stands, metres.")
    title: Text = Field(description="What the mark says.")
    text: Text | None = Field(default=None, description="What opens on a click; Markdown.")
    image: File | None = Field(default=None, description="A picture shown with the text.")


class Room(_Table):
    """A room of the tour."""

    id: Annotated[RoomId, AfterValidator(_check_room_id)] = Field(
        description="Name of the room's folder and address: a-z, 0-9, - and _."
    )
    title: Text = Field(default={}, description="The room's name. Left out: its `id`.")
    scans: tuple[Annotated[ScanRef, BeforeValidator(_as_reference)], ...] = Field(
        min_length=1, description="The room's scans: file names or tables."
    )
    stations: Stations = Field(
        default="auto",
        description='Where the scanner stood: positions, or "auto": as the scans tell, else '
        "found from the points.",
    )
    unit: Literal["m", "cm", "mm", "ft"] = Field(
        default="m", description="The unit of the scans' coordinates."
    )
    up: Literal["z", "-z", "y", "-y", "x", "-x"] = Field(
        default="z", description="The axis of the scans that points up."
    )
    keep: Box | None = Field(
        default=None, description="Points outside this box are dropped. Left out: none are."
    )
    remove: tuple[Box, ...] = Field(
        default=(),
        description="Points inside these boxes are dropped: people, furniture, what is seen "
        "through a window.",
    )
    closed: tuple[Box, ...] = Field(
        default=(),
        description="Inside these boxes every gap of the surface is closed: mirrors, black "
        "screens and glass, which a scanner looks through.",
    )
    text: TextFiles = Field(
        default={},
        description="Markdown files about the room; `{lang}` stands for the language.",
    )
    start: Viewpoint | None = Field(
        default=None,
        description="Where one enters, if not by a door. Left out: a free place is found.",
    )
    clean: Clean = Field(default=Clean(), description="Which points are kept.")
    surface: Surface = Field(default=Surface(), description="How the surface is made.")
    texture: Texture = Field(default=Texture(), description="How fine the pictures are.")
    links: tuple[Link, ...] = Field(default=(), alias="link", description="Doors to other rooms.")
    notes: tuple[Note, ...] = Field(default=(), alias="note", description="Marks with texts.")

    @model_validator(mode="before")
    @classmethod
    def _enter(cls, data: Any, info: ValidationInfo) -> Any:
        if info.context and isinstance(data, dict):
            info.context.room = data.get("id")
        return data

    @property
    def unit_m(self) -> float:
        """Metres in one unit of the scans."""
        return UNITS[self.unit]


class TourHead(_Table):
    """The tour as a whole."""

    title: Text = Field(description="The tour's name.")
    languages: Annotated[tuple[str, ...], AfterValidator(_check_languages)] = Field(
        default=("en",),
        min_length=1,
        description="Codes of the languages that the texts are in; the first one is shown first.",
    )
    start: Annotated[RoomId, AfterValidator(_check_target)] | None = Field(
        default=None, description="The room in which the tour starts. Left out: the first one."
    )


class _File(_Table):
    """A tour file."""

    tour: TourHead = Field(description="The tour as a whole.")
    room: tuple[Room, ...] = Field(min_length=1, description="The rooms.")


class Tour(_Table):
    """A tour file that was read and found without fault.

    Attributes:
        folder: Absolute; the paths of the rooms start here.
        title: By language.
        languages: The first one is shown first.
        start: Id of the room in which the tour starts.
        rooms: In the order of the file.
    """

    folder: Path
    title: Mapping[str, str]
    languages: tuple[str, ...]
    start: str
    rooms: tuple[Room, ...]

    def room(self, room_id: str) -> Room:
        """The room of that id.

        Raises:
            InputError: There is none.
        """
        for room in self.rooms:
            if room.id == room_id:
                return room
        ids = tuple(room.id for room in self.rooms)
        raise InputError(f"{TOUR_FILE}: room `{room_id}` does not exist", _near(room_id, ids))


# ------------------------------------------------------------------ reading


def load_tour(folder: Path) -> Tour:
    """Read and check `folder`/tour.toml; of the scans, that they exist and are not empty.

    Every text comes back in every declared language: one that was not translated is given in the
    first language that has it. A room without a title is named by its id, a link without one by
    the room behind it.

    Raises:
        Faults: All that is wrong, in the order of the file.
    """
    data = _parse(folder / TOUR_FILE)
    try:
        file = _File.model_validate(data, context=_context(folder, data))
    except ValidationError as error:
        raise Faults(_faults(error, data)) from None
    return _tour(folder, file)


def check_tour(folder: Path) -> tuple[Tour, tuple[str, ...]]:
    """Read `folder`/tour.toml and the headers of all scans that it names rightly.

    Returns:
        The tour, and what the publisher should know although a build will succeed.

    Raises:
        Faults: All that is wrong: with tour.toml, in the order of the file, then with the scans.
    """
    data = _parse(folder / TOUR_FILE)
    try:
        file = _File.model_validate(data, context=_context(folder, data))
    except ValidationError as error:
        faults = _faults(error, data)
        scan_faults, _ = _check_headers(_readable_rooms(folder, data), folder)
        raise Faults((*faults, *scan_faults)) from None
    tour = _tour(folder, file)
    return tour, check_scans(tour)


def _readable_rooms(folder: Path, data: Mapping[str, Any]) -> Iterator[Room]:
    """Of a tour file at fault, the rooms whose scans can be checked all the same."""
    tables = data.get("room")
    for table in tables if isinstance(tables, list) else ():
        if isinstance(table, dict):
            wanted = {key: table[key] for key in table.keys() & _READING_KEYS}
            with suppress(ValidationError):
                yield Room.model_validate(wanted, context=_context(folder, data))


def _tour(folder: Path, file: _File) -> Tour:
    """The tour, its texts filled in."""
    languages = file.tour.languages
    titles = {room.id: room.title or dict.fromkeys(languages, room.id) for room in file.room}
    rooms = tuple(
        room.model_copy(
            update={
                "title": titles[room.id],
                "links": tuple(
                    link.model_copy(update={"title": link.title or titles[link.to]})
                    for link in room.links
                ),
            }
        )
        for room in file.room
    )
    return Tour(
        folder=folder.resolve(),
        title=file.tour.title,
        languages=languages,
        start=file.tour.start or rooms[0].id,
        rooms=rooms,
    )


def _parse(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig").replace("\r\n", "\n"))
    except FileNotFoundError:
        fault = InputError(
            f"{TOUR_FILE}: expected a file in `{path.parent}`, found none",
            f"write one with `tourgen new {path.parent}`",
        )
    except OSError as error:
        fault = InputError(
            f"{TOUR_FILE}: expected a file that can be read, found: {error.strerror}"
        )
    except UnicodeDecodeError as error:
        fault = InputError(
            f"{TOUR_FILE}: expected UTF-8, found byte {error.object[error.start]:#x} at "
            f"position {error.start}",
            "save the file as UTF-8",
        )
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"^(.*) \(at (?:line (\d+), column (\d+)|end of document)\)$", str(error))
        reason = place[1] if place else str(error)
        where = f"line {place[2]}, column {place[3]}" if place and place[2] else "end of the file"
        fault = InputError(
            f"{TOUR_FILE}: {where}: expected TOML, found: {reason[:1].lower()}{reason[1:]}"
        )
    raise Faults((fault,)) from None


def _context(folder: Path, data: Mapping[str, Any]) -> _Context:
    head, rooms = data.get("tour"), data.get("room")
    languages = head.get("languages", ["en"]) if isinstance(head, dict) else []
    valid = isinstance(languages, list) and all(isinstance(name, str) for name in languages)
    ids = (
        [room.get("id") for room in rooms or [] if isinstance(room, dict)]
        if isinstance(rooms, list)
        else []
    )
    return _Context(
        folder,
        tuple(languages) if valid else (),
        tuple(name for name in ids if isinstance(name, str)),
    )


# ------------------------------------------------------------------ scans


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
    faults, warnings = _check_headers(tour.rooms, tour.folder)
    if faults:
        raise Faults(faults)
    return warnings


def _check_headers(
    rooms: Iterable[Room], folder: Path
) -> tuple[tuple[InputError, ...], tuple[str, ...]]:
    """Faults and warnings of the scans of these rooms."""
    faults: list[InputError] = []
    warnings: list[str] = []
    for room in rooms:
        scans: list[Scan] = []
        for reference in room.scans:
            try:
                scans.append(_open(room, reference, folder))
            except InputError as fault:
                faults.append(InputError(f"room `{room.id}`: {fault.message}", fault.hint))
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
        folder / scan.file,
        room.unit_m,
        room.up,
        name=scan.file,
        pose=scan.pose,
        station=scan.station,
    )


# ------------------------------------------------------------------ faults

Location = tuple[int | str, ...]


def _faults(error: ValidationError, data: Mapping[str, Any]) -> tuple[InputError, ...]:
    details = [
        detail
        for detail in error.errors()
        # a list whose items are all at fault counts as empty for pydantic
        if detail["type"] != "too_short" or not detail["input"]
    ]
    details.sort(key=lambda detail: _place(detail["loc"], data))
    return tuple(_told(detail, data) for detail in details)


def _place(location: Location, data: Any) -> tuple[int, ...]:
    """Sorts as the keys stand in the file; tomllib keeps their order. A missing key comes first."""
    place = []
    for key in location:
        if isinstance(data, dict):
            place.append(list(data).index(key) if key in data else -1)
            data = data.get(str(key))
        elif isinstance(data, list) and isinstance(key, int):
            place.append(key)
            data = data[key]
    return tuple(place)


def _told(detail: ErrorDetails, data: Mapping[str, Any]) -> InputError:
    message, hint = _words(detail)
    return InputError(
        _CONTROL.sub("?", f"{TOUR_FILE}: {_subject(detail['loc'], data)}: {message}"),
        _CONTROL.sub("?", hint),
    )


def _subject(location: Location, data: Mapping[str, Any]) -> str:
    """Room and key in words: ("room", 0, "link", 1, "to") -> room `kitchen`: link 2: to."""
    parts: list[str] = []
    if location[0] == "room" and len(location) > 1 and isinstance(location[1], int):
        table = data["room"][location[1]]
        name = table.get("id") if isinstance(table, dict) else None
        parts.append(f"room `{name}`" if isinstance(name, str) else f"room {location[1] + 1}")
        location = location[2:]
    joined = ""
    for key in location:
        if isinstance(key, int):
            parts.append(f"{joined} {key + 1}")
            joined = ""
        else:
            joined = f"{joined}.{key}" if joined else key
    return ": ".join([*parts, joined] if joined else parts)


def _words(detail: ErrorDetails) -> tuple[str, str]:
    """What was expected and found, and the hint."""
    kind, context, found = detail["type"], detail.get("ctx", {}), _shown(detail["input"])
    if kind == "tour":
        return context["message"], context["hint"]
    if kind == "missing":
        return "expected this key, found none", ""
    if kind == "extra_forbidden":
        return _unknown_key(detail["loc"])
    if kind == "literal_error":
        words = tuple(re.findall(r"'([^']*)'", context["expected"]))
        return f"{_listed(words)}, found {found}", _near(str(detail["input"]), words)
    if kind == "tuple_type" and isinstance(detail["input"], dict):
        return "expected a list, found a table", f"write `[[{detail['loc'][-1]}]]` above it"
    expected = {
        "float_type": "a number",
        "int_type": "a whole number",
        "finite_number": "a finite number",
        "string_type": "a string",
        "tuple_type": "a list",
        "model_type": "a table",
        "too_short": "at least one",
        "greater_than_equal": f"at least {context.get('ge')}",
        "less_than_equal": f"at most {context.get('le')}",
    }.get(kind)
    if expected is None:
        return f"{detail['msg'][:1].lower()}{detail['msg'][1:]}, found {found}", ""
    return f"expected {expected}, found {found}", ""


def _unknown_key(location: Location) -> tuple[str, str]:
    model: type[BaseModel] = _File
    for key in location[:-1]:
        if isinstance(key, str):
            model = tables(model)[key]
    known = tuple(sorted(keys(model)))
    name = str(location[-1])
    hint = _near(name, known)
    if not hint:
        inner = {key: f"{table}.{key}" for table, sub in tables(model).items() for key in keys(sub)}
        near = difflib.get_close_matches(name, list(inner), 1)
        hint = f"did you mean `{inner[near[0]]}`?" if near else ""
    return f"unknown key, {_listed(known)}", hint


def keys(model: type[BaseModel]) -> dict[str, Any]:
    """The keys that a table may have, with what pydantic knows about each."""
    return {info.alias or name: info for name, info in model.model_fields.items()}


def tables(model: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """Of the keys of a table, those that hold tables themselves, or lists of them."""
    found = {key: _table_in(info.annotation) for key, info in keys(model).items()}
    return {key: table for key, table in found.items() if table}


def _table_in(annotation: object) -> type[BaseModel] | None:
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    return next(filter(None, map(_table_in, get_args(annotation))), None)


def _shown(value: object) -> str:
    """A value as TOML would write it, cut at 60 characters."""
    if isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, dict):
        text = f"a table of {', '.join(value)}" if value else "an empty table"
    elif isinstance(value, list | tuple):
        text = f"[{', '.join(map(_shown, value))}]"
    elif isinstance(value, str):
        text = '"' + value.replace("\n", "\\n") + '"'
    else:
        text = str(value)
    return text if len(text) <= 60 else text[:59] + "…"
