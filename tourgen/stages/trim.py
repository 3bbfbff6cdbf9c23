"""Trim: mend what the solve closed where no scan supports it.

The solve spans every gap with a surface of its own. Where that surface runs through space that
no station looked into (a shadow, the blind disc under a tripod), it stays as it is. Where it
runs through space that a station knows to be empty, it is one of two:

- *Opening*: behind most of it the stations measured nothing at all. It is cut away. Had there
  been a wall, it would have been measured. Small gaps in what was measured look the same: they
  count only where the whole unsupported patch around them is such (in the demo's rooms patches
  are so over 0.96 or under 0.02 of their area, a few excepted).
- *Bulge*: the stations measured the room behind it; see ``bulges``.

Where no station is known, gaps up to ``bridge_area_m2`` stay. Boxes of the tour file that are
marked closed (mirrors, black screens: the scanner sees through those too) always stay.

What then hangs in the air, borne by next to no point, goes too; see ``specks``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Mesh, OrientedCloud, PointCloud
from tourgen.neighbours import Neighbours
from tourgen.stages.bulges import mostly, without_bulges
from tourgen.stages.covers import with_covers
from tourgen.stages.free_space import LOWEST_DEG, free_space
from tourgen.stages.mesh_arrays import (
    compact,
    components,
    face_adjacency,
    face_areas,
    regions,
    vertex_areas,
    vertex_normals,
)
from tourgen.stages.specks import without_specks

VERSION = 11
_ALIKE = 0.5
"""Cosine between a pane and its rest, at least."""
_AROUND = 2.0
"""What is so many times as near to an unsupported patch as its support would be lies around it."""

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Settings:
    """What counts as supported.

    Attributes:
        support_m: What lies farther than this from every point is unsupported.
        lowest_deg: Lower edge of a scanner's field of view.
        void_deg: Where no beam lies nearer in direction, none returned.
        margin_m: How far in front of what was measured space is known to be empty.
        back_margin_m: The same where a bulge comes to rest.
        door_area_m2: An opening as large is one, whatever is around it.
        bridge_area_m2: Largest gap that is bridged where no station is known.
        closed: Boxes ((min), (max)), metres from the origin, in which every surface stays.
    """

    support_m: float
    lowest_deg: float = LOWEST_DEG
    void_deg: float = 1.1
    margin_m: float = 0.08
    back_margin_m: float = 0.02
    door_area_m2: float = 0.3
    bridge_area_m2: float = 0.3
    closed: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...] = ()


def trim(mesh: Mesh, oriented: OrientedCloud, full: PointCloud, settings: Settings) -> Mesh:
    """Open the openings, draw back the bulges, drop what hangs in the air.

    Args:
        mesh: The closed surface, faces counter-clockwise seen from the free space.
        oriented: The points that it was solved from, with the stations.
        full: The unthinned points, for what each station saw.
        settings: See ``Settings``.

    Returns:
        The mesh without the faces that close openings.
    """
    opened = _opened(mesh, oriented, full, settings)
    return without_specks(opened, oriented.cloud.points, settings.support_m)


def _opened(mesh: Mesh, oriented: OrientedCloud, full: PointCloud, settings: Settings) -> Mesh:
    distance_m = _distance_m(mesh.vertices, oriented.cloud.points, settings.support_m)
    distance_m[_in_boxes(mesh.vertices, settings)] = 0
    loose = np.isinf(distance_m)
    if not loose.any():
        return mesh
    if not len(oriented.stations):
        return _without_patches(mesh, loose, settings.bridge_area_m2)
    free = free_space(
        full,
        oriented.stations,
        settings.void_deg,
        settings.lowest_deg,
        settings.margin_m,
    )
    at = np.flatnonzero(loose)
    patch = regions(mesh, at)
    held = free.holds(mesh.vertices[at])
    at, patch = at[held], patch[held]
    region, area_m2 = regions(mesh, at), vertex_areas(mesh)[at]
    out = free.leads_out(mesh.vertices[at])
    large = (np.bincount(region, area_m2) > settings.door_area_m2)[region]
    opening = mostly(out, region, area_m2) & (large | mostly(out, patch, area_m2))
    cut, drawn = opening.copy(), mesh
    if not opening.all():
        shut = np.flatnonzero(~opening)
        behind = replace(free, margin_m=settings.back_margin_m)
        drawn, floating = without_bulges(mesh, at[shut], region[shut], behind, settings.support_m)
        cut[shut[floating]] = True
    gone = np.zeros(len(mesh.vertices), bool)
    gone[at[cut]] = True
    gone = with_covers(mesh, loose, gone, oriented.cloud.points, _AROUND * settings.support_m)
    gone |= _rim(mesh, distance_m, gone, settings.support_m)
    return compact(drawn, ~_cut_faces(drawn, gone))


def _distance_m(places: Float32, points: Float32, most_m: float) -> Float32:
    """From each place to the nearest point, infinite where it is farther than ``most_m``."""
    return Neighbours.of(points, 1).nearest(places, 1, most_m)[1][:, 0]


def _in_boxes(places: Float32, settings: Settings) -> Mask:
    inside = np.zeros(len(places), bool)
    for low, high in settings.closed:
        inside |= np.all((places >= low) & (places <= high), axis=1)
    return inside


def _rim(mesh: Mesh, distance_m: Float32, gone: Mask, support_m: float) -> Mask:
    """The hardly supported vertices around an opening that look as it does: its pane's rest.

    The reveal of a window, which may be as hardly supported, looks across it.
    """
    rim = np.isfinite(distance_m) & (distance_m > support_m / 2)
    if not gone.any() or not rim.any():
        return np.zeros(len(rim), bool)
    at, cut = np.flatnonzero(rim), np.flatnonzero(gone)
    near = Neighbours.of(mesh.vertices[cut], 1).nearest(mesh.vertices[at], 1, support_m)[0][:, 0]
    normal = vertex_normals(mesh)
    found = near >= 0
    at, beside = at[found], cut[near[found]]
    rim = np.zeros(len(rim), bool)
    rim[at[np.einsum("ij,ij->i", normal[at], normal[beside]) > _ALIKE]] = True
    return rim


def _cut_faces(mesh: Mesh, cut: Mask) -> Mask:
    """Mask of the faces with two vertices to cut."""
    return np.asarray(cut[mesh.faces].sum(axis=1) >= 2)


def _without_patches(mesh: Mesh, loose: Mask, least_m2: float) -> Mesh:
    """Drop the patches of unsupported surface.

    Args:
        mesh: Where from.
        loose: Mask of the unsupported vertices.
        least_m2: Smaller patches stay.
    """
    drop = _cut_faces(mesh, loose)
    at = np.flatnonzero(drop)
    patch = _patches(mesh, at)
    drop[at] = (np.bincount(patch, face_areas(mesh)[at]) > least_m2)[patch]
    return compact(mesh, ~drop)


def _patches(mesh: Mesh, at: npt.NDArray[np.int64]) -> npt.NDArray[np.int32]:
    """Number of the connected patch that each chosen face lies in."""
    local = np.full(len(mesh.faces), -1)
    local[at] = np.arange(len(at))
    pair = local[face_adjacency(mesh.faces)]
    pair = pair[np.all(pair >= 0, axis=1)]
    return components(pair, len(at))
