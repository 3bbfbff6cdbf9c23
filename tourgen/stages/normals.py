"""Normals: a robust plane of each neighbourhood, turned toward the free space of the room.

Orientation, best evidence first:

1. The station that measured the point is known: the normal looks at it.
2. Stations are known or found, but not which one measured which point: the normal looks at the
   station that sees the point most squarely; points that no station sees follow their
   neighbours.
3. No station: a minimum spanning tree over the tangent planes (Hoppe et al. 1992), on a thinned
   cloud, since 0.9 million points take 93 s; the whole is then turned so that
   most normals look inward, as those of a room do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64, OrientedCloud, PointCloud
from tourgen.stages.sight import depth_buffer
from tourgen.stages.tangent import tangent_planes
from tourgen.stages.thin import voxel_groups

VERSION = 2


@dataclass(frozen=True, slots=True)
class Settings:
    """How wide to look.

    Attributes:
        first_neighbours: Points of the small first fit of a tangent plane.
        neighbours: Points that the wide, robust fit chooses from.
        sight_cell_deg: Cell of the depth buffers that decide which station sees a point.
        tree_points: Most points that the spanning tree is grown on.
    """

    first_neighbours: int = 12
    neighbours: int = 48
    sight_cell_deg: float = 0.5
    tree_points: int = 40_000


def normals(cloud: PointCloud, stations: Float64, settings: Settings) -> OrientedCloud:
    """Estimate and orient.

    Args:
        cloud: n points, evenly thinned.
        stations: (s, 3) metres from the cloud's origin; may be empty.
        settings: See ``Settings``.

    Returns:
        The same points with unit normals toward the free space.
    """
    normal = tangent_planes(cloud.points, settings.first_neighbours, settings.neighbours)
    if len(stations) and np.all(cloud.station >= 0):
        _look_at(normal, cloud.points, stations[cloud.station])
    elif len(stations):
        seen = _look_at_seeing(normal, cloud.points, stations, settings.sight_cell_deg)
        _follow(normal, cloud.points, seen)
    else:
        _spanning_tree(normal, cloud.points, settings)
    return OrientedCloud(cloud, normal, stations)


def _look_at(normal: Float32, points: Float32, target: Float64) -> None:
    away = np.einsum("ij,ij->i", normal, target.astype(np.float32) - points) < 0
    normal[away] *= -1


def _look_at_seeing(
    normal: Float32, points: Float32, stations: Float64, cell_deg: float
) -> npt.NDArray[np.bool_]:
    """Turn each normal to the station that sees its point most squarely; mask of the seen."""
    best = np.zeros(len(points), np.float32)
    for station in stations:
        ray = station.astype(np.float32) - points
        cosine = np.einsum("ij,ij->i", normal, ray) / np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
        np.clip(cosine, -1, 1, out=cosine)
        cosine[~depth_buffer(points, station, cell_deg).sees(points, cosine)] = 0
        best = np.where(np.abs(cosine) > np.abs(best), cosine, best)
    normal[best < 0] *= -1
    return np.asarray(np.abs(best) > 0.05)


def _follow(normal: Float32, points: Float32, seen: npt.NDArray[np.bool_]) -> None:
    """Turn the normals of unseen points like those of the seen ones around them."""
    hidden = np.flatnonzero(~seen)
    if not len(hidden) or not seen.any():
        return
    known = np.flatnonzero(seen)
    nearest = np.arange(1, min(12, len(known)) + 1)
    distance, near = cKDTree(points[known]).query(points[hidden], k=nearest, workers=-1)
    weight = 1 / np.maximum(distance, 1e-4)
    votes = np.einsum("ik,ikj,ij->i", weight, normal[known[near]], normal[hidden])
    normal[hidden[votes < 0]] *= -1


def _spanning_tree(normal: Float32, points: Float32, settings: Settings) -> None:
    import open3d as o3d

    voxel_m = 0.02
    order, starts = voxel_groups(points, voxel_m)
    while len(starts) > settings.tree_points:
        voxel_m *= 1.3
        order, starts = voxel_groups(points, voxel_m)
    sparse = order[starts]
    pcd = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points[sparse]))
    pcd.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(12))
    pcd.orient_normals_consistent_tangent_plane(12)
    grown = np.asarray(pcd.normals).astype(np.float32)
    inward = np.median(points[sparse], axis=0) - points[sparse]
    if np.einsum("ij,ij->i", grown, inward).mean() < 0:
        grown *= -1
    _, near = cKDTree(points[sparse]).query(points, workers=-1)
    normal[np.einsum("ij,ij->i", normal, grown[near]) < 0] *= -1
