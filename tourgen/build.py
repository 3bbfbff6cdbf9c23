"""Build: a tour's folder in, its published site out."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tourgen.alone import alone
from tourgen.cache import Cache
from tourgen.errors import Faults, InputError, TourgenError
from tourgen.geometry import Float64, View
from tourgen.pipeline import (
    RoomRecipe,
    RoomResult,
    build_rooms,
    planned,
    sources,
    tour_recipes,
)
from tourgen.profile import require_profiler, write_flame_graph
from tourgen.progress import Listener
from tourgen.remote import has_fetched, is_remote, send
from tourgen.report import tour_report
from tourgen.site import BuiltRoom, Made, write_site
from tourgen.stages import entry
from tourgen.threads import cores
from tourgen.tour import Link, Tour, Viewpoint
from tourgen.unchanged import forget_build, remember_build, seen_by_build
from tourgen.workers import Workers, workers

_STEP_INSIDE_M = 0.9
_LOCK = Path(".tourgen") / "lock"
_SENT = Path(".tourgen") / "sent"
"""Where a site is kept that is sent elsewhere."""


class RoomsFailed(TourgenError):
    """Some rooms could not be built; the site published before stands.

    Args:
        errors: One a room that failed.
    """

    def __init__(self, errors: tuple[TourgenError, ...], /) -> None:
        Exception.__init__(self, errors)
        self.errors = errors
        self.message = "\n".join(error.message for error in errors)
        self.hint = ""
        self.exit_code = max(error.exit_code for error in errors)


@dataclass(frozen=True, slots=True)
class Planned:
    """What a build would run of one room: stages, each with the reason."""

    room: str
    stages: tuple[tuple[str, str], ...]


def plan_tour(tour: Tour) -> tuple[Planned, ...]:
    """What a build would do, and why."""
    cache = Cache(tour.folder)
    return tuple(
        Planned(recipe.room.id, planned(recipe, cache)) for recipe in tour_recipes(tour, cache)
    )


def build_tour(
    tour: Tour,
    out: Path | str,
    listener: Listener,
    *,
    only: Sequence[str] = (),
    jobs: int | None = None,
    cluster: str | None = None,
    profile: Path | None = None,
    single_files: bool = False,
) -> dict[str, Any]:
    """Build a tour's site.

    Args:
        tour: What tour.toml says.
        out: The site's folder, swapped in whole; or an address that it is sent to.
        listener: Told each stage that starts.
        only: Ids of the rooms to build; the others must have been built before. Empty: all.
        jobs: Tasks that run at once; as many as there are cores if left out.
        cluster: Address of a dask scheduler, whose workers run them instead.
        profile: Page that a flame graph of what ran is written to.
        single_files: Whether the site shall hold the tour and each room as one file, too.

    Returns:
        The report.

    Raises:
        InputError: ``only`` cannot be used, or the output folder; or another build runs.
        MissingTool: The library for the address is not installed.
        RoomsFailed: Rooms could not be built.
        Faults: The single file of a room would be larger than browsers open.
    """
    busy = InputError(
        f"`{tour.folder}`: expected no other build of it, found one that runs",
        "wait for that one, or stop it",
    )
    with alone(tour.folder / _LOCK, busy):
        started = time.perf_counter()
        sent = is_remote(str(out))
        here = tour.folder / _SENT if sent else Path(out)
        seen = seen_by_build(tour.folder, here, sources(tour))
        cache = Cache(tour.folder)
        recipes = tour_recipes(tour, cache)
        _require_built(recipes, [tour.room(room_id).id for room_id in only], cache)
        at_work = any(planned(recipe, cache) for recipe in recipes)
        with workers((jobs or cores()) if at_work else 1, cluster if at_work else None) as crew:
            if profile:
                outcomes = _profiled(recipes, cache, crew, listener, profile)
            else:
                outcomes = build_rooms(recipes, cache, crew, listener)
        rooms = [outcome for outcome in outcomes if isinstance(outcome, RoomResult)]
        if len(rooms) < len(outcomes):
            raise RoomsFailed(tuple(each for each in outcomes if isinstance(each, TourgenError)))
        report = tour_report(rooms, time.perf_counter() - started)
        published = _published(tour, {room.id: room for room in rooms})
        report = write_site(tour, published, report, here, single_files=single_files)
        if sent:
            send(here, str(out))
        cache.prune(frozenset(key for recipe in recipes for key in recipe.keys))
        if sent or has_fetched(tour.folder):
            forget_build(tour.folder)
        else:
            remember_build(tour.folder, here, seen)
        return report


def _profiled(
    recipes: Sequence[RoomRecipe], cache: Cache, crew: Workers, listener: Listener, page: Path
) -> list[RoomResult | TourgenError]:
    """Build rooms, and write where the time goes."""
    require_profiler()
    with TemporaryDirectory(dir=cache.tour_folder, prefix=".profile-") as folder:
        outcomes = build_rooms(recipes, cache, crew, listener, Path(folder))
        files = sorted(Path(folder).iterdir())
        if files:
            write_flame_graph(files, page)
    return outcomes


def _require_built(recipes: Iterable[RoomRecipe], only: Sequence[str], cache: Cache) -> None:
    faults = [
        InputError(
            f"room `{recipe.room.id}`: expected it built, found {len(missing)} stages missing",
            f"build it too: `--room {recipe.room.id}`",
        )
        for recipe in recipes
        if only and recipe.room.id not in only and (missing := planned(recipe, cache))
    ]
    if faults:
        raise Faults(tuple(faults))


def _published(tour: Tour, rooms: Mapping[str, RoomResult]) -> list[BuiltRoom]:
    return [
        BuiltRoom(
            room.id,
            built.summary.origin,
            built.summary.bounds,
            built.entry,
            tuple(_arrival(tour, link, room.id, rooms[link.to]) for link in room.links),
            built.viewpoints,
            built.plan,
            {**built.files, **built.pictures},
            _made(built),
        )
        for room in tour.rooms
        for built in [rooms[room.id]]
    ]


def _made(room: RoomResult) -> Made:
    summary, quality = room.summary, room.quality
    return Made(
        summary.points_used,
        len(summary.stations),
        summary.levels[-1].faces,
        (quality.cloud_to_mesh_p50_mm, quality.cloud_to_mesh_p95_mm),
        quality.inferred_area_ratio,
    )


def _arrival(tour: Tour, link: Link, source: str, target: RoomResult) -> View:
    """Where a visitor arrives: as given, else inside the door back, else at the entry."""
    if link.arrive:
        return _view(link.arrive, target)
    doors = tour.room(link.to).links
    back = next((number for number, each in enumerate(doors) if each.to == source), None)
    if back is None:
        return target.entry
    door = np.array(doors[back].at) - target.summary.origin
    return inside_door(door, target.plan.door_floor_m[back], target.plan.door_way[back])


def inside_door(door: Float64, floor_m: float, way: Float64) -> View:
    """Where one stands who came through a door, on its storey, looking into the room.

    Args:
        door: (3,) its mark, metres.
        floor_m: Height of the floor there.
        way: (2,) unit vector out of the room.
    """
    inward = np.append(-way, 0.0)
    position = door + _STEP_INSIDE_M * inward
    position[2] = floor_m + entry.Settings().eye_m
    return View(position, position + 2 * inward)


def _view(given: Viewpoint, room: RoomResult) -> View:
    origin = room.summary.origin
    return View(np.array(given.position) - origin, np.array(given.look_at) - origin)
