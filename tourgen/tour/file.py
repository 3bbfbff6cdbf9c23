"""Read tour.toml; every fault of it is told at once, in the order of the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from tourgen.errors import Faults, InputError
from tourgen.tour.faults import faults_of
from tourgen.tour.scans import check_headers, check_scans
from tourgen.tour.tables import TOUR_FILE, Room, Tour, TourFile
from tourgen.tour.theme import load_theme
from tourgen.tour.toml import read_toml
from tourgen.tour.values import Context

_READING_KEYS: Final = {"id", "scans", "unit", "up", "clean"}


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
        file = TourFile.model_validate(data, context=_context(folder, data))
    except ValidationError as error:
        raise Faults(_faults(error, data)) from None
    return _tour(folder, file)


def check_tour(folder: Path) -> tuple[Tour, tuple[str, ...]]:
    """Read `folder`/tour.toml, theme.toml and the headers of all scans that are named rightly.

    Returns:
        The tour, and what the publisher should know although a build will succeed.

    Raises:
        Faults: All that is wrong: with tour.toml, in the order of the file, then with theme.toml
            and with the scans.
    """
    data = _parse(folder / TOUR_FILE)
    looks = _faults_of_theme(folder)
    try:
        file = TourFile.model_validate(data, context=_context(folder, data))
    except ValidationError as error:
        faults = _faults(error, data)
        scan_faults, _ = check_headers(_readable_rooms(folder, data), folder)
        raise Faults((*faults, *looks, *scan_faults)) from None
    tour = _tour(folder, file)
    if looks:
        scan_faults, _ = check_headers(tour.rooms, folder)
        raise Faults((*looks, *scan_faults))
    return tour, check_scans(tour)


def _faults_of_theme(folder: Path) -> tuple[InputError, ...]:
    try:
        load_theme(folder)
    except Faults as faults:
        return faults.faults
    return ()


def _faults(error: ValidationError, data: Mapping[str, Any]) -> tuple[InputError, ...]:
    return tuple(
        InputError(f"{TOUR_FILE}: {each.message}", each.hint)
        for each in faults_of(error, data, TourFile)
    )


def _readable_rooms(folder: Path, data: Mapping[str, Any]) -> Iterator[Room]:
    """Of a tour file at fault, the rooms whose scans can be checked all the same."""
    tables = data.get("room")
    for table in tables if isinstance(tables, list) else ():
        if isinstance(table, dict):
            wanted = {key: table[key] for key in table.keys() & _READING_KEYS}
            with suppress(ValidationError):
                yield Room.model_validate(wanted, context=_context(folder, data))


def _tour(folder: Path, file: TourFile) -> Tour:
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
        north_deg=file.tour.north_deg,
        credits=file.tour.credits,
        license=file.tour.license,
        address=file.tour.address,
        rooms=rooms,
        stops=file.stop,
        kiosk=file.kiosk,
    )


def _parse(path: Path) -> dict[str, Any]:
    try:
        return read_toml(path)
    except FileNotFoundError:
        told = InputError(
            f"{TOUR_FILE}: expected a file in `{path.parent}`, found none",
            f"write one with `tourgen new {path.parent}`",
        )
    raise Faults((told,))


def _context(folder: Path, data: Mapping[str, Any]) -> Context:
    head, rooms = data.get("tour"), data.get("room")
    languages = head.get("languages", ["en"]) if isinstance(head, dict) else []
    valid = isinstance(languages, list) and all(isinstance(name, str) for name in languages)
    ids = (
        [room.get("id") for room in rooms or [] if isinstance(room, dict)]
        if isinstance(rooms, list)
        else []
    )
    return Context(
        folder,
        tuple(languages) if valid else (),
        tuple(name for name in ids if isinstance(name, str)),
    )
