"""Guide: the stops of the guided tour, as given or else through all that there is to see.

One path serves the visitor who is led, the kiosk that attracts, and the film.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tourgen.geometry import View
from tourgen.site.built import BuiltRoom
from tourgen.site.prose import html_of, plain
from tourgen.tour import Room, Stop, Tour

_TOLD: int = 200
"""Letters of a text that are told at a stop nobody wrote."""


@dataclass(frozen=True, slots=True)
class Halt:
    """A stop.

    Attributes:
        room: The room's id.
        view: Metres from the room's origin.
        told: What is told there, by language; empty where nothing is.
        seconds: How long one stays; None for as long as reading takes.
    """

    room: str
    view: View
    told: Mapping[str, str]
    seconds: float | None


def halts(
    tour: Tour, built: Mapping[str, BuiltRoom], texts: Mapping[str, Mapping[str, str]]
) -> tuple[Halt, ...]:
    """The stops of a tour.

    Args:
        tour: What tour.toml says.
        built: Every room, by id.
        texts: HTML about every room, by its id and by language.
    """
    if tour.stops:
        return tuple(_given(stop, built[stop.room]) for stop in tour.stops)
    return tuple(
        halt for room in _in_order(tour) for halt in _through(room, built[room.id], texts[room.id])
    )


def _given(stop: Stop, room: BuiltRoom) -> Halt:
    view = View(np.array(stop.position) - room.origin, np.array(stop.look_at) - room.origin)
    return Halt(stop.room, view, stop.text or {}, stop.seconds)


def _through(room: Room, built: BuiltRoom, texts: Mapping[str, str]) -> list[Halt]:
    """From the entry past all notes."""
    told = {
        language: plain(html, _TOLD) or room.title[language] for language, html in texts.items()
    }
    found = [Halt(room.id, built.entry, told or room.title, None)]
    for note, view in zip(room.notes, built.viewpoints, strict=True):
        text = note.text or {}
        told = {
            language: _sentence(title, plain(html_of(text.get(language, "")), _TOLD))
            for language, title in note.title.items()
        }
        found.append(Halt(room.id, view, told, None))
    return found


def _sentence(title: str, text: str) -> str:
    return f"{title}. {text}" if text else title


def _in_order(tour: Tour) -> list[Room]:
    """The rooms as one comes through them, then those without a door."""
    waiting, seen = deque([tour.start]), {tour.start}
    found = []
    while waiting:
        room = tour.room(waiting.popleft())
        found.append(room)
        for link in room.links:
            if link.to not in seen:
                seen.add(link.to)
                waiting.append(link.to)
    return found + [room for room in tour.rooms if room.id not in seen]
