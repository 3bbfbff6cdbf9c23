"""Fitting the picture: unwrapping, baking and packing tiles, the first view, and figures."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from tourgen.expected import SPLIT
from tourgen.fitting.lengths import Corner, detail_m
from tourgen.fitting.points import RoomScan, moved
from tourgen.fitting.surface import Detail, Drawn
from tourgen.geometry import (
    Float32,
    Float64,
    Mesh,
    OrientedCloud,
    Panorama,
    PointCloud,
    TexturedMesh,
    Tile,
    UInt8,
    UvMesh,
    View,
)
from tourgen.neighbours import Neighbours
from tourgen.scans import ReadFacts
from tourgen.stages import (
    bake,
    entry,
    inferred,
    levels,
    pack,
    plan,
    poster,
    register,
    sift,
    tiles,
    unwrap,
    viewpoints,
)
from tourgen.stages.mesh_arrays import face_areas
from tourgen.stages.spacing import FOURTH, Spacing, spacing_at
from tourgen.tileset import tileset_json
from tourgen.tour import Viewpoint

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

Item = TypeVar("Item")
_POSTER_QUALITY = 82
_PREVIEW = (1200, 630)
"""As most of those who show previews of links ask for, pixels."""


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
class Marks:
    """Where the marks of a room's doors, or of its notes, hang, in the frame of its scans."""

    at: tuple[Corner, ...]

    def of(self, origin: Float64) -> Float64:
        """(n, 3) metres from the room's origin."""
        return np.asarray(np.array(self.at, np.float64).reshape(-1, 3) - origin)


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
        points_crowded: Points dropped since others are as near as no picture could show.
        points_used: Points left after cleaning.
        stations: (s, 3) float64, given or found, metres from the origin.
        station_moved_mm: (s,) float64, how far registration moved each.
        removed: Points dropped by cleaning, by cause.
        surface: Which method drew it and why.
        levels: Coarsest first.
    """

    origin: Float64
    bounds: Float64
    facts: ReadFacts
    points_crowded: int
    points_used: int
    stations: Float64
    station_moved_mm: Float64
    removed: Mapping[str, int]
    surface: str
    levels: tuple[Level, ...]


def entering(start: Viewpoint | None) -> Entering:
    """The first view that the tour file gives."""
    return Entering(start.position, start.look_at) if start else Entering(None, None)


@dataclass(frozen=True, slots=True)
class Part:
    """Some of a room's tiles, which one task works on; written as the end of its name."""

    number: int
    of: int

    def __str__(self) -> str:
        return f"{SPLIT}{self.number + 1}/{self.of}"

    def take(self, room: Sequence[Item]) -> Sequence[Item]:
        """This part of all tiles, or of what belongs to them; near ones are together."""
        count = len(room)
        return room[count * self.number // self.of : count * (self.number + 1) // self.of]


PARTS = tuple(Part(number, 8) for number in range(8))


def sized(
    room: tuple[Tile, ...], cloud: PointCloud, scan: RoomScan, asked: Texels
) -> dict[str, float]:
    """Edge of each tile's texels, metres, by its id.

    A leaf's texels are half as wide as the spacing of the samples that colour it, points and the
    nearest panorama's pixels, down to the size asked for; a branch's are twice those below it; the
    root's make a picture of a fixed size.
    """
    return _texels(room, cloud.points, scan.panoramas, asked.texel_mm / 1000)


def unwrapped(
    part: Part, room: tuple[Tile, ...], texel_m: Mapping[str, float]
) -> tuple[UvMesh, ...]:
    """Unwrap the tiles of a part."""
    return tuple(
        unwrap.unwrap(tile.mesh, unwrap.Settings(texel_m[tile.id])) for tile in part.take(room)
    )


def _texels(
    room: tuple[Tile, ...], points: Float32, panoramas: tuple[Panorama, ...], finest_m: float
) -> dict[str, float]:
    rng = np.random.default_rng(0)
    around = Neighbours.of(points, FOURTH)
    texel_m: dict[str, float] = {}
    for tile in reversed(room):  # children first
        if tile.children:
            texel_m[tile.id] = 2 * float(np.median([texel_m[child] for child in tile.children]))
            continue
        vertices = tile.mesh.vertices
        sample = vertices[rng.choice(len(vertices), min(200, len(vertices)), replace=False)]
        nearest = around.nearest(sample, 1)[0][:, 0]
        spacing_m = spacing_at(around, points[nearest])
        density = 1 / np.maximum(spacing_m, 1e-6) ** 2 + _pixels_on(sample, panoramas)
        texel_m[tile.id] = max(finest_m, 0.5 * float(np.median(1 / np.sqrt(density))))
    root = room[0]
    if root.children:
        area_m2 = float(face_areas(root.mesh).sum())
        below_m = min(texel_m[child] for child in root.children)
        texel_m[root.id] = max(below_m, math.sqrt(area_m2 / tiles.ROOT_TEXELS))
    return texel_m


def _pixels_on(places: Float32, panoramas: tuple[Panorama, ...]) -> Float64:
    """(n,) pixels of the nearest panorama on a square metre that faces it."""
    density = np.zeros(len(places))
    for each in panoramas:
        distance_m = np.linalg.norm(places - each.position, axis=1)
        pixel_rad2 = each.pixel_rad[0] * each.pixel_rad[1]
        density = np.maximum(density, 1 / (pixel_rad2 * np.maximum(distance_m, 0.1) ** 2))
    return density


def continued(
    oriented: OrientedCloud,
    cloud: PointCloud,
    surface: Mesh,
    settings: bake.Settings,
) -> PointCloud:
    """Points that continue the picture of floors where they were not seen."""
    return bake.continued_floors(cloud, oriented, surface, settings)


def indexed(
    cloud: PointCloud,
    unseen: PointCloud,
    oriented: OrientedCloud,
    texel_m: Mapping[str, float],
) -> bake.ColorIndex:
    """The colours of all points, to be looked up by place."""
    return bake.color_index(cloud.joined(unseen), oriented, min(texel_m.values()))


def overlooked(
    scan: RoomScan,
    joined: register.Registered,
    simplified: levels.Levels,
    index: bake.ColorIndex,
    settings: bake.VistaSettings,
) -> tuple[bake.Vista, ...]:
    """The panoramas, where there are any, made ready to colour the surface."""
    return bake.vistas(moved(scan.panoramas, joined), simplified.finest, index, settings)


def baked(
    uv_meshes: tuple[UvMesh, ...],
    index: bake.ColorIndex,
    vistas: tuple[bake.Vista, ...],
    settings: bake.Settings,
) -> tuple[TexturedMesh, ...]:
    """Bake the pictures of some tiles from all points, and from panoramas."""
    return tuple(bake.bake(each, index, settings, vistas) for each in uv_meshes)


def guessed(
    kept: sift.Sifted,
    joined: register.Registered,
    spacing: Spacing,
    parts: tuple[tuple[UvMesh, ...], ...],
    asked: Detail,
) -> tuple[UInt8, ...]:
    """Which vertices of each tile no measurement stands behind."""
    vertices = tuple(each.mesh.vertices for part in parts for each in part)
    settings = inferred.Settings(detail_m(spacing, asked.detail_mm))
    return inferred.inferred(vertices, kept.cloud, joined.stations, settings)


def packed(
    room: tuple[Tile, ...],
    guessed: tuple[UInt8, ...],
    parts: tuple[tuple[TexturedMesh, ...], ...],
    asked: Packing,
) -> Mapping[str, bytes]:
    """Pack all tiles on one quantisation grid, and write the tileset."""
    textured = chain(*parts)
    vertices = np.concatenate([tile.mesh.vertices for tile in room])
    settings = pack.Settings(grid=pack.grid(vertices), quality=asked.quality)
    files = {
        f"tiles/{tile.id}.glb": pack.pack(each, guess, settings)
        for tile, each, guess in zip(room, textured, guessed, strict=True)
    }
    return {"tileset.json": tileset_json(room), **files}


def entered(simplified: levels.Levels, joined: register.Registered, asked: Entering) -> View:
    """The first view: as given, else found."""
    if asked.position is None or asked.look_at is None:
        return entry.entry_view(simplified.root, joined.stations, entry.Settings())
    origin = simplified.root.origin
    return View(np.array(asked.position) - origin, np.array(asked.look_at) - origin)


def pictured(
    room: tuple[Tile, ...],
    view: View,
    parts: tuple[tuple[TexturedMesh, ...], ...],
    settings: poster.Settings,
) -> Mapping[str, bytes]:
    """Render the first view from the finest level: for the page, for previews, and all around."""
    from PIL import Image, ImageOps

    leaves = [each for tile, each in zip(room, chain(*parts), strict=True) if not tile.children]
    scene = poster.Scene(leaves)
    first = Image.fromarray(poster.poster(scene, view, settings))
    preview = ImageOps.fit(first, _PREVIEW, Image.Resampling.LANCZOS)
    around = Image.fromarray(poster.around(scene, view, settings))
    return {
        "poster.webp": _encoded(first, "WEBP", method=6),
        "preview.jpg": _encoded(preview, "JPEG", optimize=True, progressive=True),
        "around.webp": _encoded(around, "WEBP", method=4),
    }


def _encoded(picture: Picture, form: str, **options: Any) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, form, quality=_POSTER_QUALITY, **options)
    return stream.getvalue()


def planned(simplified: levels.Levels, view: View, doors: Marks) -> plan.Plan:
    """Draw the room's plan, and tell which way its doors lead."""
    mesh = simplified.finest
    return plan.plan(mesh, view.position, doors.of(mesh.origin), plan.Settings())


def viewed(simplified: levels.Levels, view: View, notes: Marks) -> tuple[View, ...]:
    """Where one stands before each note."""
    mesh = simplified.finest
    return viewpoints.viewpoints(mesh, notes.of(mesh.origin), view, viewpoints.Settings())


def summarised(
    scan: RoomScan,
    joined: register.Registered,
    kept: sift.Sifted,
    found: Drawn,
    room: tuple[Tile, ...],
    files: Mapping[str, bytes],
) -> Summary:
    """Gather the figures that pages and report show."""
    vertices = np.concatenate([tile.mesh.vertices for tile in room]).astype(np.float64)
    return Summary(
        scan.cloud.origin,
        np.stack([vertices.min(axis=0), vertices.max(axis=0)]),
        scan.facts,
        len(scan.cloud) - len(joined.cloud),
        len(kept.cloud),
        joined.stations,
        joined.moved_mm,
        kept.removed,
        found.told,
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
