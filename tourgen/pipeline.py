"""The recipe: which stage follows which, from a room's scans to its published files.

``room_recipe`` names every stage of a room with its inputs and settings, and thereby its key, and
runs nothing; ``build_rooms`` runs what is missing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from tourgen.cache import Cache, Cost, stamp_of
from tourgen.errors import StageError, TourgenError
from tourgen.expected import stage_of
from tourgen.fitting import picture, points, surface
from tourgen.geometry import View
from tourgen.progress import Listener, Started
from tourgen.remote import local
from tourgen.scheduler import RoomTasks, run_missing
from tourgen.stages import (
    bake,
    crowding,
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
    plan,
    poster,
    register,
    sift,
    spacing,
    stations,
    thin,
    tiles,
    trim,
    unwrap,
    viewpoints,
)
from tourgen.tasks import Task, in_order, missing_tasks, task, why
from tourgen.tour import Room, Tour
from tourgen.workers import Workers

_ROUNDS = 3


@dataclass(frozen=True, slots=True)
class RoomRecipe:
    """The tasks whose results are published.

    Attributes:
        room: The room.
        scan_mb: Size of its scans, megabytes.
        files: Published files by path below the room's folder.
        pictures: Files by name: of the first view, for previews, and of all around.
        entry: The first view.
        plan: The room from above, and the ways out of it.
        viewpoints: Where one stands before each note.
        quality: How well the surface follows the scan.
        summary: The room in figures.
    """

    room: Room
    scan_mb: float
    files: Task[Mapping[str, bytes]]
    pictures: Task[Mapping[str, bytes]]
    entry: Task[View]
    plan: Task[plan.Plan]
    viewpoints: Task[tuple[View, ...]]
    quality: Task[measure.Quality]
    summary: Task[picture.Summary]

    @property
    def goals(self) -> tuple[Task[Any], ...]:
        """All of them."""
        return (
            self.files,
            self.pictures,
            self.entry,
            self.plan,
            self.viewpoints,
            self.quality,
            self.summary,
        )

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
    stamps = {each.file: stamp_of(local(folder, each.file)) for each in room.scans}
    scanned = task(
        "scan",
        partial(points.read, room, folder, stamps),
        settings=points.reading(room),
        digests=tuple(digests[local(folder, each.file)] for each in room.scans),
        version=4,
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
        settings=points.owning(room),
        version=ownership.VERSION + crowding.VERSION,
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
            digests=(digests[local(folder, room.mesh)],),
            version=1,
            libraries=("numba", "trimesh"),
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
        libraries=("numba", "trimesh"),
    )
    simplified = task(
        "levels",
        surface.levelled,
        sound,
        spaced,
        settings=surface.Detail(detail_mm),
        version=levels.VERSION,
        libraries=("fast-simplification", "open3d"),
    )
    tree = task(
        "tiles",
        tiles.tiles,
        simplified,
        settings=tiles.Settings(texel_m=room.texture.texel_mm / 1000),
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
    sized = task(
        "texels",
        picture.sized,
        tree,
        lit,
        scanned,
        settings=picture.Texels(room.texture.texel_mm),
        version=unwrap.VERSION,
        libraries=("numba",),
    )
    unwrapped = tuple(
        task(
            f"unwrap{part}",
            partial(picture.unwrapped, part),
            tree,
            sized,
            version=unwrap.VERSION,
            libraries=("numba", "scipy", "xatlas"),
        )
        for part in picture.PARTS
    )
    continued = task(
        "floors",
        picture.continued,
        oriented,
        lit,
        sound,
        settings=bake.Settings(),
        version=bake.VERSION,
        libraries=("numba", "scipy"),
    )
    colors = task(
        "colors",
        picture.indexed,
        lit,
        continued,
        oriented,
        sized,
        version=bake.VERSION,
        libraries=("numba",),
    )
    overlooked = task(
        "vistas",
        picture.overlooked,
        scanned,
        joined,
        simplified,
        colors,
        settings=bake.VistaSettings(),
        version=bake.VERSION,
        libraries=("open3d", "scipy"),
    )
    baked = tuple(
        task(
            f"bake{part}",
            picture.baked,
            uv_meshes,
            colors,
            overlooked,
            settings=bake.Settings(),
            version=bake.VERSION,
            libraries=("numba", "open3d"),
        )
        for part, uv_meshes in zip(picture.PARTS, unwrapped, strict=True)
    )
    guessed = task(
        "inferred",
        picture.guessed,
        sifted,
        joined,
        spaced,
        unwrapped,
        settings=surface.Detail(detail_mm),
        version=inferred.VERSION,
        libraries=("numba",),
    )
    files = task(
        "pack",
        picture.packed,
        tree,
        guessed,
        baked,
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
        entered,
        baked,
        settings=poster.Settings(),
        version=poster.VERSION,
        libraries=("numba", "open3d", "pillow"),
    )
    drawn = task(
        "plan",
        picture.planned,
        simplified,
        entered,
        settings=picture.Marks(tuple(link.at for link in room.links)),
        version=plan.VERSION,
        libraries=("open3d", "shapely", "trimesh"),
    )
    looked_at = task(
        "viewpoints",
        picture.viewed,
        simplified,
        entered,
        settings=picture.Marks(tuple(note.at for note in room.notes)),
        version=viewpoints.VERSION,
        libraries=("open3d",),
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
        version=5,
    )
    scan_mb = sum(local(folder, each.file).stat().st_size for each in room.scans) / 1e6
    return RoomRecipe(room, scan_mb, files, pictured, entered, drawn, looked_at, measured, summary)


@dataclass(frozen=True, slots=True)
class RoomResult:
    """What a build made of one room.

    Attributes:
        id: The room.
        files: Published files by path below the room's folder.
        pictures: Files by name: of the first view, for previews, and of all around.
        entry: The first view.
        plan: The room from above, and the ways out of it.
        viewpoints: Where one stands before each note.
        quality: How well the surface follows the scan.
        summary: The room in figures.
        costs: Of every stage, when it last ran, in the order of the recipe.
        ran: The stages that ran this time.
    """

    id: str
    files: Mapping[str, bytes]
    pictures: Mapping[str, bytes]
    entry: View
    plan: plan.Plan
    viewpoints: tuple[View, ...]
    quality: measure.Quality
    summary: picture.Summary
    costs: Mapping[str, Cost]
    ran: tuple[str, ...]


def sources(tour: Tour) -> list[Path]:
    """The scans of a tour, and the meshes that were mended elsewhere."""
    files = [local(tour.folder, scan.file) for room in tour.rooms for scan in room.scans]
    return files + [local(tour.folder, room.mesh) for room in tour.rooms if room.mesh]


def tour_recipes(tour: Tour, cache: Cache) -> tuple[RoomRecipe, ...]:
    """The recipe of every room."""
    digests = cache.file_digests(sources(tour))
    return tuple(room_recipe(room, tour.folder, digests) for room in tour.rooms)


def planned(recipe: RoomRecipe, cache: Cache) -> tuple[tuple[str, str], ...]:
    """The stages of a room that a build would run, each with the reason."""
    before = cache.last_ingredients(recipe.room.id)
    reasons: dict[str, str] = {}
    for each in missing_tasks(cache, recipe.goals):
        reasons.setdefault(stage_of(each.name), why(each, before))
    return tuple(reasons.items())


def build_rooms(
    recipes: Sequence[RoomRecipe],
    cache: Cache,
    workers: Workers,
    listener: Listener,
    profiles: Path | None = None,
) -> list[RoomResult | TourgenError]:
    """Run what is missing of the rooms' recipes.

    Args:
        recipes: Of the rooms.
        cache: Of the tour.
        workers: Where stages run.
        listener: Told each stage that starts.
        profiles: Folder for what is sampled of each task, if it is to be.

    Returns:
        For each recipe the result, or why there is none.
    """
    by_id = {recipe.room.id: recipe for recipe in recipes}

    def announce(room: str, stage: str, ahead: tuple[str, ...]) -> None:
        listener(Started(room, stage, ahead, by_id[room].scan_mb))

    wanted = {room: RoomTasks(each.goals, each.scan_mb) for room, each in by_id.items()}
    ran: dict[str, set[str]] = {room: set() for room in by_id}
    found: dict[str, RoomResult | TourgenError] = {}
    for _ in range(_ROUNDS):  # again only where an entry turns out to be broken
        if not wanted:
            break
        for room, outcome in run_missing(wanted, cache, workers, announce, profiles).items():
            if isinstance(outcome, TourgenError):
                found[room] = outcome
                continue
            ran[room] |= set(map(stage_of, outcome))
            result = _result(by_id[room], cache, ran[room])
            if result is not None:
                found[room] = result
        wanted = {room: each for room, each in wanted.items() if room not in found}
    for room in wanted:
        found[room] = StageError(
            f"room `{room}`: expected results that last, found them broken {_ROUNDS} times",
            "look after the disk and the memory",
        )
    return [found[recipe.room.id] for recipe in recipes]


def _result(recipe: RoomRecipe, cache: Cache, ran: set[str]) -> RoomResult | None:
    """What the goals of a recipe came to; None where one is not whole in the cache."""
    goals = [cache.load(each.key) for each in recipe.goals]
    if any(each is None for each in goals):
        return None
    tasks = in_order(recipe.goals)
    cache.remember_ingredients(recipe.room.id, {each.name: each.ingredients for each in tasks})
    costs = _by_stage({each.name: cache.cost(each.key) or Cost(0, 0) for each in tasks})
    in_turn = tuple(stage for stage in costs if stage in ran)
    files, pictures, view, drawn, looked_at, quality, summary = goals
    return RoomResult(
        recipe.room.id, files, pictures, view, drawn, looked_at, quality, summary, costs, in_turn
    )


def _by_stage(costs: Mapping[str, Cost]) -> dict[str, Cost]:
    """What stages cost: those that are split, all parts together."""
    found: dict[str, Cost] = {}
    for name, cost in costs.items():
        before = found.get(stage_of(name), Cost(0, 0))
        found[stage_of(name)] = Cost(
            round(before.seconds + cost.seconds, 3), max(before.peak_rss_mb, cost.peak_rss_mb)
        )
    return found
