"""Crust: the triangles that the medial axis lets through (Amenta, Bern and Kamvysselis 1998).

Where the points lie dense, the Voronoi cell of each is long, thin and upright on the surface; its
farthest corners on either side, the point's poles, lie near the medial axis. In the Delaunay
triangulation of points and poles together, the triangles whose three corners are points are the
crust: balls through any others would hold a pole. Then

- the filter of the paper: a triangle stays whose normal lies near the direction from each corner
  to its first pole;
- its trimming, told by the normals that the points have here: slivers leave a layer before and a
  layer behind, and of the triangles around an edge the two stay that bound its free space. The
  paper's own, which peels off all triangles at sharp edges, would peel any surface that ends
  somewhere, as that of a scan does;
- faces with long edges go: a crust spans windows.

The filter at 60° keeps right-angled creases, where the way to the pole halves the angle: on a
corner of three noisy square metres it leaves 180 edges with one face, 366 at 45°, 435 at 25° (160
lie on the rim). On 24,000 points of the demo's first chamber 3,500, at 45° 8,300, at 30° 12,300.

Time and memory go with the points on a scan (43,000 points 15 s and 0.7 GB, 198,000 77 s and
1.9 GB); where many poles fall together, as those of a ball do, faster (50,000 points 22 s).

It draws the surface through the points, noise and all, and the poles of noisy points lie close to
them: for small clean clouds. Its descendants stand more (the power crust of Amenta, Choi and
Kolluri 2001, the robust cocone of Dey and Goswami 2006); for scans there are the other methods.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import Delaunay, QhullError

from tourgen.errors import InputError, StageError
from tourgen.geometry import Float32, Float64, Int32, Mesh, OrientedCloud
from tourgen.stages.mesh_arrays import compact, edges, face_normals
from tourgen.stages.surface.samples import distinct_samples, require_range

VERSION = 1
_FLATTEST = 1e-9
"""Volume of a tetrahedron over its longest edge cubed: a flatter one has no centre."""
_FARTHEST = 3.0
"""Poles farther from the middle, in diagonals of the cloud, are as good as at infinity."""
_SAME = 1e-9
"""Poles nearer to each other, in diagonals, are one."""
_OTHERS = "take auto, poisson, signed-distance or ball-pivoting, or raise `clean.thin_mm`"

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Settings:
    """What passes.

    Attributes:
        spacing_m: Distance between neighbouring points, 0.1 mm to 1 m.
        filter_deg: Most angle between a face's normal and the way to the first pole of the
            corner with the widest angle, 10° to 90°; half as much again at the others.
        longest: Longest edge of a face, in spacings, 2 to 1000.
        most_points: More are refused, 4 to 1 000 000.

    Raises:
        InputError: One lies outside its range.
    """

    spacing_m: float
    filter_deg: float = 60.0
    longest: float = 6.0
    most_points: int = 200_000

    def __post_init__(self) -> None:
        require_range("spacing_m", self.spacing_m, 0.0001, 1)
        require_range("filter_deg", self.filter_deg, 10, 90)
        require_range("longest", self.longest, 2, 1000)
        require_range("most_points", self.most_points, 4, 1_000_000)


@dataclass(frozen=True, slots=True)
class Poles:
    """The ends of the Voronoi cells.

    Attributes:
        direction: (n, 3) float64, unit length, toward the first pole; for a point of the convex
            hull the mean normal of the hull around it, outward.
        first: (n, 3) float64, the farthest corner of each point's Voronoi cell; NaN on the hull,
            where the cell has no end.
        second: (n, 3) float64, the farthest corner on the other side; NaN where there is none.
    """

    direction: Float64
    first: Float64
    second: Float64


def crust(oriented: OrientedCloud, settings: Settings) -> Mesh:
    """Draw the crust.

    Args:
        oriented: n points with normals toward the free space.
        settings: See ``Settings``.

    Returns:
        A mesh of the points themselves, at most two faces to an edge, counter-clockwise seen from
        the free space.

    Raises:
        InputError: There are too many points.
        StageError: The points lie in one spot, on a line or on one plane, or have no crust.
    """
    if len(oriented.cloud) > settings.most_points:
        raise InputError(
            f"surface: crust: expected at most {settings.most_points} points, "
            f"found {len(oriented.cloud)}",
            _OTHERS,
        )
    oriented = distinct_samples(oriented)
    points = oriented.cloud.points.astype(np.float64)
    points -= points.mean(axis=0)
    try:
        found = poles(points)
        faces = _delaunay_faces(points, found)
    except QhullError as error:
        raise StageError(
            "surface: crust: expected points in space, found them on one plane",
            "take signed-distance or ball-pivoting",
        ) from error
    mesh = Mesh(oriented.cloud.origin, oriented.cloud.points, faces)
    mesh = _only(mesh, _passes(mesh, found.direction, settings))
    mesh = _turned(mesh, oriented.normals)
    mesh = compact(mesh, _bounds_free_space(mesh))
    if not len(mesh.faces):
        raise StageError("surface: crust: expected faces, found none", _OTHERS)
    return mesh


def poles(points: Float64) -> Poles:
    """Find the poles of (n, 3) points.

    Raises:
        QhullError: The points lie on one plane.
    """
    diagram = Delaunay(points)
    centre = _circumcentres(points[diagram.simplices])
    round_ = np.isfinite(centre).all(axis=1)
    sample = diagram.simplices[round_].ravel()
    corner = np.repeat(centre[round_], 4, axis=0)
    direction = _hull_normals(points, diagram.convex_hull)
    inner = ~np.any(direction, axis=1)
    first = _farthest(points, sample, corner, inner[sample])
    direction[inner] = np.nan_to_num(first[inner] - points[inner])
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-300)
    behind = np.einsum("ij,ij->i", corner - points[sample], direction[sample]) < 0
    return Poles(direction, first, _farthest(points, sample, corner, behind))


def _circumcentres(corners: Float64) -> Float64:
    """(t, 3) of (t, 4, 3) tetrahedra, NaN where one is flat."""
    a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
    aa, bb, cc = (np.square(edge).sum(axis=1) for edge in (a, b, c))
    normal = np.cross(b, c)
    volume = np.einsum("ij,ij->i", a, normal)
    volume[np.abs(volume) < _FLATTEST * np.maximum.reduce([aa, bb, cc]) ** 1.5] = np.nan
    away = aa[:, None] * normal + bb[:, None] * np.cross(c, a) + cc[:, None] * np.cross(a, b)
    return np.asarray(corners[:, 0] + away / (2 * volume[:, None]), np.float64)


def _hull_normals(points: Float64, hull: Int32) -> Float64:
    """(n, 3) mean outward normal of the hull's triangles around each point, 0 for inner points."""
    a, b, c = (points[hull[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    normal[np.einsum("ij,ij->i", normal, points.mean(axis=0) - a) > 0] *= -1
    mean = np.zeros_like(points)
    np.add.at(mean, hull.ravel(), np.repeat(normal, 3, axis=0))
    return mean


def _farthest(points: Float64, sample: Int32, corner: Float64, allowed: Mask) -> Float64:
    """(n, 3) the farthest allowed corner of each point's cell, NaN where it has none."""
    sample, corner = sample[allowed], corner[allowed]
    away = np.square(corner - points[sample]).sum(axis=1)
    order = np.lexsort((away, sample))
    owner, last = np.unique(sample[order][::-1], return_index=True)
    found = np.full(points.shape, np.nan)
    found[owner] = corner[order][::-1][last]
    return found


def _delaunay_faces(points: Float64, found: Poles) -> Int32:
    """(f, 3) the triangles of points alone among those of points and poles."""
    each = np.concatenate([found.first, found.second])
    each = each[np.isfinite(each[:, 0])]
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    each = each[np.linalg.norm(each, axis=1) < _FARTHEST * size]
    place = np.rint(each / (_SAME * size)).astype(np.int64)
    each = each[np.unique(place, axis=0, return_index=True)[1]]
    tetra = np.sort(Delaunay(np.concatenate([points, each])).simplices, axis=1)
    sides = [np.delete(tetra, corner, axis=1) for corner in range(4)]
    of_points = np.concatenate([side[side[:, 2] < len(points)] for side in sides])
    return np.asarray(np.unique(of_points, axis=0), np.int32)


def _passes(mesh: Mesh, direction: Float64, settings: Settings) -> Mask:
    """Mask of the triangles upright on the ways to their poles, and not too long."""
    cosine = np.abs(np.einsum("ij,ikj->ik", face_normals(mesh), direction[mesh.faces]))
    turned_deg = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
    corner = mesh.vertices[mesh.faces]
    opposite_m = np.linalg.norm(corner[:, [1, 2, 0]] - corner[:, [2, 0, 1]], axis=2)
    longest_m = opposite_m.max(axis=1, keepdims=True)
    most_deg = np.where(opposite_m == longest_m, settings.filter_deg, 1.5 * settings.filter_deg)
    short = longest_m[:, 0] <= settings.longest * settings.spacing_m
    return np.asarray(np.all(turned_deg <= most_deg, axis=1) & short)


def _only(mesh: Mesh, keep: Mask) -> Mesh:
    """The faces that ``keep`` selects, all vertices kept."""
    return Mesh(mesh.origin, mesh.vertices, mesh.faces[keep])


def _turned(mesh: Mesh, normals: Float32) -> Mesh:
    """The same faces, each the way round that its vertices' normals ask for."""
    away = np.einsum("ij,ikj->i", face_normals(mesh), normals[mesh.faces]) < 0
    faces = np.where(away[:, None], mesh.faces[:, ::-1], mesh.faces)
    return Mesh(mesh.origin, mesh.vertices, faces)


def _bounds_free_space(mesh: Mesh) -> Mask:
    """Mask of the faces that, at each of their edges, bound the widest free sector.

    Around an edge, free space lies between a face that runs along it and the next one, turning to
    its front, that runs against it.
    """
    edge = edges(mesh.faces)
    ends = np.sort(edge, axis=1)
    key = ends[:, 0] << 32 | ends[:, 1]
    angle = _angle(mesh, ends)
    order = np.lexsort((angle, key))
    key, angle, along = key[order], angle[order], (edge[:, 0] < edge[:, 1])[order]
    first = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]])[: len(key)])
    count = np.diff(np.append(first, len(key)))
    of_edge = np.repeat(np.arange(len(first)), count)
    following = np.arange(1, len(key) + 1)
    following[first + count - 1] = first
    free = along & ~along[following]
    width = np.where(free, np.mod(angle[following] - angle, 2 * np.pi), -1)
    widest = free & (width == np.maximum.reduceat(width, first)[of_edge])
    stays = (count == 1)[of_edge] | widest
    stays[following[widest]] = True
    keep = np.ones(len(mesh.faces), np.bool_)
    keep[np.repeat(np.arange(len(mesh.faces)), 3)[order[~stays]]] = False
    return keep


def _angle(mesh: Mesh, ends: npt.NDArray[np.int64]) -> Float64:
    """(3 f,) where each face lies around each of its edges, looking against it."""
    vertices = mesh.vertices.astype(np.float64)
    axis = vertices[ends[:, 1]] - vertices[ends[:, 0]]
    axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    apex = vertices[mesh.faces[:, [2, 0, 1]].reshape(-1)] - vertices[ends[:, 0]]
    up = np.einsum("ij,ij->i", apex, np.cross(axis, across))
    return np.asarray(np.arctan2(up, np.einsum("ij,ij->i", apex, across)), np.float64)
