"""A room as each method draws it, and what the bench makes of a tour beside.

Only what is published needs tiles, textures and posters: a method is run as far as the levels of
detail, in the cache of the tour that it is a variant of, so that the points are cleaned once.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from apart import apart
from rooms import GALLERY

from tourgen.build import build_tour
from tourgen.cache import Cache
from tourgen.errors import TourgenError
from tourgen.fitting.surface import Drawn
from tourgen.pipeline import tour_recipes
from tourgen.scheduler import RoomTasks, run_missing
from tourgen.stages.levels import Levels
from tourgen.tasks import Task, in_order
from tourgen.tour import Tour, load_tour
from tourgen.workers import Here

GALLERY_TOUR = f"""[tour]
title = {{ en = "Gallery" }}

[[room]]
id = "{GALLERY}"
scans = ["scans/scan_structured.e57"]
"""
_NEEDED = ("surface", "levels")


def gallery_tour(gallery: Path, scratch: Path) -> Tour:
    """A tour with the gallery alone."""
    folder = scratch / "gallery"
    folder.mkdir(parents=True, exist_ok=True)
    link(folder / "scans", gallery)
    (folder / "tour.toml").write_text(GALLERY_TOUR, encoding="utf-8")
    return load_tour(folder)


def link(place: Path, target: Path) -> None:
    """A folder or file that is another's."""
    if not place.is_symlink():
        place.symlink_to(target.resolve(), target_is_directory=target.is_dir())


def alone(tour: Tour, room: str, folder: Path, **changes: Any) -> Tour:
    """A tour of one room in a folder, without texts and doors.

    Args:
        tour: That has the room.
        room: Its id.
        folder: Where the paths of the room start.
        changes: Settings of the room that differ.
    """
    bare = tour.room(room).model_copy(update={"text": {}, "links": (), "notes": (), **changes})
    return tour.model_copy(update={"folder": folder.resolve(), "start": room, "rooms": (bare,)})


def scanned(tour: Tour, room: str, scan: str) -> dict[str, Any]:
    """The change that lets a room take one other scan."""
    first = tour.room(room).scans[0]
    return {"scans": (first.model_copy(update={"file": scan}),)}


def drawn(tour: Tour, room: str, method: str, scratch: Path) -> Path | str:
    """The finest level of a room by a method; why not, where it cannot be drawn.

    Args:
        tour: Its cache is used.
        room: To be drawn.
        method: For ``room.surface.method``; the room's other settings stay.
        scratch: Keeps the mesh.

    Returns:
        An ``.npz`` with ``vertices``, ``faces`` and ``told``, what the report says of the surface.
    """
    surface = tour.room(room).surface.model_copy(update={"method": method})
    variant = alone(tour, room, tour.folder, surface=surface)
    file = scratch / "drawn" / room / f"{method}-{tasks_of(variant, room)['levels'].key[:16]}.npz"
    why = file.with_suffix(".txt")
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        why.unlink(missing_ok=True)
        failed = apart(_draw, variant, file, why)
        if failed or why.exists():
            return failed or why.read_text(encoding="utf-8")
    return file


def _draw(variant: Tour, file: Path, why: Path) -> None:
    tasks, cache = tasks_of(variant, variant.start), Cache(variant.folder)
    wanted = RoomTasks(tuple(tasks[name] for name in _NEEDED), 0.0)
    outcome = run_missing({variant.start: wanted}, cache, Here(), _tell)[variant.start]
    if isinstance(outcome, TourgenError):
        why.write_text(outcome.message, encoding="utf-8")
        return
    levels: Levels = cache.load(tasks["levels"].key)
    surface: Drawn = cache.load(tasks["surface"].key)
    mesh = levels.finest
    aside = file.with_name(f".{file.name}")
    told = np.array(surface.told)
    np.savez(aside, vertices=mesh.vertices + mesh.origin, faces=mesh.faces, told=told)
    aside.rename(file)


def tasks_of(tour: Tour, room: str) -> dict[str, Task[Any]]:
    """The stages of a room by name."""
    recipes = tour_recipes(tour, Cache(tour.folder))
    (goals,) = (recipe.goals for recipe in recipes if recipe.room.id == room)
    return {each.name: each for each in in_order(goals)}


def built(variant: Tour) -> Path | str:
    """The site of a tour, in its folder; why not, where it cannot be built."""
    why = variant.folder / "failed.txt"
    why.unlink(missing_ok=True)
    failed = apart(_build, variant, why)
    if failed or why.exists():
        return failed or why.read_text(encoding="utf-8")
    return variant.folder / "site"


def _build(variant: Tour, why: Path) -> None:
    try:
        build_tour(variant, variant.folder / "site", lambda at: _tell(at.room, at.stage, at.ahead))
    except TourgenError as error:
        why.write_text(error.message, encoding="utf-8")


def _tell(_room: str, stage: str, _ahead: tuple[str, ...]) -> None:
    if stage:  # "" when a room is done
        print(f"  {stage}", flush=True)
