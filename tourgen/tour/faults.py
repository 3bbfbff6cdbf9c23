"""Puts what is wrong with a tour file into words: room, key, what was expected and found."""

from __future__ import annotations

import difflib
import re
import types
from collections.abc import Iterator, Mapping
from typing import Any, Final, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from tourgen.errors import InputError
from tourgen.tour.values import listed, near, shown

_CONTROL: Final = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")

_EXPLAINED: Final[Mapping[str, str]] = {
    "solver_divide": "it belonged to the older, unscreened Poisson solver: the depth from which "
    "on that one solved in blocks, to save memory; the screened solver needs none; set `depth`",
}

_SPELLED_OUT: Final[Mapping[str, str]] = {
    **dict.fromkeys(("metre", "meter", "metres", "meters"), "m"),
    **dict.fromkeys(("centimetre", "centimeter", "centimetres", "centimeters"), "cm"),
    **dict.fromkeys(("millimetre", "millimeter", "millimetres", "millimeters"), "mm"),
    **dict.fromkeys(("foot", "feet"), "ft"),
    **{f"{axis}{between}up": axis for axis in "zyx" for between in ("", " ", "-", "_")},
}
"""Words that mean one of those expected, and look like none of them."""

Location = tuple[int | str, ...]


def faults_of(
    error: ValidationError, data: Mapping[str, Any], model: type[BaseModel]
) -> tuple[InputError, ...]:
    """Every fault, in the order of the file.

    Args:
        error: What pydantic found.
        data: The tables as they were read.
        model: Of the whole file.
    """
    details = [
        detail
        for detail in error.errors()
        # a list whose items are all at fault counts as empty for pydantic
        if detail["type"] != "too_short" or not detail["input"]
    ]
    details.sort(key=lambda detail: _place(detail["loc"], data))
    return tuple(_told(detail, data, model) for detail in details)


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


def _told(detail: ErrorDetails, data: Mapping[str, Any], model: type[BaseModel]) -> InputError:
    unknown = detail["type"] == "extra_forbidden"
    message, hint = _unknown_key(detail["loc"], model) if unknown else _words(detail, model)
    return InputError(
        _CONTROL.sub("?", f"{_subject(detail['loc'], data)}: {message}"), _CONTROL.sub("?", hint)
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


def _written(location: tuple[int | str, ...], model: type[BaseModel]) -> str:
    """How a key at a place stands in the file: as a table, one of several, or with its value."""
    key = str(location[-1])
    if len(location) > 1:
        return f"`{key} = …`"
    is_list = get_origin(model.model_fields[key].annotation) is tuple
    return f"`[[{key}]]`, and its keys below" if is_list else f"`[{key}]`, and its keys below"


def _words(detail: ErrorDetails, model: type[BaseModel]) -> tuple[str, str]:
    """What was expected and found, and the hint."""
    kind, context, found = detail["type"], detail.get("ctx", {}), shown(detail["input"])
    if kind == "tour":
        return context["message"], context["hint"]
    if kind == "missing":
        return "expected this key, found none", f"write {_written(detail['loc'], model)}"
    if kind == "literal_error":
        words = tuple(re.findall(r"'([^']*)'", context["expected"]))
        return f"{listed(words)}, found {found}", _meant(str(detail["input"]), words)
    if kind == "tuple_type" and isinstance(detail["input"], dict):
        return "expected a list, found a table", f"write `[[{detail['loc'][-1]}]]` above it"
    expected = {
        "bool_type": "true or false",
        "float_type": "a number",
        "int_type": "a whole number",
        "finite_number": "a finite number",
        "string_type": "a string",
        "tuple_type": "a list",
        "model_type": "a table",
    }.get(kind) or _range(detail, model)
    if expected is None:
        return f"{detail['msg'][:1].lower()}{detail['msg'][1:]}, found {found}", ""
    return f"expected {expected}, found {found}", ""


def _meant(word: str, words: tuple[str, ...]) -> str:
    """The hint that names the one of a few short words that was meant, or ""."""
    plain = word.strip().casefold().lstrip("+")
    meant = _SPELLED_OUT.get(plain, plain)
    if min(map(len, words)) > 2:  # of units and axes every letter counts
        return near(meant, words)
    return f"did you mean `{meant}`?" if meant in words else ""


def _range(detail: ErrorDetails, model: type[BaseModel]) -> str | None:
    """What a value that is too small, too large, too short or too long was expected to be."""
    number = detail["type"] in ("greater_than_equal", "less_than_equal")
    if not number and detail["type"] not in ("too_short", "too_long"):
        return None
    limit = limits(_field(detail["loc"], model))
    if number:
        least, most = limit["ge"], limit.get("le")
        return f"at least {least:g}" if most is None else f"{least:g} to {most:g}"
    most = limit.get("max_length")
    return "at least one" if most is None else f"{limit['min_length']:g} to {most:g} of them"


def _field(location: Location, model: type[BaseModel]) -> FieldInfo:
    """What pydantic knows about the key at fault, or about the list that the value stands in."""
    *above, name = (key for key in location if isinstance(key, str))
    for key in above:
        model = tables(model)[key]
    return keys(model)[name]


def limits(info: FieldInfo) -> Mapping[str, float]:
    """Least and most that a key takes: `ge`, `le`, and of a list `min_length`, `max_length`."""
    names = ("ge", "le", "min_length", "max_length")
    return {
        name: getattr(each, name)
        for each in marks(info)
        for name in names
        if getattr(each, name, None) is not None
    }


def marks(info: FieldInfo) -> tuple[object, ...]:
    """All that is said of a key's type, that of the parts of the type first."""
    return (*_marks(info.annotation), *info.metadata)


def _marks(annotation: object) -> Iterator[object]:
    for part in get_args(annotation):
        yield from _marks(part)
    for mark in getattr(annotation, "__metadata__", ()):
        yield from mark.metadata if isinstance(mark, FieldInfo) else (mark,)


def _unknown_key(location: Location, model: type[BaseModel]) -> tuple[str, str]:
    for key in location[:-1]:
        if isinstance(key, str):
            model = tables(model)[key]
    known = tuple(sorted(keys(model)))
    name = str(location[-1])
    # a key of a table below, written one table too high
    inner = {key: f"{table}.{key}" for table, sub in tables(model).items() for key in keys(sub)}
    match = difflib.get_close_matches(name, list(inner), 1)
    hint = (
        _EXPLAINED.get(name)
        or near(name, known)
        or (f"did you mean `{inner[match[0]]}`?" if match else "")
    )
    return f"unknown key, {listed(known)}", hint


def keys(model: type[BaseModel]) -> dict[str, FieldInfo]:
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
