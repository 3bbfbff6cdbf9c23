"""Ball pivoting: a ball that rolls over the points (Bernardini et al. 1999), by Open3D.

Wherever it comes to rest on three points they become a face. It draws the surface through the
points themselves, noise and all, and leaves a hole wherever the ball falls through: a larger ball
then rolls along the rims. The radii grow by doubling from the spacing.

On a sixth of the demo's first chamber (198,000 points, 12.9 mm apart in the median) the time of
the processor, the share of the points used and the edges with one face are: one, two and four
spacings 5.9 s, 90 %, 23,000; three quarters, one and a half and three 5.7 s, 94 %, 63,000; one,
one and a half, two, three and four 6.0 s, 90 %, 20,000; from one and a quarter 8.1 s, 85 %,
11,000, coarser; two alone 32 s, 71 %, 5,000. A first ball of four spacings took 25 s for 43,000
points, one of eight did not come to an end: hence the bounds on the first. Repeated points stop
Open3D's ball for ever; they are dropped before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.errors import InputError, StageError
from tourgen.geometry import Float32, Mesh, OrientedCloud
from tourgen.neighbours import Neighbours
from tourgen.stages.mesh_arrays import compact, edges, face_normals
from tourgen.stages.spacing import FOURTH, spacing_at
from tourgen.stages.surface.samples import distinct_samples, require_range

VERSION = 1
_GROWTH = (1.0, 2.0, 4.0)
_FIRST = (0.25, 3.0)
"""Radius of the first ball over the spacing, at least and at most."""
_MOST_RADII = 8
_SAMPLE = 5_000


@dataclass(frozen=True, slots=True)
class Settings:
    """The balls.

    Attributes:
        radii_m: One to eight radii, 0.1 mm to 1 m, each larger than the one before; see
            ``radii``. The first may be a quarter to three times as large as the points are apart.
        agree_deg: A face whose normal lies farther from that of one of its vertices is dropped,
            10° to 90°. On the part told above, of the area that faces the wrong way 0.07 % stays
            at 90°, 0.04 % at 75°, 0.02 % at 60°, and the edges with one face grow from 23,000 to
            27,000 and 37,000.

    Raises:
        InputError: One lies outside its range.
    """

    radii_m: tuple[float, ...]
    agree_deg: float = 75.0

    def __post_init__(self) -> None:
        require_range("number of radii_m", len(self.radii_m), 1, _MOST_RADII)
        for radius_m in self.radii_m:
            require_range("radii_m", radius_m, 0.0001, 1)
        if any(b <= a for a, b in zip(self.radii_m, self.radii_m[1:], strict=False)):
            found = ", ".join(f"{radius_m:g}" for radius_m in self.radii_m)
            raise InputError(
                f"surface: radii_m: expected each larger than the one before, found {found}",
                "sort them from small to large",
            )
        require_range("agree_deg", self.agree_deg, 10, 90)


def radii(spacing_m: float) -> tuple[float, ...]:
    """The radii for points so far apart: once, twice and four times the spacing."""
    return tuple(factor * spacing_m for factor in _GROWTH)


def ball_pivoting(oriented: OrientedCloud, settings: Settings) -> Mesh:
    """Roll the balls.

    Args:
        oriented: n points with normals toward the free space; evenly thinned, or the balls that
            fit where they are sparse take long where they are dense.
        settings: See ``Settings``.

    Returns:
        A mesh of the points themselves, open where no ball rests, at most two faces to an edge,
        counter-clockwise seen from the free space.

    Raises:
        InputError: The first radius is no match for the points' spacing.
        StageError: The points lie in one spot or on a line, or no ball rests on them.
    """
    import open3d as o3d

    oriented = distinct_samples(oriented)
    _require_match(oriented.cloud.points, settings.radii_m[0])
    pcd = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(oriented.cloud.points))
    pcd.normals = o3d.utility.Vector3dVector(oriented.normals)
    rolled = o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(
        pcd, o3d.utility.DoubleVector(settings.radii_m)
    )
    faces = np.asarray(rolled.triangles).astype(np.int32)
    mesh = Mesh(oriented.cloud.origin, oriented.cloud.points, faces)
    agreement = _agreement(mesh, oriented.normals)
    agree = agreement > np.cos(np.radians(settings.agree_deg))
    mesh, agreement = Mesh(mesh.origin, mesh.vertices, faces[agree]), agreement[agree]
    mesh = compact(mesh, _runs_alone(mesh, agreement))
    if not len(mesh.faces):
        raise StageError(
            "surface: expected faces, found that no ball rests on three points",
            "check the normals, or give larger `surface.radii_mm`",
        )
    return mesh


def _require_match(points: Float32, first_m: float) -> None:
    if len(points) < 5:  # a spacing is told by four neighbours
        return
    rng = np.random.default_rng(0)
    sample = points[rng.choice(len(points), min(_SAMPLE, len(points)), replace=False)]
    dense_m, median_m = np.quantile(spacing_at(Neighbours.of(points, FOURTH), sample), [0.1, 0.5])
    low_m, high_m = _FIRST[0] * median_m, _FIRST[1] * dense_m
    if not low_m <= first_m <= high_m:
        raise InputError(
            f"surface.radii_mm: expected the first from {1000 * low_m:.3g} to "
            f"{1000 * high_m:.3g}, found {1000 * first_m:.3g}",
            f"the points lie {1000 * median_m:.3g} mm apart in the middle",
        )


def _agreement(mesh: Mesh, normals: Float32) -> Float32:
    """(f,) cosine between each face's normal and the vertex normal farthest from it."""
    cosine = np.einsum("ij,ikj->ik", face_normals(mesh), normals[mesh.faces])
    return np.asarray(cosine.min(axis=1), np.float32)


def _runs_alone(mesh: Mesh, agreement: Float32) -> npt.NDArray[np.bool_]:
    """Mask of the faces to keep so that an edge is run at most once either way.

    Of the faces that run along an edge in the same direction the one that agrees best stays.
    """
    edge = edges(mesh.faces)
    face = np.repeat(np.arange(len(mesh.faces)), 3)
    key = edge[:, 0] << 32 | edge[:, 1]
    order = np.lexsort((-agreement[face], key))
    again = order[1:][key[order[1:]] == key[order[:-1]]]
    alone = np.ones(len(mesh.faces), bool)
    alone[face[again]] = False
    return alone
