"""Auto: the signed distance where the scan is dense, the screened Poisson solve across its gaps.

Near points, Hoppe's distance draws flat walls flat and edges sharp, and costs little; it ends where
the points do. The solve closes every gap smoothly, but rounds every edge off and costs most of a
build at the same detail. So the solve is made with coarser cells, from the same smoothed tangent
planes, and its surface goes on where the distance is unknown; over the last part of a plane's reach
the one fades into the other, so that there is one field and one watertight surface.

Where most of a scan lies farther apart than planes reach, there is little that the distance could
draw: then all of it is left to the solve, at full detail.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Mesh, OrientedCloud
from tourgen.stages.mesh_arrays import face_areas, vertex_normals
from tourgen.stages.surface import poisson, signed_distance
from tourgen.stages.surface.tangent_planes import TangentPlanes

VERSION = 1
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
    planes = signed_distance.supported_planes(oriented, settings.distance)
    solved = poisson.poisson(_smoothed(oriented, planes), settings.solve)
    reach_m = settings.distance.reach * settings.distance.spacing_m
    dense = _near(solved, planes, reach_m)
    area = face_areas(solved)
    if (area * dense).sum() < settings.least_share * area.sum():
        return Chosen(poisson.poisson(_smoothed(oriented, planes), settings.alone), 0.0)
    mesh = signed_distance.zero_set(
        planes, settings.distance, oriented.cloud.origin, _Closed(solved, ~dense)
    )
    dense = _near(mesh, planes, reach_m)
    area = face_areas(mesh)
    return Chosen(mesh, float((area * dense).sum() / area.sum()))


def _smoothed(oriented: OrientedCloud, planes: TangentPlanes) -> OrientedCloud:
    """The planes as points for a solve."""
    nobody = np.full(len(planes.points), -1, np.int16)
    colors = np.zeros((len(planes.points), 3), np.uint8)
    cloud = replace(oriented.cloud, points=planes.points, colors=colors, station=nobody)
    return replace(oriented, cloud=cloud, normals=planes.normals)


def _near(mesh: Mesh, planes: TangentPlanes, most_m: float) -> Mask:
    """Which faces of a mesh have a corner within ``most_m`` of a plane's point."""
    distance, _ = cKDTree(planes.points).query(
        mesh.vertices, distance_upper_bound=most_m, workers=-1
    )
    return np.asarray(np.isfinite(distance)[mesh.faces].any(axis=1))


class _Closed:
    """A closed surface whose distance has the sign of the side; see `signed_distance.Beyond`."""

    def __init__(self, mesh: Mesh, gap: Mask) -> None:
        import open3d as o3d

        self.seeds: Float32 = mesh.vertices[np.unique(mesh.faces[gap])]
        self._faces, self._normals = mesh.faces, vertex_normals(mesh).astype(np.float32)
        self._scene = o3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(mesh.vertices, mesh.faces.astype(np.uint32))

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
