"""Stops: the guided path that a published tour tells, looked over before anything is drawn."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tourgen.errors import Faults, InputError

Json = dict[str, Any]

_LEAST = 2


def read_path(site: Path, language: str) -> Json:
    """What tour.json of a site says.

    Args:
        site: The site's folder.
        language: That the film shall speak; "" for any.

    Raises:
        Faults: The path cannot be filmed.
    """
    tour: Json = json.loads((site / "tour.json").read_text(encoding="utf-8"))
    faults = [*_path_faults(tour), *_language_faults(tour, language)]
    if faults:
        raise Faults(tuple(faults))
    return tour


def _path_faults(tour: Json) -> list[InputError]:
    rooms = [room["id"] for room in tour["rooms"]]
    faults = [
        InputError(
            f"stop {number}: expected a room of the tour, found `{stop['room']}`",
            f"its rooms are: {', '.join(rooms)}",
        )
        for number, stop in enumerate(tour["stops"], 1)
        if stop["room"] not in rooms
    ]
    if len(tour["stops"]) < _LEAST:
        faults.append(
            InputError(
                f"guided path: expected at least {_LEAST} stops, found {len(tour['stops'])}",
                "say [[stop]]s in tour.toml, or notes in its rooms, and build again",
            )
        )
    return faults


def _language_faults(tour: Json, language: str) -> list[InputError]:
    spoken = tour["languages"]
    if not language or language in spoken:
        return []
    return [
        InputError(
            f"--language: expected one of the tour's, found `{language}`",
            f"it speaks: {', '.join(spoken)}",
        )
    ]


def blocked_faults(blocked: list[Json]) -> list[InputError]:
    """The ways that the viewer did not find.

    Args:
        blocked: Of the viewer's plan: numbers of two stops, from 0, and their room.
    """
    return [
        InputError(
            f"stop {way['to'] + 1}: expected a way from stop {way['from'] + 1} "
            f"in room `{way['room']}`, found walls between them",
            "move it, or lead round with a further [[stop]] in tour.toml, and build again",
        )
        for way in blocked
    ]
