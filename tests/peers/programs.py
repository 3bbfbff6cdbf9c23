"""The peers: what other programs make of the same scan, each by its own documented recipe.

Every peer gets the scan that tourgen gets, cropped to the same boxes of tour.toml and, as one
would by hand, to the room: strays tens of metres behind a window make the cells of an octree as
coarse (chamber1, PyMeshLab, depth 9: 22,808 vertices of a surface 36 m wide). Each then drops
outliers with its own filter and finds normals with its own; the normals are turned towards the
nearest true station, which is more than a merged scan tells and than either program can do by
itself. Poisson's invented surface is cut by density, as Open3D's manual shows: by 1 % of the
vertices as there, and by what suits the peers better (chamber1, Open3D, F-score at 5 mm: depth 9,
0 % 0.855, 1 % 0.877, 2 % 0.885, 5 % 0.890, 10 % 0.875, 20 % 0.829; depth 10, 5 % 0.883, which
cuts too much there: recall 0.806). A peer's score in a room is that of the best of its settings
there.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from apart import apart
from rooms import BenchRoom, stamp

from tourgen.geometry import Float32, Float64, Int32

VERSION = 2
"""Raised when a recipe changes, so that cached meshes are made again."""
LIMIT_S = 900
"""A peer that takes more of the processor, thrice what a whole tour takes us, or a minute for a
million points of the largest room, is stopped, and the table says so."""

Mesh = tuple[Float64, Int32]


@dataclass(frozen=True)
class Attempt:
    """One setting of one program.

    Attributes:
        program: Its name in the tables.
        setting: In words.
        make: (cloud's points, stations) -> mesh.
    """

    program: str
    setting: str
    make: Callable[[Float32, Float64], Mesh]

    @property
    def file_name(self) -> str:
        """Of its cached mesh."""
        words = f"{self.program} {self.setting}".lower()
        return "-".join("".join(c if c.isalnum() else " " for c in words).split())


@dataclass(frozen=True)
class Open3dPoisson:
    """Open3D's tutorials "Point cloud outlier removal" and "Surface reconstruction".

    Attributes:
        depth: Of the octree.
        cut: This share of the vertices, the thinnest supported, is dropped.
    """

    depth: int
    cut: float

    def __call__(self, points: Float32, stations: Float64) -> Mesh:
        """Statistical outliers (20 neighbours, 2 deviations), normals of 30, Poisson, cut."""
        import open3d as o3d

        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.astype(np.float64)))
        cloud, _ = cloud.remove_statistical_outlier(nb_neighbors=20, std_ratio=2.0)
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=0.1, max_nn=30))
        turned = toward_stations(np.asarray(cloud.points), np.asarray(cloud.normals), stations)
        cloud.normals = o3d.utility.Vector3dVector(turned)
        mesh, density = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
            cloud, depth=self.depth, linear_fit=False
        )
        thin = np.asarray(density)
        mesh.remove_vertices_by_mask(thin < np.quantile(thin, self.cut))
        return np.asarray(mesh.vertices), np.asarray(mesh.triangles)


@dataclass(frozen=True)
class MeshlabPoisson:
    """MeshLab's screened Poisson.

    Attributes:
        depth: Of the octree.
        cut: This share of the vertices, the thinnest supported, is dropped.
    """

    depth: int
    cut: float

    def __call__(self, points: Float32, stations: Float64) -> Mesh:
        """Outliers by local probability (32 neighbours, 0.8), normals of 16, Poisson, cut."""
        meshes = _meshlab_cloud(points, stations)
        meshes.generate_surface_reconstruction_screened_poisson(depth=self.depth, preclean=True)
        density = meshes.current_mesh().vertex_scalar_array()
        least = float(np.quantile(density, self.cut))
        meshes.compute_selection_by_condition_per_vertex(condselect=f"q < {least!r}")
        meshes.meshing_remove_selected_vertices()
        return _of_meshlab(meshes)


@dataclass(frozen=True)
class MeshlabBallPivoting:
    """MeshLab's ball pivoting on an evenly thinned cloud, as its manual advises for dense scans.

    It takes a second for 1,100 points, on one core: chamber1 thinned to 5 or 6 mm, over a million
    of them, is not done within the limit, with one radius or with the one that MeshLab guesses.

    Attributes:
        apart_mm: Points closer together are merged.
        radii_mm: Of the balls, one after the other.
    """

    apart_mm: float
    radii_mm: tuple[float, ...]

    def __call__(self, points: Float32, stations: Float64) -> Mesh:
        """Outliers by local probability (32 neighbours, 0.8), normals of 16, thinning, balls.

        Whole parts come out inside out: faces are turned to the stations, as normals were before.
        """
        import pymeshlab

        meshes = _meshlab_cloud(points, stations)
        meshes.generate_sampling_clustered_vertex(
            threshold=pymeshlab.PureValue(self.apart_mm / 1000), sampling="Closest to center"
        )
        for radius_mm in self.radii_mm:
            meshes.generate_surface_reconstruction_ball_pivoting(
                ballradius=pymeshlab.PureValue(radius_mm / 1000)
            )
        vertices, faces = _of_meshlab(meshes)
        return vertices, facing_stations(vertices, faces, stations)


def _meshlab_cloud(points: Float32, stations: Float64) -> Any:
    """A MeshSet with the cloud, without outliers, with normals."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points.astype(np.float64)))
    meshes.compute_selection_point_cloud_outliers(propthreshold=0.8, knearest=32)
    meshes.meshing_remove_selected_vertices()
    meshes.compute_normal_for_point_clouds(k=16)
    found = meshes.current_mesh()
    kept, normals = found.vertex_matrix(), found.vertex_normal_matrix()
    turned = toward_stations(kept, normals, stations)
    meshes.clear()
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=kept, v_normals_matrix=turned))
    return meshes


def _of_meshlab(meshes: Any) -> Mesh:
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def toward_stations(points: Float64, normals: Float64, stations: Float64) -> Float64:
    """The normals, each turned towards the station nearest to its point."""
    from scipy.spatial import cKDTree

    nearest = cKDTree(stations).query(points)[1]
    away = ((stations[nearest] - points) * normals).sum(axis=1) < 0
    turned: Float64 = np.where(away[:, None], -normals, normals)
    return turned


def facing_stations(vertices: Float64, faces: Int32, stations: Float64) -> Int32:
    """The faces, each turned towards the station nearest to it."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    away = (toward_stations((a + b + c) / 3, normals, stations) * normals).sum(axis=1) < 0
    turned: Int32 = np.where(away[:, None], faces[:, ::-1], faces)
    return turned


OPEN3D_POISSON, MESHLAB_POISSON = "Open3D Poisson", "PyMeshLab Poisson"
MESHLAB_BALLS = "PyMeshLab ball pivoting"

ATTEMPTS = (
    Attempt(OPEN3D_POISSON, "depth 9, cut 1 %", Open3dPoisson(9, 0.01)),
    Attempt(OPEN3D_POISSON, "depth 9, cut 5 %", Open3dPoisson(9, 0.05)),
    Attempt(OPEN3D_POISSON, "depth 10, cut 2 %", Open3dPoisson(10, 0.02)),
    Attempt(MESHLAB_POISSON, "depth 9, cut 1 %", MeshlabPoisson(9, 0.01)),
    Attempt(MESHLAB_POISSON, "depth 9, cut 5 %", MeshlabPoisson(9, 0.05)),
    Attempt(MESHLAB_POISSON, "depth 10, cut 2 %", MeshlabPoisson(10, 0.02)),
    Attempt(MESHLAB_BALLS, "8 mm apart, 12 and 25 mm", MeshlabBallPivoting(8, (12, 25))),
    Attempt(MESHLAB_BALLS, "10 mm apart, 15 and 30 mm", MeshlabBallPivoting(10, (15, 30))),
    Attempt(MESHLAB_BALLS, "12 mm apart, 20 and 40 mm", MeshlabBallPivoting(12, (20, 40))),
)


def made(attempt: Attempt, room: BenchRoom, scratch: Path) -> Path | str:
    """The mesh of one attempt, made in a process of its own unless it is there; why there is none.

    What failed is not tried again: the reason lies beside, as ``.txt``.

    Returns:
        An ``.npz`` with ``vertices``, ``faces`` and ``seconds``.
    """
    name = f"{attempt.file_name}-v{VERSION}-{stamp(room.scan)}.npz"
    file = scratch / "peers" / room.id / name
    why = file.with_suffix(".txt")
    if why.exists():
        return why.read_text(encoding="utf-8")
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        failed = apart(_make, attempt, room, file, limit_s=LIMIT_S)
        if failed:
            why.write_text(failed, encoding="utf-8")
            return failed
    return file


def _make(attempt: Attempt, room: BenchRoom, file: Path) -> None:
    points = room.cropped()
    begun = time.perf_counter()
    vertices, faces = attempt.make(points, room.stations())
    seconds = time.perf_counter() - begun
    aside = file.with_name(f".{file.name}")
    np.savez(
        aside, vertices=vertices.astype(np.float32), faces=faces.astype(np.int32), seconds=seconds
    )
    aside.rename(file)
