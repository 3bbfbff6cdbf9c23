"""Described: what tour.json says, from which viewer and pages are made."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from tourgen.geometry import Float32, Float64, View
from tourgen.placing import Doorway, Place, Plot, placed
from tourgen.remote import local
from tourgen.site.built import BuiltRoom
from tourgen.site.guide import Halt, halts
from tourgen.site.prose import html_of
from tourgen.tour import Note, Room, Tour

FORMAT: Final = 2
"""Version of tour.json; the viewer refuses another."""

_STOREY_M: Final = 1.5
"""Floors nearer together in height are of one storey of the building."""

Json = dict[str, Any]


def described(tour: Tour, built: Mapping[str, BuiltRoom]) -> Json:
    """All that a tour says of itself.

    Args:
        tour: What tour.toml says.
        built: Every room, by id.
    """
    texts = {room.id: _texts(tour.folder, room.text) for room in tour.rooms}
    places = placed([_plot(room, built[room.id]) for room in tour.rooms], tour.start)
    levels = _levels(places, built, tour.start)
    stops = halts(tour, built, texts)
    return {
        "format": FORMAT,
        "title": dict(tour.title),
        "languages": list(tour.languages),
        "start": tour.start,
        "address": tour.address,
        "north_deg": tour.north_deg,
        "credits": _texts(tour.folder, tour.credits),
        "license": dict(tour.license or {}),
        "rooms": [
            _room(room, built[room.id], places[room.id], levels[room.id], texts[room.id])
            for room in tour.rooms
        ],
        "stops": [_stop(halt) for halt in stops],
    }


def _stop(halt: Halt) -> Json:
    return {
        "room": halt.room,
        **_view(halt.view),
        "text": dict(halt.told),
        "seconds": halt.seconds,
    }


def note_files(tour: Tour, room: Room) -> Iterable[tuple[str, Path]]:
    """The files of a room's notes: where each is published, and where it lies."""
    for number, note in enumerate(room.notes, 1):
        for published, name in _note_files(room.id, number, note).values():
            yield published, local(tour.folder, name)


def _note_files(room_id: str, number: int, note: Note) -> dict[str, tuple[str, str]]:
    """By "image", "sound" and the languages of captions: the published path, and the file."""
    home = f"rooms/{room_id}/notes/{number}"
    found = {}
    for key, name in (("image", note.image), ("sound", note.sound)):
        if name:
            found[key] = f"{home}{Path(name).suffix.lower()}", name
    for language, name in note.captions.items():
        found[language] = f"{home}.{language}.vtt", name
    return found


# ------------------------------------------------------------------ rooms


def _root(built: BuiltRoom) -> str:
    """Where the tile lies that a room is opened with."""
    return str(json.loads(built.files["tileset.json"])["root"]["content"]["uri"])


def _room(room: Room, built: BuiltRoom, place: Place, levels: Sequence[int], text: Json) -> Json:
    home = f"rooms/{room.id}"
    made = built.made
    return {
        "id": room.id,
        "title": dict(room.title),
        "text": text,
        "tileset": f"{home}/tileset.json",
        "root": f"{home}/{_root(built)}",
        "poster": f"{home}/poster.webp",
        "preview": f"{home}/preview.jpg",
        "around": f"{home}/around.webp",
        "bounds": {"min": _triple(built.bounds[0]), "max": _triple(built.bounds[1])},
        "place": {"at": _triple(place.at), "turn_deg": round(place.turn_deg, 3)},
        "storeys": [
            {
                "level": level,
                "floor_m": round(storey.floor_m, 3),
                "floor": _path(storey.floor, closed=True),
                "walls": _path(storey.walls),
                "low": _path(storey.low),
            }
            for level, storey in zip(levels, built.plan.storeys, strict=True)
        ],
        "entry": _view(built.entry),
        "links": [
            {
                "to": link.to,
                "title": dict(link.title or {}),
                "at": _relative(link.at, built.origin),
                "arrive": _view(arrival),
            }
            for link, arrival in zip(room.links, built.arrivals, strict=True)
        ],
        "notes": [
            _note(room.id, number, note, view, built.origin)
            for number, (note, view) in enumerate(zip(room.notes, built.viewpoints, strict=True), 1)
        ],
        "made": {
            "captured": room.captured,
            "points": made.points,
            "stations": made.stations,
            "faces": made.faces,
            "deviation_mm": [round(value, 2) for value in made.deviation_mm],
            "inferred_ratio": round(made.inferred_ratio, 4),
            "bytes": sum(map(len, built.files.values())),
        },
    }


def _note(room_id: str, number: int, note: Note, view: View, origin: Float64) -> Json:
    files = {key: path for key, (path, _) in _note_files(room_id, number, note).items()}
    return {
        "at": _relative(note.at, origin),
        "view": _view(view),
        "title": dict(note.title),
        "text": {language: html_of(text) for language, text in (note.text or {}).items()},
        "image": files.get("image"),
        "image_text": dict(note.image_text or note.title),
        "sound": files.get("sound"),
        "captions": {language: files[language] for language in note.captions},
    }


def _texts(folder: Path, names: Mapping[str, str]) -> dict[str, str]:
    return {
        language: html_of(local(folder, name).read_text("utf-8-sig"))
        for language, name in names.items()
    }


# ------------------------------------------------------------------ places


def _plot(room: Room, built: BuiltRoom) -> Plot:
    """What is known of where a room stands, in metres from its origin."""
    plan = built.plan
    doorways = [
        Doorway(link.to, np.append((np.array(link.at) - built.origin)[:2], floor_m), way)
        for link, floor_m, way in zip(room.links, plan.door_floor_m, plan.door_way, strict=True)
    ]
    given = None
    if room.place:
        told = Place(np.array(room.place.at), room.place.turn_deg)
        given = Place(told.of(built.origin), told.turn_deg)
    return Plot(room.id, built.bounds, tuple(doorways), given)


def _levels(
    places: Mapping[str, Place], built: Mapping[str, BuiltRoom], start: str
) -> Mapping[str, list[int]]:
    """Which storey of the building each storey of each room is; 0 is where the tour starts."""
    heights = {
        room: [places[room].at[2] + storey.floor_m for storey in built[room].plan.storeys]
        for room in places
    }
    every = np.sort(np.concatenate(list(heights.values())))
    steps = np.flatnonzero(np.diff(every) > _STOREY_M)
    bounds = (every[steps] + every[steps + 1]) / 2
    first = built[start].entry.position[2] + places[start].at[2]
    below = [height for height in heights[start] if height <= first]
    ground = int(np.searchsorted(bounds, max(below, default=min(heights[start]))))
    return {
        room: [int(level) - ground for level in np.searchsorted(bounds, each)]
        for room, each in heights.items()
    }


# ------------------------------------------------------------------ numbers


def _relative(position: Sequence[float], origin: Float64) -> list[float]:
    return _triple([value - start for value, start in zip(position, origin, strict=True)])


def _triple(position: Sequence[float] | Float64) -> list[float]:
    """Metres, to the tenth of a millimetre."""
    return [round(float(value), 4) for value in position]


def _view(view: View) -> Json:
    return {"position": _triple(view.position), "look_at": _triple(view.look_at)}


def _path(lines: Sequence[Float32], *, closed: bool = False) -> str:
    """The data of an SVG path, metres, y up, to the centimetre."""
    end = "Z" if closed else ""
    return "".join(
        "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in line.tolist()) + end for line in lines
    )
