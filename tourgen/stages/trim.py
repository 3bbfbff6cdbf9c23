"""Trim: take away the surface that no scan supports where it closes a true opening.

The solve spans every gap. A gap is one of three:

- *Shadow*: something stood between it and each station. The surface stays.
- *Blind disc*: it lies under the tripod, below the field of view. The surface stays.
- *Opening*: a station looked right through it, within its field of view, and met nothing as near.
  The surface goes: had there been a wall, the station would have measured it.

Where no station is known, gaps up to ``bridge_area_m2`` stay. Boxes of the tour file that are
marked closed (mirrors, black screens: the scanner sees through those too) always stay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64, Mesh, OrientedCloud, PointCloud
from tourgen.stages.mesh_arrays import compact, components, face_adjacency, face_areas
from tourgen.stages.sight import depth_buffer

VERSION = 1


@dataclass(frozen=True, slots=True)
class Settings:
    """What counts as supported.

    Attributes:
        support_m: A face farther than this from every point is unsupported.
        lowest_deg: Lower edge of a scanner's field of view.
        sight_cell_deg: Cell of the stations' depth buffers.
        margin_m: How much nearer than the next thing seen a surface must be to count as missed.
        bridge_area_m2: Largest gap that is bridged where no station is known.
        closed: Boxes ((min), (max)), metres from the origin, in which every surface stays.
    """

    support_m: float
    lowest_deg: float = -58.0
    sight_cell_deg: float = 0.75
    margin_m: float = 0.08
    bridge_area_m2: float = 0.3
    closed: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...] = ()


def trim(mesh: Mesh, oriented: OrientedCloud, full: PointCloud, settings: Settings) -> Mesh:
    """Open the openings.

    Args:
        mesh: The closed surface.
        oriented: The points that it was solved from, with the stations.
        full: The unthinned points, for what each station saw.
        settings: See ``Settings``.

    Returns:
        The mesh without the faces that close openings.
    """
    centre = mesh.vertices[mesh.faces].mean(axis=1)
    loose = _unsupported(centre, oriented.cloud.points, settings.support_m)
    loose &= ~_in_boxes(centre, settings)
    at = np.flatnonzero(loose)
    if not len(at):
        return mesh
    patch = _patches(mesh, at)
    area = face_areas(mesh)[at]
    patch_area = np.bincount(patch, weights=area)
    if len(oriented.stations):
        seen_through = _seen_through(centre[at], full.points, oriented.stations, settings)
        through_area = np.bincount(patch, weights=area * seen_through)
        cut = seen_through | (through_area > 0.5 * patch_area)[patch]
    else:
        cut = (patch_area > settings.bridge_area_m2)[patch]
    keep = np.ones(len(mesh.faces), bool)
    keep[at[cut]] = False
    return compact(mesh, keep)


def _unsupported(centre: Float32, points: Float32, support_m: float) -> npt.NDArray[np.bool_]:
    distance, _ = cKDTree(points).query(centre, distance_upper_bound=support_m, workers=-1)
    return np.isinf(distance)


def _in_boxes(centre: Float32, settings: Settings) -> npt.NDArray[np.bool_]:
    inside = np.zeros(len(centre), bool)
    for low, high in settings.closed:
        inside |= np.all((centre >= low) & (centre <= high), axis=1)
    return inside


def _patches(mesh: Mesh, at: npt.NDArray[np.int64]) -> npt.NDArray[np.int32]:
    """Number of the connected patch that each chosen face lies in."""
    local = np.full(len(mesh.faces), -1)
    local[at] = np.arange(len(at))
    pair = local[face_adjacency(mesh.faces)]
    pair = pair[np.all(pair >= 0, axis=1)]
    return components(pair, len(at))


def _seen_through(
    centre: Float32, points: Float32, stations: Float64, settings: Settings
) -> npt.NDArray[np.bool_]:
    through = np.zeros(len(centre), bool)
    for station in stations:
        buffer = depth_buffer(points, station, settings.sight_cell_deg)
        through |= buffer.looks_through(centre, settings.lowest_deg, settings.margin_m)
    return through
