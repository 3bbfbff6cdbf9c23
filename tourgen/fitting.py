"""Fitting: each stage's settings for one room, from the scan's spacing and the tour file.

A stage takes lengths; a publisher gives a few or none. What is left out follows from how far
apart the scan's points lie. Each function here runs one stage so fitted; its own settings, what
the tour file says, are what enters the stage's key.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from tourgen.geometry import (
    Float64,
    Mesh,
    OrientedCloud,
    PointCloud,
    TexturedMesh,
    Tile,
    UvMesh,
    View,
)
from tourgen.scans import ReadFacts, read_room
from tourgen.stages import (
    bake,
    clean,
    entry,
    floor,
    levels,
    measure,
    pack,
    poster,
    stations,
    thin,
    trim,
    unwrap,
)
from tourgen.stages.mesh_arrays import face_areas
from tourgen.stages.spacing import Spacing, spacing_at
from tourgen.stages.surface import poisson
from tourgen.tileset import tileset_json
from tourgen.tour import Box, Room, Viewpoint, open_scans

_FINEST_DETAIL_M = 0.006
"""Solves a room of 7 m at octree depth 10; depth 11 takes four times the time and memory."""
_ROOT_TEXELS = 500_000
_POSTER_QUALITY = 82

Corner = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Reading:
    """How scans become one cloud."""

    unit: str
    up: str
    poses: tuple[Any, ...]
    scan_stations: tuple[Any, ...]
    stations: Any
    keep: tuple[Corner, Corner] | None
    remove: tuple[tuple[Corner, Corner], ...]


@dataclass(frozen=True, slots=True)
class Detail:
    """The finest detail asked for, millimetres; None follows from the scan."""

    detail_mm: float | None


@dataclass(frozen=True, slots=True)
class Thinning:
    """The voxel asked for; None is half the detail."""

    detail_mm: float | None
    thin_mm: float | None


@dataclass(frozen=True, slots=True)
class Solving:
    """The octree asked for; a depth of None follows from the room's size and the detail."""

    detail_mm: float | None
    depth: int | None


@dataclass(frozen=True, slots=True)
class Trimming:
    """Boxes in which a surface stays whatever the scanner saw through it."""

    closed: tuple[tuple[Corner, Corner], ...]


@dataclass(frozen=True, slots=True)
class Texels:
    """Edge of a texel at the finest level, at the finest."""

    texel_mm: float


@dataclass(frozen=True, slots=True)
class Packing:
    """Quality of the pictures, 1 to 100."""

    quality: int


@dataclass(frozen=True, slots=True)
class Entering:
    """The first view that the tour file gives, if any."""

    position: Corner | None
    look_at: Corner | None


@dataclass(frozen=True, slots=True)
class RoomScan:
    """What the scans hold: the cropped cloud, where the scanner stood, and how reading went."""

    cloud: PointCloud
    stations: Float64
    facts: ReadFacts


@dataclass(frozen=True, slots=True)
class Level:
    """One level of detail in figures."""

    tiles: int
    faces: int
    bytes: int


@dataclass(frozen=True, slots=True)
class Summary:
    """A room in figures, for the tour's pages and the report.

    Attributes:
        origin: (3,) float64, of all the room's coordinates.
        bounds: (2, 3) float64, lowest and highest corner, metres from the origin.
        facts: How reading went.
        points_used: Points left after cleaning.
        stations: (s, 3) float64, given or found, metres from the origin.
        levels: Coarsest first.
    """

    origin: Float64
    bounds: Float64
    facts: ReadFacts
    points_used: int
    stations: Float64
    levels: tuple[Level, ...]


def reading(room: Room) -> Reading:
    """What of a room's settings bears on reading."""
    return Reading(
        room.unit,
        room.up,
        tuple(scan.pose for scan in room.scans),
        tuple(scan.station for scan in room.scans),
        room.stations,
        _corners(room.keep) if room.keep else None,
        boxes(room.remove),
    )


def boxes(given: tuple[Box, ...]) -> tuple[tuple[Corner, Corner], ...]:
    """Boxes as pairs of corners."""
    return tuple(_corners(box) for box in given)


def _corners(box: Box) -> tuple[Corner, Corner]:
    return box.min, box.max


def entering(start: Viewpoint | None) -> Entering:
    """The first view that the tour file gives."""
    return Entering(start.position, start.look_at) if start else Entering(None, None)


def read(room: Room, folder: Path, _: Reading) -> RoomScan:
    """Read a room's scans; the settings are those of the room, gathered for the key."""
    scans = open_scans(room, folder)
    cloud, found, facts = read_room(scans, room.keep, room.remove, room.clean.min_points)
    if room.stations == "auto":
        return RoomScan(cloud, found, facts)
    given = np.array(room.stations, np.float64) - cloud.origin
    owner = cloud.station if len(found) == len(given) else np.full_like(cloud.station, -1)
    return RoomScan(PointCloud(cloud.origin, cloud.points, cloud.colors, owner), given, facts)


def cleaned(scan: RoomScan, settings: clean.Settings) -> PointCloud:
    """Clean the cloud of a room."""
    return clean.clean(scan.cloud, settings)


def stations_of(scan: RoomScan, cloud: PointCloud, settings: stations.Settings) -> Float64:
    """The stations as given, or as the scan tells, or as found."""
    if len(scan.stations):
        return scan.stations
    return stations.find_stations(cloud.points, settings)


def detail_m(spacing: Spacing, detail_mm: float | None) -> float:
    """The finest detail: what is asked for, else what the median spacing can carry."""
    return detail_mm / 1000 if detail_mm else max(spacing.median_m, _FINEST_DETAIL_M)


def thinned(cloud: PointCloud, spacing: Spacing, asked: Thinning) -> PointCloud:
    """Thin to half the detail, so that each cell of the octree keeps several points.

    A scan denser than the detail is thinned further, toward a point a cell: each is the mean of
    so many that more would only cost.
    """
    detail = detail_m(spacing, asked.detail_mm)
    voxel_m = max(detail / 2, detail - spacing.median_m / 2)
    return thin.thin(cloud, thin.Settings(asked.thin_mm / 1000 if asked.thin_mm else voxel_m))


def floored(oriented: OrientedCloud, spacing: Spacing) -> OrientedCloud:
    """Lay the floor under the tripods as densely as the scan is."""
    return floor.floor(oriented, floor.Settings(spacing.median_m))


def solved(oriented: OrientedCloud, spacing: Spacing, asked: Solving) -> Mesh:
    """Solve for the surface, cells as wide as the detail."""
    settings = poisson.Settings(detail_m(spacing, asked.detail_mm), asked.depth or 0)
    return poisson.poisson(oriented, settings)


def support_m(spacing: Spacing) -> float:
    """How far from every point a surface is no longer supported."""
    return max(0.03, 3 * spacing.median_m)


def trimmed(
    mesh: Mesh, oriented: OrientedCloud, cloud: PointCloud, spacing: Spacing, asked: Trimming
) -> Mesh:
    """Open the openings."""
    closed = tuple(
        (_from_origin(low, mesh.origin), _from_origin(high, mesh.origin))
        for low, high in asked.closed
    )
    return trim.trim(mesh, oriented, cloud, trim.Settings(support_m(spacing), closed=closed))


def _from_origin(corner: Corner, origin: Float64) -> Corner:
    x, y, z = (float(value) for value in np.subtract(corner, origin))
    return x, y, z


def levelled(mesh: Mesh, spacing: Spacing, asked: Detail) -> levels.Levels:
    """Simplify to the finest and the coarsest level."""
    return levels.levels(mesh, levels.Settings(detail_m(spacing, asked.detail_mm)))


def unwrapped(room: tuple[Tile, ...], cloud: PointCloud, asked: Texels) -> tuple[UvMesh, ...]:
    """Unwrap each tile.

    A leaf's texels are half as wide as the scan's spacing there, down to the size asked for; a
    branch's are twice those below it; the root's make a picture of a fixed size.
    """
    texel_m = _texels(room, cKDTree(cloud.points), asked.texel_mm / 1000)
    return tuple(unwrap.unwrap(tile.mesh, unwrap.Settings(texel_m[tile.id])) for tile in room)


def _texels(room: tuple[Tile, ...], tree: cKDTree, finest_m: float) -> dict[str, float]:
    rng = np.random.default_rng(0)
    texel_m: dict[str, float] = {}
    for tile in reversed(room):  # children first
        if tile.children:
            texel_m[tile.id] = 2 * float(np.median([texel_m[child] for child in tile.children]))
            continue
        vertices = tile.mesh.vertices
        sample = vertices[rng.choice(len(vertices), min(200, len(vertices)), replace=False)]
        _, nearest = tree.query(sample)
        spacing_m = spacing_at(tree, tree.data[nearest].astype(np.float32))
        texel_m[tile.id] = max(finest_m, 0.5 * float(np.median(spacing_m)))
    root = room[0]
    if root.children:
        texel_m[root.id] = float(np.sqrt(face_areas(root.mesh).sum() / _ROOT_TEXELS))
    return texel_m


def baked(
    unwrapped_tiles: tuple[UvMesh, ...],
    oriented: OrientedCloud,
    cloud: PointCloud,
    settings: bake.Settings,
) -> tuple[TexturedMesh, ...]:
    """Bake each tile's picture from the full cloud."""
    finest_m = min(each.texel_m for each in unwrapped_tiles)
    index = bake.color_index(cloud, oriented, finest_m)
    return tuple(bake.bake(each, index, settings) for each in unwrapped_tiles)


def packed(
    room: tuple[Tile, ...], textured: tuple[TexturedMesh, ...], asked: Packing
) -> Mapping[str, bytes]:
    """Pack all tiles on one quantisation grid, and write the tileset."""
    vertices = np.concatenate([tile.mesh.vertices for tile in room])
    settings = pack.Settings(grid=pack.grid(vertices), quality=asked.quality)
    files = {
        f"tiles/{tile.id}.glb": pack.pack(each, settings)
        for tile, each in zip(room, textured, strict=True)
    }
    return {"tileset.json": tileset_json(room), **files}


def entered(simplified: levels.Levels, known: Float64, asked: Entering) -> View:
    """The first view: as given, else found."""
    if asked.position is None or asked.look_at is None:
        return entry.entry_view(simplified.root, known, entry.Settings())
    origin = simplified.root.origin
    return View(np.array(asked.position) - origin, np.array(asked.look_at) - origin)


def pictured(
    room: tuple[Tile, ...],
    textured: tuple[TexturedMesh, ...],
    view: View,
    settings: poster.Settings,
) -> bytes:
    """Render the first view from the finest level, as WebP."""
    from PIL import Image

    leaves = [each for tile, each in zip(room, textured, strict=True) if not tile.children]
    stream = io.BytesIO()
    picture = Image.fromarray(poster.poster(leaves, view, settings))
    picture.save(stream, "WEBP", quality=_POSTER_QUALITY, method=6)
    return stream.getvalue()


def measured(simplified: levels.Levels, cloud: PointCloud, spacing: Spacing) -> measure.Quality:
    """Compare the finest mesh with the scan."""
    return measure.measure(simplified.finest, cloud, measure.Settings(support_m(spacing)))


def summarised(
    scan: RoomScan,
    cloud: PointCloud,
    known: Float64,
    room: tuple[Tile, ...],
    files: Mapping[str, bytes],
) -> Summary:
    """Gather the figures that pages and report show."""
    vertices = np.concatenate([tile.mesh.vertices for tile in room]).astype(np.float64)
    return Summary(
        scan.cloud.origin,
        np.stack([vertices.min(axis=0), vertices.max(axis=0)]),
        scan.facts,
        len(cloud),
        known,
        tuple(_level(room, files, depth) for depth in range(_depth(room) + 1)),
    )


def _depth(room: tuple[Tile, ...]) -> int:
    return max(len(tile.id) for tile in room) - 1


def _level(room: tuple[Tile, ...], files: Mapping[str, bytes], depth: int) -> Level:
    """The room at one level: its tiles of that depth, and the leaves above."""
    shown = [
        tile
        for tile in room
        if len(tile.id) == depth + 1 or (len(tile.id) <= depth and not tile.children)
    ]
    return Level(
        len(shown),
        sum(len(tile.mesh.faces) for tile in shown),
        sum(len(files[f"tiles/{tile.id}.glb"]) for tile in shown),
    )
