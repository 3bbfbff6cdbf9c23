"""The kinds of values that tour.toml may hold, and how each is checked.

A value at fault raises a `PydanticCustomError` of type "tour" with message and hint, which
`tour.faults` puts into words together with the key.
"""

from __future__ import annotations

import difflib
import itertools
import os
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from pathlib import Path
from typing import Annotated, Final, Literal
from urllib.parse import urlsplit

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, GetCoreSchemaHandler, ValidationInfo
from pydantic_core import PydanticCustomError, core_schema

from tourgen.errors import TourgenError
from tourgen.remote import fetch, is_remote, local

_ROOM_ID: Final = re.compile(r"(?!(con|prn|aux|nul|com\d|lpt\d)$)[a-z0-9][a-z0-9_-]{0,63}")
_PIN: Final = re.compile(r"[0-9]{4,8}")
_TIME: Final = "([01][0-9]|2[0-3]):[0-5][0-9]"
_SPAN: Final = re.compile(f"{_TIME}-({_TIME}|24:00)")
DAYS: Final = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")
_LANGUAGE: Final = re.compile(r"[a-z]{2,3}(-[A-Za-z0-9]{2,8})*")


@dataclass
class Context:
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


def fault(message: str, hint: str = "") -> PydanticCustomError:
    """What a check raises: what was expected and found, and what helps."""
    return PydanticCustomError("tour", "{message}", {"message": message, "hint": hint})


def near(word: str, words: tuple[str, ...]) -> str:
    """The hint that names the one of `words` that looks most like `word`, or ""."""
    match = difflib.get_close_matches(word, words, 1)
    return f"did you mean `{match[0]}`?" if match else ""


def listed(words: tuple[str, ...]) -> str:
    """What was expected, of several words."""
    return f"expected one of {', '.join(words)}" if len(words) != 1 else f"expected {words[0]}"


def shown(value: object) -> str:
    """A value as TOML would write it, cut at 60 characters."""
    if isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, dict):
        text = f"a table of {', '.join(value)}" if value else "an empty table"
    elif isinstance(value, list | tuple):
        text = f"[{', '.join(map(shown, value))}]"
    elif isinstance(value, str):
        text = '"' + value.replace("\n", "\\n") + '"'
    else:
        text = str(value)
    return text if len(text) <= 60 else text[:59] + "…"


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(abs(value) < 1e9)


def _check_position(value: object) -> object:
    if isinstance(value, list | tuple) and len(value) == 3 and all(map(_number, value)):
        return tuple(float(number) for number in value)
    raise fault(f"expected three numbers [x, y, z], found {shown(value)}")


def _check_pose(value: object) -> object:
    rows = value if isinstance(value, list | tuple) else ()
    if len(rows) != 4 or not all(
        isinstance(row, list | tuple) and len(row) == 4 and all(map(_number, row)) for row in rows
    ):
        raise fault(f"expected four rows of four numbers, found {shown(value)}")
    matrix = np.array(rows, dtype=np.float64)
    turn = matrix[:3, :3]
    rigid = np.allclose(turn @ turn.T, np.eye(3), atol=1e-3) and np.linalg.det(turn) > 0
    if not rigid or not np.allclose(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        raise fault(
            "expected a rotation and a shift with [0, 0, 0, 1] as its last row, "
            f"found {shown(value)}",
            "scale by `unit` instead, and turn the axes by `up`",
        )
    return tuple(tuple(float(number) for number in row) for row in matrix)


def _check_stations(value: object) -> object:
    if value == "auto":
        return value
    if isinstance(value, list | tuple) and value:
        return tuple(_check_position(position) for position in value)
    raise fault(f'expected "auto" or a list of positions [x, y, z], found {shown(value)}')


def _check_text(value: object, info: ValidationInfo) -> dict[str, str]:
    """A string for every language, or a table; a language without an entry takes the first one."""
    declared = info.context.languages if info.context else ()
    if isinstance(value, str):
        value = dict.fromkeys(declared or ("en",), value)
    if not isinstance(value, dict) or not value:
        raise fault(f"expected a text or a table of texts by language, found {shown(value)}")
    for language, text in value.items():
        if declared and language not in declared:
            raise fault(
                f"language `{language}` is not declared, {listed(declared)}",
                near(language, declared) or f"add it to `tour.languages`: {shown(language)}",
            )
        if not isinstance(text, str) or not text.strip():
            raise fault(f"expected a text in language `{language}`, found {shown(text)}")
    texts: dict[str, str] = value
    first = next(texts[language] for language in declared or texts if language in texts)
    return {language: texts.get(language, first) for language in declared or texts}


def _check_radii(radii: tuple[float, ...]) -> tuple[float, ...]:
    if any(after <= before for before, after in itertools.pairwise(radii)):
        found = ", ".join(f"{radius:g}" for radius in radii)
        raise fault(
            f"expected each larger than the one before, found [{found}]",
            "sort them from small to large",
        )
    return radii


def _check_file(name: str, info: ValidationInfo) -> str:
    if info.context is None:
        return name
    if is_remote(name):
        try:
            fetch(info.context.folder, name)
        except TourgenError as error:
            raise fault(error.message, error.hint) from None
    path = local(info.context.folder, name)
    # of os.path, which holds names that no system can have for missing files
    if not os.path.isfile(path):
        beside = os.listdir(path.parent) if os.path.isdir(path.parent) else ()
        match = difflib.get_close_matches(path.name, beside, 1)
        hint = f"did you mean `{Path(name).with_name(match[0]).as_posix()}`?" if match else ""
        raise fault(f"expected a file, found none at `{name}`", hint)
    if path.stat().st_size == 0:
        raise fault(f"expected a file with contents, found `{name}` empty", "export it again")
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
        raise fault(
            "expected a name of a folder and an address: a-z, 0-9, - and _, at most 64 of them, "
            f"found {shown(value)}",
            f"for example `{safe}`",
        )
    if info.context:
        if value in info.context.seen:
            raise fault(f"expected a name of its own, found a second room `{value}`")
        info.context.seen.add(value)
    return value


def _check_target(value: str, info: ValidationInfo) -> str:
    if info.context and value not in info.context.rooms:
        hint = near(value, info.context.rooms) or f"rooms: {', '.join(info.context.rooms)}"
        raise fault(f"room `{value}` does not exist", hint)
    return value


def _check_neighbour(value: str, info: ValidationInfo) -> str:
    if info.context and value == info.context.room:
        raise fault(f"expected another room, found a link of `{value}` to itself")
    return _check_target(value, info)


def _check_languages(value: tuple[str, ...]) -> tuple[str, ...]:
    for language in value:
        if not _LANGUAGE.fullmatch(language):
            raise fault(f'expected language codes such as "en" or "pt-BR", found {shown(language)}')
    if len(set(value)) < len(value):
        raise fault(f"expected each language once, found {shown(list(value))}")
    return value


def _check_moment(value: object) -> str:
    if isinstance(value, datetime):
        return value.isoformat(timespec="minutes")
    if isinstance(value, date):
        return value.isoformat()
    raise fault(
        f"expected a date such as 2026-05-12 or 2026-05-12T14:30:00, found {shown(value)}",
        "without quotes" if isinstance(value, str) else "",
    )


def _check_address(value: str) -> str:
    parts = urlsplit(value)
    if parts.scheme not in ("http", "https") or not parts.netloc or parts.query or parts.fragment:
        raise fault(
            f"expected an address of a folder such as `https://example.org/tour/`, "
            f"found {shown(value)}"
        )
    return value if value.endswith("/") else f"{value}/"


def _check_pin(value: str) -> str:
    if not _PIN.fullmatch(value):
        raise fault(f"expected four to eight digits, found {shown(value)}")
    return value


def _check_hours(value: object) -> dict[str, str]:
    """A span for every day, or a table of spans by day; a day without one is closed."""
    hours = dict.fromkeys(DAYS, value) if isinstance(value, str) else value
    if not isinstance(hours, dict) or not hours:
        raise fault(
            f'expected hours such as "10:00-18:00", or a table by day, found {shown(value)}'
        )
    for day, span in hours.items():
        if day not in DAYS:
            raise fault(f"day `{day}` does not exist, {listed(DAYS)}", near(str(day), DAYS))
        if not isinstance(span, str) or not _SPAN.fullmatch(span):
            raise fault(f'expected hours such as "10:00-18:00", found {shown(span)}')
    return hours


@dataclass(frozen=True)
class OnlyWith:
    """For a key that means something to some of the values of the `method` above it only."""

    methods: tuple[str, ...]

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Check before the value itself is."""
        return core_schema.with_info_before_validator_function(self._check, handler(source))

    def _check(self, value: object, info: core_schema.ValidationInfo) -> object:
        method = info.data.get("method")  # none where it is itself at fault
        if method is not None and method not in self.methods:
            raise fault(
                f"expected this key with method {' or '.join(map(shown, self.methods))}, "
                f"found method {shown(method)}",
                f"leave it out, or set `method = {shown(self.methods[0])}`",
            )
        return value


@dataclass(frozen=True)
class Form:
    """How the documentation writes a kind of value."""

    words: str


Number = Annotated[float, Field(strict=True, allow_inf_nan=False), Form("number")]
Whole = Annotated[int, Field(strict=True), Form("whole number")]
Radii = Annotated[
    tuple[Annotated[Number, Field(ge=0.1, le=1000)], ...],
    AfterValidator(_check_radii),
    Form("list of numbers"),
]
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
RoomId = Annotated[str, AfterValidator(_check_room_id), Form("name")]
RoomRef = Annotated[str, AfterValidator(_check_target), Form("`id` of a room")]
NeighbourRef = Annotated[str, AfterValidator(_check_neighbour), Form("`id` of a room")]
Address = Annotated[str, AfterValidator(_check_address), Form("address")]
Moment = Annotated[str, BeforeValidator(_check_moment), Form("date, or date and time")]
Languages = Annotated[tuple[str, ...], AfterValidator(_check_languages)]
Pin = Annotated[str, AfterValidator(_check_pin), Form("four to eight digits, as a string")]
Hours = Annotated[
    Mapping[str, str], BeforeValidator(_check_hours), Form("hours, or table by day, `mon` to `sun`")
]
