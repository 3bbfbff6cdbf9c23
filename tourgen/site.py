"""The published tour: pages, tour.json, the viewer and the rooms' tiles, swapped in whole.

A site is written into a folder beside the published one and takes its place by two renames. A
build killed between the two leaves the old site under a hidden name, from which the next build
(or `restore_site`) puts it back: at no time is there no whole site on disk.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import unescape
from importlib.resources import files as package_files
from pathlib import Path, PurePosixPath
from typing import Any, Final

import jinja2
from markdown_it import MarkdownIt

from tourgen.errors import InputError, MissingTool
from tourgen.geometry import Float64, View
from tourgen.headers import headers_file
from tourgen.remote import local
from tourgen.tour import Room, Tour

FORMAT: Final = 1
"""Version of tour.json; the viewer refuses another."""

_DESCRIPTION_LENGTH: Final = 200

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class BuiltRoom:
    """What a build made of a room. All coordinates are metres from ``origin``.

    Attributes:
        id: The room's id in the tour file.
        origin: (3,) float64, scan frame.
        bounds_min: (3,) lowest corner of the room's surface.
        bounds_max: (3,) highest corner of the room's surface.
        entry: Where one enters, if not by a door.
        arrivals: For each link of the room in order, where one arrives, in metres from the origin
            of the room that the link leads to.
        files: By path relative to the room's folder: ``tileset.json``, ``poster.webp`` and
            ``tiles/*.glb``.
        points: Points that the room was made of.
        faces: Faces at the finest level.
    """

    id: str
    origin: Float64
    bounds_min: Float64
    bounds_max: Float64
    entry: View
    arrivals: tuple[View, ...]
    files: Mapping[str, bytes]
    points: int
    faces: int


def write_site(tour: Tour, rooms: Sequence[BuiltRoom], report: Json, out: Path) -> None:
    """Write the whole site and put it in the place of the one published before.

    Args:
        tour: The tour file.
        rooms: Every room of the tour, in any order.
        report: What goes into report.json and onto its page.
        out: The site's folder; made if it does not exist.

    Raises:
        InputError: ``out`` holds something that is not a tour, or cannot be written.
        MissingTool: The viewer has not been compiled.
    """
    out = out.absolute()
    restore_site(out)
    _refuse_foreign(out)
    fresh, old = _beside(out)
    try:
        _remove(fresh)
        fresh.mkdir(parents=True)
        _write_all(tour, {room.id: room for room in rooms}, report, fresh)
        if out.exists():
            out.rename(old)
        fresh.rename(out)
        _remove(old)
    except OSError as error:
        raise InputError(
            f"`{out}`: expected a folder that can be written, found: {error.strerror or error}",
            "choose another with `-o`",
        ) from error


def restore_site(out: Path) -> None:
    """Put back the site that a build killed while swapping has left aside, if there is one."""
    _, old = _beside(out.absolute())
    if not old.exists():
        return
    if out.exists():
        _remove(old)
    else:
        old.rename(out)


def is_site(folder: Path) -> bool:
    """Whether ``folder`` holds a tour that tourgen wrote."""
    try:
        tour = json.loads((folder / "tour.json").read_text("utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(tour, dict) and "format" in tour and "rooms" in tour


def _beside(out: Path) -> tuple[Path, Path]:
    """Where the next site is written, and where the last one waits while they are swapped."""
    return out.with_name(f".{out.name}.new"), out.with_name(f".{out.name}.old")


def _refuse_foreign(out: Path) -> None:
    if out.is_dir() and (is_site(out) or not any(out.iterdir())):
        return
    if out.exists():
        found = "other files" if out.is_dir() else "a file"
        raise InputError(
            f"`{out}`: expected a tour or an empty folder to write to, found {found}",
            "choose another folder with `-o`, or empty this one",
        )


def _remove(folder: Path) -> None:
    if folder.exists():
        shutil.rmtree(folder)


# ------------------------------------------------------------------ contents


def _write_all(tour: Tour, built: Mapping[str, BuiltRoom], report: Json, out: Path) -> None:
    viewer = _viewer()
    shutil.copytree(viewer, out / "viewer")
    names = json.loads((viewer / "manifest.json").read_text("utf-8"))
    rooms = [_room_json(room, built[room.id], tour.folder) for room in tour.rooms]
    described = {
        "format": FORMAT,
        "title": dict(tour.title),
        "languages": list(tour.languages),
        "start": tour.start,
        "rooms": rooms,
    }
    _write_json(out / "tour.json", described)
    _write_json(out / "report.json", report)
    (out / "_headers").write_text(headers_file(), "utf-8")
    shared = {"viewer": names, "tour": described, "language": tour.languages[0]}
    for room, described_room in zip(tour.rooms, rooms, strict=True):
        folder = out / "rooms" / room.id
        for name, content in built[room.id].files.items():
            _write_bytes(folder / PurePosixPath(name), content)
        for note, described_note in zip(room.notes, described_room["notes"], strict=True):
            if note.image:
                _write_bytes(
                    out / described_note["image"], local(tour.folder, note.image).read_bytes()
                )
        page = _page("room.html", shared, described_room, site="../../", is_start=False)
        (folder / "index.html").write_text(page, "utf-8")
    start = next(room for room in rooms if room["id"] == tour.start)
    page = _page("room.html", shared, start, site="", is_start=True)
    (out / "index.html").write_text(page, "utf-8")
    report_page = _templates().get_template("report.html")
    (out / "report.html").write_text(report_page.render(**shared, site="", report=report), "utf-8")


def _page(template: str, shared: Json, room: Json, site: str, *, is_start: bool) -> str:
    return (
        _templates()
        .get_template(template)
        .render(
            **shared,
            room=room,
            site=site,
            is_start=is_start,
            description=_description(room, shared["tour"], shared["language"]),
        )
    )


def _room_json(room: Room, built: BuiltRoom, folder: Path) -> Json:
    home = f"rooms/{room.id}"
    links = [
        {
            "to": link.to,
            "title": dict(link.title or {}),
            "at": _relative(link.at, built.origin),
            "arrive": _view(arrival),
        }
        for link, arrival in zip(room.links, built.arrivals, strict=True)
    ]
    notes = [
        {
            "at": _relative(note.at, built.origin),
            "title": dict(note.title),
            "text": {language: _html(text) for language, text in (note.text or {}).items()},
            "image": f"{home}/images/{number}{Path(note.image).suffix.lower()}"
            if note.image
            else None,
        }
        for number, note in enumerate(room.notes, 1)
    ]
    return {
        "id": room.id,
        "title": dict(room.title),
        "text": {
            language: _html(local(folder, name).read_text("utf-8-sig"))
            for language, name in room.text.items()
        },
        "tileset": f"{home}/tileset.json",
        "poster": f"{home}/poster.webp",
        "bounds": {"min": _triple(built.bounds_min), "max": _triple(built.bounds_max)},
        "entry": _view(built.entry),
        "links": links,
        "notes": notes,
        "points": built.points,
        "faces": built.faces,
        "bytes": sum(map(len, built.files.values())),
    }


def _relative(position: Sequence[float], origin: Float64) -> list[float]:
    return _triple([value - start for value, start in zip(position, origin, strict=True)])


def _triple(position: Sequence[float] | Float64) -> list[float]:
    """Metres, to the tenth of a millimetre."""
    return [round(float(value), 4) for value in position]


def _view(view: View) -> Json:
    return {"position": _triple(view.position), "look_at": _triple(view.look_at)}


# ------------------------------------------------------------------ text


@cache
def _markdown() -> MarkdownIt:
    # Text comes from many hands: no HTML of theirs; pictures belong to notes.
    return MarkdownIt("commonmark", {"html": False}).enable("table").disable("image")


def _html(markdown: str) -> str:
    html: str = _markdown().render(markdown)
    return html.strip()


def _description(room: Json, tour: Json, language: str) -> str:
    """The beginning of the room's text, for search engines and previews; else the names."""
    text = unescape(re.sub(r"<[^>]*>", " ", room["text"].get(language, "")))
    text = " ".join(text.split())
    if not text:
        return f"{room['title'][language]} – {tour['title'][language]}"
    if len(text) <= _DESCRIPTION_LENGTH:
        return text
    return text[:_DESCRIPTION_LENGTH].rsplit(" ", 1)[0] + "…"


@cache
def _templates() -> jinja2.Environment:
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(_shipped("_templates", "templates")),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _viewer() -> Path:
    folder = _shipped("_viewer", "static/dist")
    if not (folder / "manifest.json").is_file():
        raise MissingTool(
            f"viewer: expected it compiled in `{folder}`, found none", "run `make viewer`"
        )
    return folder


def _shipped(packaged: str, in_checkout: str) -> Path:
    """A folder that a wheel carries inside the package, and a checkout beside it."""
    package = Path(str(package_files("tourgen")))
    inside = package / packaged
    return inside if inside.is_dir() else package.parent / in_checkout


# ------------------------------------------------------------------ files


def _write_json(path: Path, content: Json) -> None:
    path.write_text(json.dumps(content, ensure_ascii=False, indent=1) + "\n", "utf-8")


def _write_bytes(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
