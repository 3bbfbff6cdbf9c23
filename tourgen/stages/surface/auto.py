"""Auto: the signed distance where the scan is dense, the winding number across its gaps.

Near points, Hoppe's distance draws flat walls flat and edges sharp, and costs little; it ends where
the points do. Across a gap the winding number of what it drew tells where that closes
(``winding``). Over the last part of a plane's reach the one fades into the other: there is one
field, and one watertight mesh, beside which thin rods stand as tubes of their own.

Before, a screened Poisson solve closed the gaps, with cells twice as wide as the detail, from
points spread evenly over what the distance drew. It took a quarter of the stage's time on one core
and most of its memory, and a room of any size had to fit one solve. With the winding number the
surface is as true: the demo's rooms have F-scores at 5 mm of 0.985, 0.992 and 0.976, and had 0.984,
0.992 and 0.976.

Tried: the solve from the tangent planes themselves: a board of 25 mm whose one side is seen at a
grazing angle only, with its points in sparse rows, dissolved (chamber1: 98.6 instead of 99.0 % of
what is seen within 10 mm). Another surface's distance wherever the planes' jumps: edges come out
coarse (the F-score at 5 mm is 0.961 instead of 0.972). No surface where it jumps: edges gape. Gaps
closed at one value of the winding number for the whole room: they leave their rims with a kink
(chamber2: 2.98 instead of 2.19 mm at the 95th percentile).

Where two thirds of a scan lie farther apart than planes reach, there is little that the distance
could draw: then all of it is left to the Poisson solve.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tourgen.geometry import Float32, Float64, Mesh, OrientedCloud, PointCloud
from tourgen.neighbours import Neighbours
from tourgen.rays import ray_scene
from tourgen.stages.free_space import LOWEST_DEG, FreeSpace, free_space
from tourgen.stages.mesh_arrays import face_areas, vertex_normals
from tourgen.stages.surface import poisson, signed_distance
from tourgen.stages.surface.footing import on_footing
from tourgen.stages.surface.tangent_planes import TangentPlanes
from tourgen.stages.surface.winding import Winding
from tourgen.voxels import voxel_groups

VERSION = 17
_VOID_DEG = 0.75
"""Where six beams do not lie nearer in direction, nothing is known of what they went through."""
_MOST_BEAMS = 10_000_000
"""Rims are told as finely as beams lie; more than these would only take memory."""
_SIGMAS = 4.0
"""Of the noise, by which a beam must have gone on past a place."""
_SAMPLE = 100_000
_TOLD = 0.5
"""The part of the points that must tell their station."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Both methods.

    Attributes:
        distance: Of the signed distance.
        alone: Of the solve where it is left alone.
        least_share: The share of the area within reach of the planes from which on the signed
            distance is worth it, 0 to 1.
        most_cells: So many cells that the surface enters are held at once; of a larger room it is
            drawn by blocks, and twice as many faces are left.
    """

    distance: signed_distance.Settings
    alone: poisson.Settings
    least_share: float = 0.33
    most_cells: float = 6e6


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
    planes, origin = shapes.planes, oriented.cloud.origin
    free = _free(oriented, planes.noise_m)
    mesh = _closed(planes, settings, free, origin)
    if not len(mesh.faces):
        return Chosen(poisson.poisson(oriented, settings.alone), 0.0)
    share = _near_share(mesh, planes, settings.distance.reach * settings.distance.spacing_m)
    if share < settings.least_share:
        return Chosen(poisson.poisson(oriented, settings.alone), 0.0)
    if free:
        shapes = replace(shapes, rods=on_footing(shapes.rods, mesh, free))
    return Chosen(shapes.with_rods(mesh, settings.distance), share)


def _closed(
    planes: TangentPlanes, settings: Settings, free: FreeSpace | None, origin: Float64
) -> Mesh:
    """The surface of the planes, its gaps closed; no faces where there is none."""
    asked = settings.distance
    over = signed_distance.cells_expected(planes, asked.cell_m) / settings.most_cells
    if over > 1:
        return _closed_by_blocks(planes, settings, free, origin, over)
    known = signed_distance.distances(planes, asked, free)
    drawn = known.zero_set(origin, sharp=False)
    if not len(drawn.faces):
        return drawn
    # Who passed by stays where nobody knows who measured him: his winding number flares out to the
    # floor, a solve closes him tight.
    beyond = Winding(drawn, asked.cell_m) if free else _Solved(drawn, 2 * asked.cell_m)
    return known.carried_on(beyond).zero_set(origin)


def _closed_by_blocks(
    planes: TangentPlanes,
    settings: Settings,
    free: FreeSpace | None,
    origin: Float64,
    over: float,
) -> Mesh:
    """The same of a room that has ``over`` times the cells that are held at once."""
    given = planes, settings.distance, free, origin, 2 * settings.most_cells
    drawn = signed_distance.zero_set_by_blocks(*given)
    if not len(drawn.faces):
        return drawn
    winding = Winding(drawn, settings.distance.cell_m * float(np.sqrt(over)))
    del drawn
    return signed_distance.zero_set_by_blocks(*given, winding)


class _Solved:
    """A closed surface by the Poisson solve; see ``signed_distance.Beyond``."""

    def __init__(self, drawn: Mesh, cell_m: float) -> None:
        order, starts = voxel_groups(drawn.vertices, cell_m / 2)
        at = order[starts]
        nobody, black = np.full(len(at), -1, np.int16), np.zeros((len(at), 3), np.uint8)
        cloud = PointCloud(drawn.origin, drawn.vertices[at], black, nobody)
        samples = OrientedCloud(cloud, vertex_normals(drawn)[at], np.empty((0, 3)))
        mesh = poisson.poisson(samples, poisson.Settings(cell_m))
        self._faces, self._normals = mesh.faces, vertex_normals(mesh).astype(np.float32)
        self._scene = ray_scene(mesh.vertices, mesh.faces)

    def distance(self, places: Float32) -> Float32:
        """(n,) metres that each of (n, 3) places lies in front of the nearest face."""
        if not len(places):
            return np.empty(0, np.float32)
        near = self._scene.compute_closest_points(places)
        u, v = near["primitive_uvs"].numpy().T[:, :, None]
        normal = self._normals[self._faces[near["primitive_ids"].numpy()]]
        normal = (1 - u - v) * normal[:, 0] + u * normal[:, 1] + v * normal[:, 2]
        offset = places - near["points"].numpy()
        away = np.linalg.norm(offset, axis=1)
        return np.asarray(np.copysign(away, np.einsum("ij,ij->i", offset, normal)), np.float32)


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


def _near_share(mesh: Mesh, planes: TangentPlanes, most_m: float) -> float:
    """The part of a mesh's area in faces whose middle is within ``most_m`` of a plane's point, as
    some of them tell it."""
    some = np.random.default_rng(0).permutation(len(mesh.faces))[:_SAMPLE]
    sample = replace(mesh, faces=mesh.faces[some])
    middles = mesh.vertices[sample.faces].mean(axis=1)
    near, _ = Neighbours.of(planes.points, 1).nearest(middles, 1, most_m)
    area = face_areas(sample)
    return float(area[near[:, 0] >= 0].sum() / area.sum())
