"""Auto: the signed distance where the scan is dense, the screened Poisson solve across its gaps.

Near points, Hoppe's distance draws flat walls flat and edges sharp, and costs little; it ends where
the points do. The solve closes every gap smoothly, but rounds every edge off and costs most of a
build at the same detail. So the solve is made with coarser cells, from points spread evenly over
the surface that the distance drew. Over the last part of a plane's reach the distance fades into
that to the solved surface: there is one field, and one watertight mesh, beside which thin rods
stand as tubes of their own.

Tried: the solve from the tangent planes themselves. A board of 25 mm whose one side is seen at a
grazing angle only, with its points in sparse rows, dissolved, and the surface bulged out into the
room (chamber1: 98.6 instead of 99.0 % of what is seen within 10 mm, 3.7 instead of 2.9 mm at the
95th percentile). The solve's distance wherever the planes' jumps: it is too coarse for edges (the
F-score at 5 mm is 0.961 instead of 0.972). No surface where it jumps: edges gape.

Where most of a scan lies farther apart than planes reach, there is little that the distance could
draw: then all of it is left to the solve, at full detail.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64, Mesh, OrientedCloud, PointCloud
from tourgen.neighbours import Neighbours
from tourgen.rays import ray_scene
from tourgen.stages.free_space import LOWEST_DEG, FreeSpace, free_space
from tourgen.stages.mesh_arrays import face_areas, vertex_normals
from tourgen.stages.surface import poisson, signed_distance
from tourgen.stages.surface.footing import on_footing
from tourgen.stages.surface.tangent_planes import TangentPlanes
from tourgen.voxels import voxel_groups

VERSION = 14
_VOID_DEG = 0.75
"""Where six beams do not lie nearer in direction, nothing is known of what they went through."""
_MOST_BEAMS = 10_000_000
"""Rims are told as finely as beams lie; more than these would only take memory."""
_SIGMAS = 4.0
"""Of the noise, by which a beam must have gone on past a place."""
_TOLD = 0.5
"""The part of the points that must tell their station."""
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Settings:
    """Both methods.

    Attributes:
        distance: Of the signed distance.
        solve: Of the solve across the gaps.
        alone: Of the solve where it is left alone.
        least_share: The share of the area within reach of the planes from which on the signed
            distance is worth it, 0 to 1.
    """

    distance: signed_distance.Settings
    solve: poisson.Settings
    alone: poisson.Settings
    least_share: float = 0.5


@dataclass(frozen=True, slots=True)
class Chosen:
    """A surface, and who drew it.

    Attributes:
        mesh: The surface.
        dense_share: The part of its area that the signed distance drew, 0 to 1.
    """

    mesh: Mesh
    dense_share: float


def auto(oriented: OrientedCloud, settings: Settings) -> Chosen:
    """Draw each region by the method that suits it.

    Args:
        oriented: n points with normals toward the free space.
        settings: See ``Settings``.

    Returns:
        A closed mesh, faces counter-clockwise seen from the free space.

    Raises:
        InputError: The room has more than two million cells from end to end.
        StageError: There is no surface.
    """
    shapes = signed_distance.shapes(oriented, settings.distance)
    planes = shapes.planes
    free = _free(oriented, planes.noise_m)
    known = signed_distance.distances(planes, settings.distance, free)
    solved = _solved(known, oriented.cloud.origin, settings)
    if solved is None:
        return Chosen(poisson.poisson(oriented, settings.alone), 0.0)
    reach_m = settings.distance.reach * settings.distance.spacing_m
    near = _near(solved, planes, reach_m)
    if _share(solved, near) < settings.least_share:
        return Chosen(poisson.poisson(oriented, settings.alone), 0.0)
    mesh = known.carried_on(_Closed(solved, ~near)).zero_set(oriented.cloud.origin)
    share = _share(mesh, _near(mesh, planes, reach_m))
    if free:
        shapes = replace(shapes, rods=on_footing(shapes.rods, mesh, free))
    return Chosen(shapes.with_rods(mesh, settings.distance), share)


def _free(oriented: OrientedCloud, noise_m: float) -> FreeSpace | None:
    """What the stations saw through; None where most points do not tell who measured them.

    A beam guessed wrong goes through walls: of a stair's newel it left a thin shell.
    """
    cloud = oriented.cloud
    told = (cloud.station >= 0) & (cloud.station < len(oriented.stations))
    if told.mean() < _TOLD:
        return None
    return free_space(
        cloud.take(told),
        oriented.stations,
        _VOID_DEG,
        LOWEST_DEG,
        _SIGMAS * noise_m,
        _MOST_BEAMS,
    )


def _solved(known: signed_distance.Distances, origin: Float64, settings: Settings) -> Mesh | None:
    """The solve from the surface that the distance draws; None where it draws none."""
    dense = known.zero_set(origin, sharp=False)
    return poisson.poisson(_evenly(dense, settings), settings.solve) if len(dense.faces) else None


def _evenly(mesh: Mesh, settings: Settings) -> OrientedCloud:
    """The places on a mesh, as far apart as the solve's cells are wide, as points for it."""
    order, starts = voxel_groups(mesh.vertices, settings.solve.cell_m / 2)
    at = order[starts]
    nobody = np.full(len(at), -1, np.int16)
    black = np.zeros((len(at), 3), np.uint8)
    cloud = PointCloud(mesh.origin, mesh.vertices[at], black, nobody)
    return OrientedCloud(cloud, vertex_normals(mesh)[at], np.empty((0, 3)))


def _share(mesh: Mesh, chosen: Mask) -> float:
    """The part of a mesh's area in chosen faces."""
    area = face_areas(mesh)
    return float(area[chosen].sum() / area.sum())


def _near(mesh: Mesh, planes: TangentPlanes, most_m: float) -> Mask:
    """Which faces of a mesh have a corner within ``most_m`` of a plane's point."""
    near, _ = Neighbours.of(planes.points, 1).nearest(mesh.vertices, 1, most_m)
    return np.asarray((near[:, 0] >= 0)[mesh.faces].any(axis=1))


class _Closed:
    """A closed surface whose distance has the sign of the side; see `signed_distance.Beyond`."""

    def __init__(self, mesh: Mesh, gap: Mask) -> None:
        self.seeds: Float32 = mesh.vertices[np.unique(mesh.faces[gap])]
        self._faces, self._normals = mesh.faces, vertex_normals(mesh).astype(np.float32)
        self._scene = ray_scene(mesh.vertices, mesh.faces)

    def distance(self, places: Float32) -> Float32:
        """(n,) metres that each of (n, 3) places lies in front of the nearest face."""
        if not len(places):
            return np.empty(0, np.float32)
        near = self._scene.compute_closest_points(places)
        face = self._faces[near["primitive_ids"].numpy()]
        u, v = near["primitive_uvs"].numpy().T[:, :, None]
        normal = self._normals[face]
        normal = (1 - u - v) * normal[:, 0] + u * normal[:, 1] + v * normal[:, 2]
        offset = places - near["points"].numpy()
        away = np.linalg.norm(offset, axis=1)
        return np.asarray(np.copysign(away, np.einsum("ij,ij->i", offset, normal)), np.float32)
