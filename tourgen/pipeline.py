"""The recipe: which stage follows which, from a room's scans to its published files.

``room_recipe`` names every stage of a room with its inputs and settings, and thereby its key, and
runs nothing; ``build_room`` runs what is missing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from tourgen.cache import Cache, Cost
from tourgen.fitting import picture, points, surface
from tourgen.geometry import View
from tourgen.progress import Listener, Started
from tourgen.stages import (
    bake,
    entry,
    exposure,
    floor,
    hygiene,
    inferred,
    levels,
    measure,
    normals,
    ownership,
    pack,
    poster,
    register,
    sift,
    spacing,
    stations,
    thin,
    tiles,
    trim,
    unwrap,
)
from tourgen.tasks import Runner, Task, in_order, missing_tasks, task, why
from tourgen.tour import Room, Tour


@dataclass(frozen=True, slots=True)
class RoomRecipe:
    """The tasks whose results are published.

    Attributes:
        room: The room.
        scan_mb: Size of its scans, megabytes.
        files: Published files by path below the room's folder.
        poster: Picture of the first view, WebP.
        entry: The first view.
        quality: How well the surface follows the scan.
        summary: The room in figures.
    """

    room: Room
    scan_mb: float
    files: Task[Mapping[str, bytes]]
    poster: Task[bytes]
    entry: Task[View]
    quality: Task[measure.Quality]
    summary: Task[picture.Summary]

    @property
    def goals(self) -> tuple[Task[Any], ...]:
        """All of them."""
        return (self.files, self.poster, self.entry, self.quality, self.summary)

    @property
    def keys(self) -> tuple[str, ...]:
        """Of every stage, inputs first."""
        return tuple(each.key for each in in_order(self.goals))


def room_recipe(room: Room, folder: Path, digests: Mapping[Path, str]) -> RoomRecipe:
    """Name every stage of a room.

    Args:
        room: What tour.toml says.
        folder: Where its paths start.
        digests: Of the scans' contents, by path.
    """
    detail_mm = room.surface.detail_mm
    scanned = task(
        "scan",
        partial(points.read, room, folder),
        settings=points.reading(room),
        digests=tuple(digests[folder / each.file] for each in room.scans),
        version=3,
        libraries=("pye57",),
    )
    stood = task(
        "stations",
        points.stations_of,
        scanned,
        settings=stations.Settings(),
        version=stations.VERSION,
        libraries=("scipy",),
    )
    owned = task(
        "ownership",
        points.owned,
        scanned,
        stood,
        settings=ownership.Settings(),
        version=ownership.VERSION,
        libraries=("numba", "scipy"),
    )
    joined = task(
        "register",
        points.registered,
        owned,
        settings=register.Settings(),
        version=register.VERSION,
        libraries=(
            "numba",
            "scipy",
        ),
    )
    sifted = task(
        "sift",
        points.sifted,
        joined,
        settings=sift.Settings(min_points=room.clean.min_points),
        version=sift.VERSION,
        libraries=("numba", "scipy"),
    )
    spaced = task("spacing", points.spaced, sifted, version=spacing.VERSION, libraries=("numba",))
    thinned = task(
        "thin",
        points.thinned,
        sifted,
        spaced,
        settings=points.Thinning(detail_mm, room.clean.thin_mm),
        version=thin.VERSION,
    )
    turned = task(
        "normals",
        points.oriented,
        thinned,
        joined,
        settings=normals.Settings(),
        version=normals.VERSION,
        libraries=("numba", "open3d", "scipy"),
    )
    oriented = task("floor", points.floored, turned, spaced, version=floor.VERSION)
    found = (
        task(
            "mesh",
            partial(surface.mended, room, folder),
            sifted,
            settings=surface.Mended(room.mesh, room.unit, room.up),
            digests=(digests[folder / room.mesh],),
            version=1,
            libraries=("trimesh",),
        )
        if room.mesh
        else task(
            "surface",
            partial(surface.drawn, room.surface),
            oriented,
            spaced,
            settings=surface.drawing(room.surface),
            version=surface.VERSION,
            libraries=("numba", "open3d", "scipy"),
        )
    )
    trimmed = task(
        "trim",
        surface.trimmed,
        found,
        oriented,
        sifted,
        spaced,
        settings=surface.trimming(room),
        version=trim.VERSION,
        libraries=(
            "numba",
            "scipy",
        ),
    )
    sound = task(
        "hygiene",
        hygiene.hygiene,
        trimmed,
        settings=hygiene.Settings(),
        version=hygiene.VERSION,
        libraries=("trimesh",),
    )
    simplified = task(
        "levels",
        surface.levelled,
        sound,
        spaced,
        settings=surface.Detail(detail_mm),
        version=levels.VERSION,
        libraries=("fast-simplification",),
    )
    tree = task(
        "tiles",
        tiles.tiles,
        simplified,
        settings=tiles.Settings(),
        version=tiles.VERSION,
        libraries=("fast-simplification",),
    )
    lit = task(
        "exposure",
        points.exposed,
        sifted,
        joined,
        settings=exposure.Settings(),
        version=exposure.VERSION,
        libraries=("numba", "scipy"),
    )
    unwrapped = task(
        "unwrap",
        picture.unwrapped,
        tree,
        lit,
        scanned,
        settings=picture.Texels(room.texture.texel_mm),
        version=unwrap.VERSION,
        libraries=("numba", "xatlas", "scipy"),
    )
    baked = task(
        "bake",
        picture.baked,
        unwrapped,
        oriented,
        lit,
        scanned,
        joined,
        simplified,
        settings=bake.Settings(),
        version=bake.VERSION,
        libraries=("numba", "open3d", "scipy"),
    )
    guessed = task(
        "inferred",
        picture.guessed,
        unwrapped,
        sifted,
        joined,
        spaced,
        settings=surface.Detail(detail_mm),
        version=inferred.VERSION,
        libraries=(
            "numba",
            "scipy",
        ),
    )
    files = task(
        "pack",
        picture.packed,
        tree,
        baked,
        guessed,
        settings=picture.Packing(room.texture.quality),
        version=pack.VERSION,
        libraries=("DracoPy", "pygltflib", "pillow"),
    )
    entered = task(
        "entry",
        picture.entered,
        simplified,
        joined,
        settings=picture.entering(room.start),
        version=entry.VERSION,
        libraries=("open3d",),
    )
    pictured = task(
        "poster",
        picture.pictured,
        tree,
        baked,
        entered,
        settings=poster.Settings(),
        version=poster.VERSION,
        libraries=("open3d", "pillow"),
    )
    measured = task(
        "measure",
        surface.measured,
        simplified,
        sifted,
        joined,
        spaced,
        settings=surface.Detail(detail_mm),
        version=measure.VERSION,
        libraries=("numba", "open3d", "scipy"),
    )
    summary = task(
        "summary",
        picture.summarised,
        scanned,
        joined,
        sifted,
        found,
        tree,
        files,
        version=4,
    )
    scan_mb = sum((folder / each.file).stat().st_size for each in room.scans) / 1e6
    return RoomRecipe(room, scan_mb, files, pictured, entered, measured, summary)


@dataclass(frozen=True, slots=True)
class RoomResult:
    """What a build made of one room.

    Attributes:
        id: The room.
        files: Published files by path below the room's folder.
        poster: Picture of the first view, WebP.
        entry: The first view.
        quality: How well the surface follows the scan.
        summary: The room in figures.
        costs: Of every stage, when it last ran, in the order of the recipe.
        ran: The stages that ran this time.
    """

    id: str
    files: Mapping[str, bytes]
    poster: bytes
    entry: View
    quality: measure.Quality
    summary: picture.Summary
    costs: Mapping[str, Cost]
    ran: tuple[str, ...]


def tour_recipes(tour: Tour, cache: Cache) -> tuple[RoomRecipe, ...]:
    """The recipe of every room."""
    files = [tour.folder / scan.file for room in tour.rooms for scan in room.scans]
    files += [tour.folder / room.mesh for room in tour.rooms if room.mesh]
    digests = cache.file_digests(files)
    return tuple(room_recipe(room, tour.folder, digests) for room in tour.rooms)


def planned(recipe: RoomRecipe, cache: Cache) -> tuple[tuple[str, str], ...]:
    """The stages of a room that a build would run, each with the reason."""
    before = cache.last_ingredients(recipe.room.id)
    return tuple((each.name, why(each, before)) for each in missing_tasks(cache, recipe.goals))


def build_room(recipe: RoomRecipe, cache: Cache, listener: Listener) -> RoomResult:
    """Run what is missing of a room's recipe.

    Args:
        recipe: The room's.
        cache: Of the tour.
        listener: Told each stage that starts.
    """
    waiting = tuple(each.name for each in missing_tasks(cache, recipe.goals))

    def announce(each: Task[Any]) -> None:
        ahead = waiting[waiting.index(each.name) :] if each.name in waiting else (each.name,)
        listener(Started(recipe.room.id, each.name, ahead, recipe.scan_mb))

    runner = Runner(cache, recipe.goals, announce)
    runner.run()
    result = RoomResult(
        recipe.room.id,
        runner.result(recipe.files),
        runner.result(recipe.poster),
        runner.result(recipe.entry),
        runner.result(recipe.quality),
        runner.result(recipe.summary),
        {each.name: cache.cost(each.key) or Cost(0, 0) for each in in_order(recipe.goals)},
        tuple(runner.ran),
    )
    cache.remember_ingredients(
        recipe.room.id, {each.name: each.ingredients for each in in_order(recipe.goals)}
    )
    listener(Started(recipe.room.id, "", (), recipe.scan_mb))
    return result
