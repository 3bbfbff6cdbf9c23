"""What a publisher reads about tour.toml, made from the models that read it.

`python -m tourgen.reference docs/tour-file.md` writes the page; `starter` writes the tour file
that a new tour begins with.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from tourgen.errors import InputError
from tourgen.scans import FORMATS
from tourgen.tour import (
    TOUR_FILE,
    Box,
    Clean,
    Kiosk,
    Link,
    Note,
    Place,
    Room,
    ScanRef,
    Stop,
    Surface,
    Texture,
    TourHead,
    Viewpoint,
)
from tourgen.tour.faults import keys, limits, marks, tables
from tourgen.tour.values import Form, OnlyWith, as_room_id

_TABLES: Final[tuple[tuple[str, type[BaseModel], str], ...]] = (
    ("[tour]", TourHead, ""),
    ("[[room]]", Room, "One for each room, in the order in which the tour lists them."),
    ("Scans", ScanRef, "An entry of `scans` is a file name, or a table:"),
    ("[room.clean]", Clean, ""),
    ("[room.surface]", Surface, ""),
    ("[room.texture]", Texture, ""),
    ("[[room.link]]", Link, ""),
    ("[[room.note]]", Note, ""),
    ("[[stop]]", Stop, "One for each stop of the guided tour, in their order."),
    ("[kiosk]", Kiosk, "The tour at a screen that nobody attends: [kiosk.md](kiosk.md)."),
    ("Places", Place, "The value of `place`:"),
    ("Boxes", Box, "The value of `keep`; `remove` and `closed` are lists of such boxes."),
    ("Views", Viewpoint, "The value of `start` and `arrive`."),
)

_EXAMPLE: Final = """\
[tour]
title = { en = "Kéréon lighthouse", fr = "Phare de Kéréon" }
languages = ["en", "fr"]

[[room]]
id = "chamber1"
title = { en = "First chamber", fr = "Première chambre" }
scans = ["scans/chamber1.ply"]
keep = { min = [-3.2, -3.2, -0.1], max = [3.2, 3.2, 3.0] }
[room.surface]
detail_mm = 8
[[room.link]]
to = "stairs"
at = [2.1, 0.0, 1.4]

[[room]]
id = "stairs"
title = { en = "Stairs", fr = "Escalier" }
scans = ["scans/stairs.e57"]
"""

_INTRODUCTION: Final = f"""\
# The tour file

`{TOUR_FILE}` says what a tour consists of. It lies in the tour's folder; its paths start there.

```toml
{_EXAMPLE}```

Coordinates are those of the room's scans after `unit` and `up` were applied: metres, right-handed,
z up; `[x, y, z]`. A *text* is a string for every language, or a table of strings by language:
`{{ en = "Stairs", fr = "Escalier" }}`; a language that is left out shows the first one that is
there. An unknown key is an error. `tourgen check` tells all faults at once that this file and the
scans' headers show. What only the points can tell stops a build while it reads them, and leaves
the site as it was: a scan on one plane, on a line or in one spot is no room. Points at the place of
another are dropped; colours that are all black count as none, and the points are grey.
"""


def reference() -> str:
    """The page about the tour file, Markdown."""
    sections = [_INTRODUCTION]
    for title, model, text in _TABLES:
        heading = f"## `{title}`" if title[0] == "[" else f"## {title}"
        head = ["| key | value | if left out | meaning |", "|---|---|---|---|"]
        rows = [_row(key, info) for key, info in keys(model).items()]
        sections.append("\n".join([heading, "", *([text, ""] if text else []), *head, *rows, ""]))
    return "\n".join(sections)


def _row(key: str, info: FieldInfo) -> str:
    meaning, _, left_out = str(info.description).partition(" Left out: ")
    default = _default(info)
    if info.is_required():
        left_out = "*required*"
    elif default:
        left_out = f"`{default}`"
    return f"| `{key}` | {_type(info)} | {left_out.removesuffix('.')} | {meaning} |"


def _type(info: FieldInfo) -> str:
    """What a key takes, in words."""
    # of a list, its own form comes after those of its items
    form = next((each.words for each in reversed(marks(info)) if isinstance(each, Form)), None)
    limit = limits(info)
    ends = [f"{sign} {limit[name]:g}" for name, sign in (("ge", "≥"), ("le", "≤")) if name in limit]
    return ", ".join([form or _words(info.annotation), *ends])


def _words(annotation: object) -> str:
    if get_origin(annotation) is Literal:
        return ", ".join(f'`"{word}"`' for word in get_args(annotation))
    several = get_origin(annotation) is tuple
    for name, model in (("box", Box), ("view", Viewpoint), ("place", Place)):
        if model in (annotation, *get_args(annotation)):
            return f"list of {name}es" if several else name
    if several:
        return "list of strings" if str in get_args(annotation) else "list"
    return "table"


def _default(info: FieldInfo) -> str:
    """What holds if the key is left out, as TOML; "" where that is nothing, or derived."""
    value = info.get_default()
    if info.is_required() or not isinstance(value, str | float | int | tuple) or value == ():
        return ""
    return json.dumps(value)


# ------------------------------------------------------------------ a new tour


def starter(folder: Path) -> str:
    """A commented tour file for the scans in `folder` and in its subfolder `scans`.

    Each name gives a room; of a PLY and an E57 of one name the E57 is taken, for its stations.
    What is written loads without a fault.

    Raises:
        InputError: There is no scan.
    """
    scans = _scans(folder)
    if not scans:
        raise InputError(
            f"`{folder}`: expected scans ({', '.join(FORMATS)}), found none",
            f"copy them to `{folder / 'scans'}`",
        )
    lines = [
        "# What each key means: run `tourgen keys`. Lines that start with # are not read;",
        "# those with a key show what holds as long as they are left out.",
        "",
        "[tour]",
        f"title = {_toml(_title(folder.resolve().name))}",
        'languages = ["en"]',
    ]
    for position, (room_id, path) in enumerate(scans.items()):
        lines += [
            "",
            "[[room]]",
            f"id = {_toml(room_id)}",
            f"title = {_toml(_title(path.stem))}",
            f"scans = [{_toml(path.relative_to(folder).as_posix())}]",
        ]
        if position == 0:
            lines += [*_hints(Room), *_door(room_id, list(scans))]
    return "\n".join([*lines, ""])


def _scans(folder: Path) -> dict[str, Path]:
    """The scans by room id."""
    found = [
        path
        for place in (folder, folder / "scans")
        if place.is_dir()
        for path in sorted(place.iterdir())
        if path.suffix.lower() in FORMATS and path.is_file() and path.stat().st_size
    ]
    # E57 knows where the scanner stood: it wins over a PLY of the same name
    found.sort(key=lambda path: path.suffix.lower() != ".e57")
    rooms: dict[str, Path] = {}
    for path in found:
        rooms.setdefault(as_room_id(path.stem), path)
    return dict(sorted(rooms.items()))


def _title(name: str) -> str:
    return re.sub(r"[-_\s]+", " ", name).strip().capitalize() or "Tour"


def _hints(model: type[BaseModel]) -> Iterator[str]:
    """A line for each key that has a value when it is left out, its tables below."""
    for key, info in keys(model).items():
        if _default(info) and _is_at_home(info):
            yield f"# {key} = {_default(info)}  # {info.description}"
    for key, table in tables(model).items():
        if isinstance(keys(model)[key].default, BaseModel):
            yield f"# [room.{key}]"
            yield from _hints(table)


def _is_at_home(info: FieldInfo) -> bool:
    """Whether the key may stand beside the method that holds when none is named."""
    return all(
        keys(Surface)["method"].default in each.methods
        for each in info.metadata
        if isinstance(each, OnlyWith)
    )


def _door(room_id: str, room_ids: list[str]) -> Iterator[str]:
    other = next((each for each in room_ids if each != room_id), None)
    if other:
        yield "# [[room.link]]  # A door: where its mark stands in this room."
        yield f"# to = {_toml(other)}"
        yield "# at = [0.0, 0.0, 1.4]"


def _toml(text: str) -> str:
    """A TOML string."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(reference(), encoding="utf-8")
