"""Planes and edges: whether flat stays flat, sharp sharp, and thin whole.

planes   Where the truth is a wall, the floor or a table top, and no other surface within 20 mm:
         the residual of the mesh's points to the true plane (root mean square; what lies 20 mm
         or more away is no plane's noise and counts in the precision), and the angle of the
         mesh's faces to it.
creases  Lines where two true planes meet at 30 degrees or more and a station sees both sides.
         The mesh's own crease runs along those of its edges where the faces stop looking like
         one plane and begin to look like the other; each 10 mm of a true crease takes the mean
         distance of such edges within 25 mm.
rails    Rods of 20 mm, cut in slices of 10 mm. A slice is whole where at least half of what a
         station sees of it has mesh within 5 mm; a rail is broken where two slices in a row are
         not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from score import Truth
from surface_score import Bools, Figures, Samples, face_normals

from tourgen.geometry import Float64, Int32
from tourgen.rays import ray_scene, rays_of

Ints = npt.NDArray[np.int64]

PLANE_AREA_M2 = 0.3
CREASE_AREA_M2 = 0.02
BEHIND_M = 0.1
ALONE_M = 0.020
OFF_M = 0.020
ANGLE_DEG = 30.0
STEP_M = 0.010
ASIDE_M = 0.015
CREASE_REACH_M = 0.025
CREASE_GOAL_M = 0.004
WELD_M = 1e-4
ON_M = 0.0007
EDGE_STEP_M = 0.004
RAIL_RADIUS_M = 0.010
RAIL_NEAR_M = 0.005
RAIL_SHARE = 0.5
RAIL_SAMPLES_M2 = 1e-5
"""Area of a rail for each point that asks for mesh."""


@dataclass(frozen=True)
class Patch:
    """A flat part of the truth.

    Attributes:
        faces: Of the truth.
        normal: (3,) unit, into the open.
        offset_m: Along the normal.
        area_m2: Of its faces.
    """

    faces: Ints
    normal: Float64
    offset_m: float
    area_m2: float


def patches(truth: Truth, least_m2: float) -> list[Patch]:
    """Connected coplanar parts of the truth of at least an area."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners = truth.vertices[truth.faces]
    offset = (corners[:, 0] * truth.normals).sum(axis=1)
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    key = np.concatenate([truth.normals / 2e-3, offset[:, None] / 5e-4], axis=1)
    _, plane = np.unique(np.rint(key).astype(np.int64), axis=0, return_inverse=True)
    place = welded(truth.vertices)[truth.faces]
    # A vertex of one plane is a node; faces of the plane that share it belong together.
    node = np.unique(
        np.stack([np.repeat(plane.ravel(), 3), place.ravel()]), axis=1, return_inverse=True
    )
    member = node[1].reshape(-1, 3)
    ends = np.concatenate([member[:, [0, 1]], member[:, [1, 2]]])
    count = int(member.max()) + 1
    graph = coo_array((np.ones(len(ends), np.int8), (ends[:, 0], ends[:, 1])), (count, count))
    part = connected_components(graph, directed=False)[1][member[:, 0]]
    total = np.bincount(part, area)
    found = []
    for number in np.flatnonzero(total >= least_m2):
        faces = np.flatnonzero(part == number)
        largest = faces[area[faces].argmax()]
        found.append(
            Patch(faces, truth.normals[largest], float(offset[largest]), float(total[number]))
        )
    return found


def welded(vertices: Float64) -> Ints:
    """(v,) the same number for vertices at the same place."""
    grid = np.rint(vertices / WELD_M).astype(np.int64)
    _, place = np.unique(grid, axis=0, return_inverse=True)
    return place.ravel()


def kind_of(patch: Patch, truth: Truth) -> str:
    """Whether a patch is a wall, the floor or a table; "" where none."""
    if abs(patch.normal[2]) < 0.01 and _is_outermost(patch, truth):
        return "walls"
    if patch.normal[2] > 0.999:
        if abs(patch.offset_m) < 0.02:
            return "floor"
        if 0.7 < patch.offset_m < 0.8:
            return "table"
    return ""


def _is_outermost(patch: Patch, truth: Truth) -> bool:
    """Whether nothing stands behind most of a patch."""
    middle = truth.vertices[truth.faces[patch.faces]].mean(axis=1) - BEHIND_M * patch.normal
    back = np.broadcast_to(-patch.normal, middle.shape)
    reach = truth.scene.cast_rays(rays_of(middle, back))["t_hit"].numpy()
    return bool(np.isinf(reach).mean() > 0.5)


class Flatness:
    """The true planes of a room, to hold meshes against."""

    def __init__(self, truth: Truth) -> None:
        self._truth = truth
        self._patches = [
            (kind, patch)
            for patch in patches(truth, PLANE_AREA_M2)
            if (kind := kind_of(patch, truth))
        ]

    def figures(self, samples: Samples) -> Figures:
        """Residuals and angles by kind."""
        residuals: dict[str, list[Float64]] = {}
        angles: dict[str, list[Float64]] = {}
        for (kind, patch), scene in zip(self._patches, self._others, strict=True):
            mine = np.isin(samples.true_face, patch.faces) & samples.counts
            mine &= samples.away_m < OFF_M
            chosen = np.flatnonzero(mine)
            off = samples.points[chosen] @ patch.normal - patch.offset_m
            foot = samples.points[chosen] - off[:, None] * patch.normal
            chosen = np.flatnonzero(_distance(scene, foot) > ALONE_M)
            cosine = np.abs(samples.normals[np.flatnonzero(mine)[chosen]] @ patch.normal)
            residuals.setdefault(kind, []).append(off[chosen])
            angles.setdefault(kind, []).append(np.degrees(np.arccos(np.minimum(cosine, 1))))
        figures: Figures = {}
        for kind in sorted(residuals):
            off, angle = np.concatenate(residuals[kind]), np.concatenate(angles[kind])
            figures[f"{kind}_rms_mm"] = _rms(off) * 1000
            figures[f"{kind}_normals_deg"] = _rms(angle)
        return figures

    @cached_property
    def _others(self) -> list[object]:
        """For each patch the scene of all that is not in its plane."""
        corners = self._truth.vertices[self._truth.faces]
        scenes = []
        for _, patch in self._patches:
            in_plane = (np.abs(corners @ patch.normal - patch.offset_m) < 1e-3).all(axis=1)
            scenes.append(ray_scene(self._truth.vertices, self._truth.faces[~in_plane]))
        return scenes


class Creases:
    """The true creases of a room that a station sees from both sides.

    Attributes:
        points: (n, 3) one every 10 mm.
        sides: (n, 2, 3) unit normals of the planes that meet there.
        along: (n, 3) unit direction of the crease.
    """

    def __init__(self, truth: Truth) -> None:
        flat = patches(truth, CREASE_AREA_M2)
        boxes = [_box(truth, patch) for patch in flat]
        found: list[tuple[Float64, Float64, Float64]] = []
        scenes = [ray_scene(truth.vertices, truth.faces[patch.faces]) for patch in flat]
        for i, one in enumerate(flat):
            for j in range(i + 1, len(flat)):
                low = np.maximum(boxes[i][0], boxes[j][0]) - 2 * ON_M
                high = np.minimum(boxes[i][1], boxes[j][1]) + 2 * ON_M
                turned = abs(one.normal @ flat[j].normal) < np.cos(np.radians(ANGLE_DEG))
                if turned and (low <= high).all():
                    points, along = _meeting(one, flat[j], low, high)
                    for scene in (scenes[i], scenes[j]):
                        points = points[_distance(scene, points) < ON_M]
                    for scene, patch in ((scenes[i], one), (scenes[j], flat[j])):
                        points = points[_seen_aside(truth, scene, patch, points, along)]
                    sides = np.stack([one.normal, flat[j].normal])
                    found += [(point, sides, along) for point in points]
        self.points = np.array([each[0] for each in found]).reshape(-1, 3)
        self.sides = np.array([each[1] for each in found]).reshape(-1, 2, 3)
        self.along = np.array([each[2] for each in found]).reshape(-1, 3)

    def figures(self, vertices: Float64, faces: Int32) -> Figures:
        """How far the mesh's own creases lie from these."""
        from scipy.spatial import cKDTree

        ends, pair = _inner_edges(vertices, faces, cKDTree(self.points))
        normals = face_normals(vertices, faces)[pair]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        pieces = np.maximum(np.ceil(length / EDGE_STEP_M), 1).astype(np.int64)
        edge = np.repeat(np.arange(len(pieces)), pieces)
        order = np.arange(len(edge)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        share = ((order + 0.5) / pieces[edge])[:, None]
        at = ends[edge, 0] * (1 - share) + ends[edge, 1] * share
        away, nearest = cKDTree(self.points).query(at, distance_upper_bound=CREASE_REACH_M)
        close = np.flatnonzero(np.isfinite(away))
        edge, nearest, at = edge[close], nearest[close], at[close]
        # Positive where a face looks rather like the first plane.
        lean = np.einsum(
            "efx,ex->ef", normals[edge], self.sides[nearest, 0] - self.sides[nearest, 1]
        )
        turns = np.flatnonzero((lean[:, 0] >= 0) != (lean[:, 1] >= 0))
        edge, nearest, at = edge[turns], nearest[turns], at[turns]
        offset = at - self.points[nearest]
        offset -= (offset * self.along[nearest]).sum(axis=1, keepdims=True) * self.along[nearest]
        weight = (length / pieces)[edge]
        total = np.bincount(nearest, weight, len(self.points))
        sums = np.bincount(nearest, weight * np.linalg.norm(offset, axis=1), len(self.points))
        distance = np.where(total > 0, sums / np.maximum(total, 1e-12), CREASE_REACH_M)
        return {
            "creases_m": len(self.points) * STEP_M,
            "crease_median_mm": float(np.median(distance)) * 1000,
            "crease_p90_mm": float(np.quantile(distance, 0.9)) * 1000,
            "crease_within_4mm": float((distance <= CREASE_GOAL_M).mean()),
        }


def _box(truth: Truth, patch: Patch) -> tuple[Float64, Float64]:
    corners = truth.vertices[truth.faces[patch.faces]].reshape(-1, 3)
    return corners.min(axis=0), corners.max(axis=0)


def _meeting(one: Patch, other: Patch, low: Float64, high: Float64) -> tuple[Float64, Float64]:
    """(n, 3) points of the line in which two planes meet, within a box, and its direction."""
    along = np.cross(one.normal, other.normal)
    along /= np.linalg.norm(along)
    matrix = np.stack([one.normal, other.normal, along])
    middle = (low + high) / 2
    start = np.linalg.solve(matrix, [one.offset_m, other.offset_m, along @ middle])
    reach = float(np.linalg.norm(high - low)) / 2
    steps = np.arange(-reach, reach + STEP_M, STEP_M)
    points = start + steps[:, None] * along
    return points[((points >= low) & (points <= high)).all(axis=1)], along


def _seen_aside(truth: Truth, scene: Any, patch: Patch, points: Float64, along: Float64) -> Bools:
    """(n,) whether a station sees the patch a little beside each point of its edge."""
    seen = np.zeros(len(points), np.bool_)
    across = np.cross(along, patch.normal)
    face = np.full(len(points), patch.faces[0])
    for side in (-1, 1):
        beside = points + side * ASIDE_M * across
        if len(points):
            seen |= (_distance(scene, beside) < ON_M) & truth.seen(beside, face)
    return seen


def _inner_edges(vertices: Float64, faces: Int32, near: Any) -> tuple[Float64, Ints]:
    """(e, 2, 3) ends and (e, 2) faces of the edges between two faces that lie near some points."""
    place = welded(vertices)[faces]
    corners = vertices[faces]
    middle = corners.mean(axis=1)
    size = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    away = near.query(middle)[0]
    kept = np.flatnonzero(away < size + CREASE_REACH_M)
    a = place[kept][:, [0, 1, 2]].ravel()
    b = place[kept][:, [1, 2, 0]].ravel()
    key = np.minimum(a, b) * (place.max() + 1) + np.maximum(a, b)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    first, second = order[same], order[same + 1]
    ends = np.stack(
        [
            vertices[faces[kept][:, [0, 1, 2]].ravel()[first]],
            vertices[faces[kept][:, [1, 2, 0]].ravel()[first]],
        ],
        axis=1,
    )
    return ends, np.stack([kept[first // 3], kept[second // 3]], axis=1)


class Rails:
    """The thin rails of a room: points of them that a station sees, by rail and slice."""

    def __init__(self, truth: Truth, rods: list[Ints]) -> None:
        rng = np.random.default_rng(3)
        points, rail, slices = [], [], []
        for number, faces in enumerate(rods):
            corners = truth.vertices[truth.faces[faces]]
            area = np.linalg.norm(
                np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
            )
            count = int(area.sum() / 2 / RAIL_SAMPLES_M2)
            chosen = rng.choice(len(faces), count, p=area / area.sum())
            share = np.sort(rng.random((2, count)), axis=0)
            weights = np.stack([share[0], share[1] - share[0], 1 - share[1]], axis=1)
            at = (corners[chosen] * weights[:, :, None]).sum(axis=1)
            seen = truth.seen(at, faces[chosen])
            axis = np.linalg.svd(at - at.mean(axis=0), full_matrices=False)[2][0]
            along = at @ axis
            points.append(at[seen])
            rail.append(np.full(int(seen.sum()), number))
            slices.append(((along - along.min()) / STEP_M).astype(np.int64)[seen])
        self._count = len(rods)
        if rods:
            self._points = np.concatenate(points)
            self._rail, self._slice = np.concatenate(rail), np.concatenate(slices)

    def figures(self, vertices: Float64, faces: Int32) -> Figures:
        """What is left of them in a mesh."""
        if not self._count:
            return {}
        near = _distance(ray_scene(vertices, faces), self._points) <= RAIL_NEAR_M
        broken = 0
        for number in range(self._count):
            mine = self._rail == number
            asked = np.bincount(self._slice[mine])
            there = np.bincount(self._slice[mine & near], minlength=len(asked))
            gone = there[asked > 0] < RAIL_SHARE * asked[asked > 0]
            broken += bool((gone[1:] & gone[:-1]).any())
        return {"rails": self._count, "rails_share": float(near.mean()), "rails_broken": broken}


def model_rods(room: str, truth: Truth) -> list[Ints]:
    """The faces of each thin rail of a modelled room; none where the room is not modelled."""
    from tourgen.simulate import MODELS
    from tourgen.simulation.model import join

    if room not in MODELS:
        return []
    charts = MODELS[room]().charts
    mesh = join(charts)
    if not np.array_equal(mesh.faces, truth.faces):
        raise RuntimeError(f"{room}: its truth is of another model; make the demo again")
    return [
        np.flatnonzero(mesh.face_chart == number)
        for number, part in enumerate(charts)
        if _is_rod(part.points)
    ]


def _is_rod(grid: Float64) -> bool:
    """Whether the columns of a chart, but for its ends, are closed rings of a rail's radius."""
    rings = grid[:, 1:-1]
    closed = np.abs(rings[0] - rings[-1]).max(initial=0) < 1e-6
    radius = np.linalg.norm(rings[:-1] - rings[:-1].mean(axis=0), axis=2)
    return bool(rings.size and closed and np.abs(radius - RAIL_RADIUS_M).max() < 1e-4)


def _distance(scene: Any, points: Float64) -> Float64:
    import open3d as o3d

    if not len(points):
        return np.zeros(0)
    asked = o3d.core.Tensor(np.ascontiguousarray(points, dtype=np.float32))
    distance: Float64 = scene.compute_distance(asked).numpy()
    return distance


def _rms(values: Float64) -> float:
    return float(np.sqrt((values**2).mean())) if len(values) else float("nan")
