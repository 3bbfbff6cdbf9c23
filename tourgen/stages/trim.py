"""Trim: mend what the solve closed where no scan supports it.

The solve spans every gap with a surface of its own. Where that surface runs through space that
no station looked into (a shadow, the blind disc under a tripod), it stays as it is. Where it
runs through space that a station knows to be empty, it is one of two:

- *Opening*: behind most of it the stations measured nothing at all. It is cut away. Had there
  been a wall, it would have been measured. Small gaps in what was measured look the same: they
  count only where the whole unsupported patch around them is such (in the demo's rooms patches
  are so over 0.96 or under 0.02 of their area, a few excepted).
- *Bulge*: the stations measured the room behind it. The true surface lies hidden somewhere
  behind, as below a table or beside a bed. To cut it away would leave a hole into the void;
  instead it is drawn back, against its normals, to the edge of what is known to be empty, and
  smoothed. Where it comes out on its own other side before, it was a thin skin, and is cut.
  (Pixels void outside true openings, in 50 views of 480 by 320 of each of the demo's rooms:
  1,745, 23,365 and 6,215 with bulges cut, 58, 1 and 47 with bulges drawn back.)

Where no station is known, gaps up to ``bridge_area_m2`` stay. Boxes of the tour file that are
marked closed (mirrors, black screens: the scanner sees through those too) always stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64, Mesh, OrientedCloud, PointCloud
from tourgen.stages.mesh_arrays import (
    compact,
    components,
    edges,
    face_adjacency,
    face_areas,
    vertex_areas,
    vertex_normals,
)
from tourgen.stages.sight import FreeSpace, free_space

VERSION = 3
_STEP_M = 0.02
_FARTHEST_M = 1.5
"""A bulge deeper than this is none."""
_SMOOTHINGS = 10

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Settings:
    """What counts as supported.

    Attributes:
        support_m: What lies farther than this from every point is unsupported.
        lowest_deg: Lower edge of a scanner's field of view.
        sight_cell_deg: Cell of the stations' depth buffers.
        margin_m: How far in front of what was measured space is known to be empty.
        back_margin_m: The same where a bulge comes to rest.
        door_area_m2: An opening as large is one, whatever is around it.
        bridge_area_m2: Largest gap that is bridged where no station is known.
        closed: Boxes ((min), (max)), metres from the origin, in which every surface stays.
    """

    support_m: float
    lowest_deg: float = -58.0
    sight_cell_deg: float = 0.75
    margin_m: float = 0.08
    back_margin_m: float = 0.02
    door_area_m2: float = 0.3
    bridge_area_m2: float = 0.3
    closed: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...] = ()


def trim(mesh: Mesh, oriented: OrientedCloud, full: PointCloud, settings: Settings) -> Mesh:
    """Open the openings, draw back the bulges.

    Args:
        mesh: The closed surface, faces counter-clockwise seen from the free space.
        oriented: The points that it was solved from, with the stations.
        full: The unthinned points, for what each station saw.
        settings: See ``Settings``.

    Returns:
        The mesh without the faces that close openings.
    """
    distance_m = _distance_m(mesh.vertices, oriented.cloud.points, settings.support_m)
    distance_m[_in_boxes(mesh.vertices, settings)] = 0
    loose = np.isinf(distance_m)
    if not loose.any():
        return mesh
    if not len(oriented.stations):
        return _without_patches(mesh, loose, loose, settings.bridge_area_m2)
    free = free_space(
        full.points,
        oriented.stations,
        settings.sight_cell_deg,
        settings.lowest_deg,
        settings.margin_m,
    )
    at = np.flatnonzero(loose)
    patch = _regions(mesh, at)
    held = free.holds(mesh.vertices[at])
    at, patch = at[held], patch[held]
    region, area_m2 = _regions(mesh, at), vertex_areas(mesh)[at]
    out = free.leads_out(mesh.vertices[at])
    large = (np.bincount(region, area_m2) > settings.door_area_m2)[region]
    opening = _mostly(out, region, area_m2) & (large | _mostly(out, patch, area_m2))
    back_m = _way_back(mesh, at, replace(free, margin_m=settings.back_margin_m))
    cut = opening | _mostly(np.isnan(back_m), region, area_m2)
    drawn = _drawn_back(mesh, at[~cut], np.nan_to_num(back_m[~cut]))
    gone = np.zeros(len(mesh.vertices), bool)
    gone[at[cut]] = True
    gone |= _rim(mesh.vertices, distance_m, gone, settings.support_m)
    return _without_patches(drawn, loose, gone, 0.0)


def _distance_m(places: Float32, points: Float32, most_m: float) -> Float64:
    """From each place to the nearest point, infinite where it is farther than ``most_m``."""
    distance, _ = cKDTree(points).query(places, distance_upper_bound=most_m, workers=-1)
    return np.asarray(distance)


def _in_boxes(places: Float32, settings: Settings) -> Mask:
    inside = np.zeros(len(places), bool)
    for low, high in settings.closed:
        inside |= np.all((places >= low) & (places <= high), axis=1)
    return inside


def _regions(mesh: Mesh, at: npt.NDArray[np.int64]) -> npt.NDArray[np.int32]:
    """Number of the connected region that each chosen vertex lies in."""
    number = np.full(len(mesh.vertices), -1)
    number[at] = np.arange(len(at))
    pair = number[edges(mesh.faces)]
    return components(pair[np.all(pair >= 0, axis=1)], len(at))


def _mostly(chosen: Mask, label: npt.NDArray[np.int32], area_m2: Float64) -> Mask:
    """Mask of the vertices in whose region most of the area is chosen."""
    return (np.bincount(label, area_m2 * chosen) > 0.5 * np.bincount(label, area_m2))[label]


def _way_back(mesh: Mesh, at: npt.NDArray[np.int64], free: FreeSpace) -> Float64:
    """How far each vertex must go, against its normal, to leave the space known to be empty.

    NaN where it comes out on the other side of the mesh before, or never leaves.
    """
    import open3d as o3d

    start, way = mesh.vertices[at], -vertex_normals(mesh)[at]
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh.vertices, mesh.faces.astype(np.uint32))
    rays = np.concatenate([start + _STEP_M / 4 * way, way], axis=1)
    through_m = scene.cast_rays(rays)["t_hit"].numpy() + _STEP_M / 4
    back_m = np.full(len(at), np.nan)
    going = np.arange(len(at))
    for gone_m in np.arange(_STEP_M, _FARTHEST_M, _STEP_M):
        going = going[gone_m < through_m[going]]
        still = free.holds(start[going] + np.float32(gone_m) * way[going])
        back_m[going[~still]] = gone_m
        going = going[still]
    return back_m


def _drawn_back(mesh: Mesh, at: npt.NDArray[np.int64], back_m: Float64) -> Mesh:
    """Move vertices against their normals, then smooth them; the others hold the rim."""
    vertices = mesh.vertices.astype(np.float64)
    vertices[at] -= back_m[:, None] * vertex_normals(mesh)[at]
    row = np.full(len(vertices), -1)
    row[at] = np.arange(len(at))
    edge = edges(mesh.faces)
    edge = edge[row[edge[:, 0]] >= 0]
    around = coo_array(
        (np.ones(len(edge)), (row[edge[:, 0]], edge[:, 1])), (len(at), len(vertices))
    ).tocsr()
    count = np.maximum(around.sum(axis=1), 1)[:, None]
    for _ in range(_SMOOTHINGS):
        vertices[at] = (vertices[at] + around @ vertices / count) / 2
    return Mesh(mesh.origin, vertices.astype(np.float32), mesh.faces)


def _rim(vertices: Float32, distance_m: Float64, gone: Mask, support_m: float) -> Mask:
    """The hardly supported vertices around an opening: what is left of its pane."""
    rim = np.isfinite(distance_m) & (distance_m > support_m / 2)
    rim[rim] = np.isfinite(_distance_m(vertices[rim], vertices[gone], support_m))
    return rim


def _without_patches(mesh: Mesh, loose: Mask, cut: Mask, least_m2: float) -> Mesh:
    """Drop the faces with two vertices to cut, and the loose patches that are mostly such.

    Args:
        mesh: Where from.
        loose: Mask of the unsupported vertices.
        cut: Mask of those to cut.
        least_m2: Smaller patches stay.
    """
    drop = cut[mesh.faces].sum(axis=1) >= 2
    at = np.flatnonzero(loose[mesh.faces].all(axis=1) | drop)
    if not len(at):
        return mesh
    patch = _patches(mesh, at)
    area = face_areas(mesh)[at]
    patch_area = np.bincount(patch, area)
    mostly = np.bincount(patch, area * drop[at]) > 0.5 * patch_area
    drop[at] = (drop[at] | mostly[patch]) & (patch_area > least_m2)[patch]
    return compact(mesh, ~drop)


def _patches(mesh: Mesh, at: npt.NDArray[np.int64]) -> npt.NDArray[np.int32]:
    """Number of the connected patch that each chosen face lies in."""
    local = np.full(len(mesh.faces), -1)
    local[at] = np.arange(len(at))
    pair = local[face_adjacency(mesh.faces)]
    pair = pair[np.all(pair >= 0, axis=1)]
    return components(pair, len(at))
