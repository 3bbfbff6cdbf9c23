"""Plan: a room from above, cut open at a person's height, once a storey; and which way doors lead.

Storeys lie where one can arrive: below the entry and below every door. A floor between them that
only a stair leads to is drawn with the storey next to it. What the cut meets are walls and high
furniture; a second cut at the knee tells the rest. Lines end where the surface is open, at windows
and doors; the floor between them is what the lines enclose once those gaps are bridged, the
narrowest first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
import trimesh
from scipy.spatial.distance import cdist
from shapely import LineString, MultiLineString, Polygon

from tourgen.geometry import Float32, Float64, Mesh
from tourgen.rays import ray_scene, rays_of
from tourgen.stages.mesh_arrays import face_areas, face_normals

VERSION = 1
_AROUND = np.linspace(0, 2 * np.pi, 12, endpoint=False)
_UPRIGHT = 0.3
"""Faces whose normal leans less from the level than this sine are of walls."""
_NEAR_M = 0.3
"""What is farther from a door than this tells less and less of its wall."""
_ON_GRID_M = 1e-4
_LEAST_M2 = 0.02


@dataclass(frozen=True, slots=True)
class Settings:
    """How it is cut.

    Attributes:
        cut_m: Height of the cut above the floor.
        knee_m: Height of the lower one.
        storey_m: Floors nearer together are one storey.
        gap_m: The widest gap that is bridged.
        exact_m: How far a drawn line may lie from the cut.
        least_m: Shorter lines are not drawn.
        feel_m: How far around a door its wall is felt for.
    """

    cut_m: float = 1.2
    knee_m: float = 0.45
    storey_m: float = 1.5
    gap_m: float = 3.0
    exact_m: float = 0.008
    least_m: float = 0.12
    feel_m: float = 1.0


@dataclass(frozen=True, slots=True)
class Storey:
    """One storey of a room; coordinates are metres from the mesh's origin, x right and y up.

    Attributes:
        floor_m: Height of its floor.
        floor: Rings (k, 2) around the floor and around what stands on it; inside is what an odd
            number of them encloses.
        walls: Lines (k, 2) that the cut meets.
        low: Lines (k, 2) that the lower cut meets and the cut does not.
    """

    floor_m: float
    floor: tuple[Float32, ...]
    walls: tuple[Float32, ...]
    low: tuple[Float32, ...]


@dataclass(frozen=True, slots=True)
class Plan:
    """A room's plan.

    Attributes:
        storeys: From below.
        door_floor_m: (d,) height of the floor at each door.
        door_way: (d, 2) unit vectors out of the room through each door.
    """

    storeys: tuple[Storey, ...]
    door_floor_m: Float64
    door_way: Float64


def plan(mesh: Mesh, entry: Float64, doors: Float64, settings: Settings) -> Plan:
    """Draw a room's plan.

    Args:
        mesh: The room.
        entry: (3,) where one enters, metres from the mesh's origin.
        doors: (d, 3) the marks of doors.
        settings: See ``Settings``.
    """
    below = _floors_below(mesh, np.concatenate([entry[None], doors]))
    floors = _apart(below, settings.storey_m)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    storeys = tuple(_storey(solid, floor_m, settings) for floor_m in floors)
    return Plan(storeys, below[1:], _ways_out(mesh, doors, settings.feel_m))


def _floors_below(mesh: Mesh, places: Float64) -> Float64:
    """(n,) height of the floor below (n, 3) places; in an open doorway that of what is around."""
    scene = ray_scene(mesh.vertices, mesh.faces)
    rings = [np.zeros((1, 3))]
    rings += [
        radius * np.stack([np.cos(_AROUND), np.sin(_AROUND), np.zeros(len(_AROUND))], axis=1)
        for radius in (0.3, 0.6)
    ]
    offsets = np.concatenate(rings)
    starts = places[:, None] + offsets
    down = np.broadcast_to([0.0, 0.0, -1.0], starts.shape)
    depth = scene.cast_rays(rays_of(starts, down))["t_hit"].numpy().astype(np.float64)
    lowest = float(mesh.vertices[:, 2].min())
    floors = []
    for z, row in zip(places[:, 2], depth, strict=True):
        met = row[np.isfinite(row)]
        drop = row[0] if np.isfinite(row[0]) else np.median(met) if len(met) else z - lowest
        floors.append(z - drop)
    return np.array(floors, np.float64)


def _apart(heights: Float64, least_m: float) -> list[float]:
    """Of some heights, from below, those that are so far apart."""
    found: list[float] = []
    for height in np.sort(heights):
        if not found or height - found[-1] >= least_m:
            found.append(float(height))
    return found


def _ways_out(mesh: Mesh, doors: Float64, feel_m: float) -> Float64:
    """(d, 2) away from what the walls around each door look at."""
    corners = mesh.vertices[mesh.faces]
    centre, normal, area = corners.mean(axis=1), face_normals(mesh), face_areas(mesh)
    upright = np.abs(normal[:, 2]) < _UPRIGHT
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    ways = []
    for door in doors:
        off = centre - door
        near = upright & (np.abs(off) < feel_m).all(axis=1)
        pull = area[near] / (np.square(off[near]).sum(axis=1) + _NEAR_M**2)
        way = -(pull[:, None] * normal[near, :2]).sum(axis=0)
        if not np.linalg.norm(way) > 0.1 * pull.sum():
            way = (door - middle)[:2]
        ways.append(way / max(float(np.linalg.norm(way)), 1e-9))
    return np.array(ways, np.float64).reshape(-1, 2)


# ------------------------------------------------------------------ lines


def _storey(solid: trimesh.Trimesh, floor_m: float, settings: Settings) -> Storey:
    walls = _cut(solid, floor_m + settings.cut_m, settings.exact_m)
    low = _cut(solid, floor_m + settings.knee_m, settings.exact_m)
    near = shapely.buffer(MultiLineString(walls), 5 * settings.exact_m)
    rest = _lines(shapely.difference(MultiLineString(low), near))
    return Storey(
        floor_m,
        _floor(walls, settings),
        _drawn(walls, settings.least_m),
        _drawn(rest, settings.least_m),
    )


def _cut(solid: trimesh.Trimesh, height_m: float, exact_m: float) -> list[LineString]:
    """Where a level plane cuts a mesh, as lines as long as they go."""
    pieces = trimesh.intersections.mesh_plane(solid, [0, 0, 1], [0, 0, height_m])[:, :, :2]
    pieces = np.round(pieces / _ON_GRID_M) * _ON_GRID_M
    pieces = pieces[(pieces[:, 0] != pieces[:, 1]).any(axis=1)]
    if not len(pieces):
        return []
    joined = shapely.line_merge(shapely.multilinestrings(shapely.linestrings(pieces)))
    return _lines(shapely.simplify(joined, exact_m))


def _lines(shape: shapely.Geometry) -> list[LineString]:
    parts = shapely.get_parts(shape)
    return [each for each in parts if isinstance(each, LineString) and each.length > 0]


def _drawn(lines: list[LineString], least_m: float) -> tuple[Float32, ...]:
    return tuple(
        np.asarray(each.coords, np.float32)[:, :2] for each in lines if each.length >= least_m
    )


def _floor(walls: list[LineString], settings: Settings) -> tuple[Float32, ...]:
    """Rings around what the walls enclose."""
    rings = [each for each in walls if each.is_closed]
    rings += _bridged([each for each in walls if not each.is_closed], settings.gap_m)
    covered = Polygon()
    for ring in sorted(rings, key=lambda each: -Polygon(each).area):
        covered = covered.symmetric_difference(Polygon(ring).buffer(0))
    found: list[npt.NDArray[np.float64]] = []
    for part in shapely.get_parts(covered):
        if part.area >= _LEAST_M2:
            every = [part.exterior, *part.interiors]
            found += [np.asarray(ring.coords) for ring in every if Polygon(ring).area >= _LEAST_M2]
    return tuple(np.asarray(ring, np.float32) for ring in found)


def _bridged(lines: list[LineString], gap_m: float) -> list[LineString]:
    """Rings of open lines: the two ends nearest to each other are joined, again and again."""
    open_lines = [np.asarray(each.coords)[:, :2] for each in lines]
    rings = []
    while open_lines:
        ends = np.array([[line[0], line[-1]] for line in open_lines]).reshape(-1, 2)
        apart = cdist(ends, ends)
        apart[np.diag_indices(len(ends))] = np.inf
        one, other = np.unravel_index(np.argmin(apart), apart.shape)
        if apart[one, other] > gap_m:
            break
        first, second = int(one) // 2, int(other) // 2
        if first == second:
            line = open_lines.pop(first)
            if len(line) > 2:
                rings.append(LineString(np.concatenate([line, line[:1]])))
            continue
        before = open_lines[first] if one % 2 else open_lines[first][::-1]
        after = open_lines[second][::-1] if other % 2 else open_lines[second]
        for index in sorted((first, second), reverse=True):
            open_lines.pop(index)
        open_lines.append(np.concatenate([before, after]))
    return rings
