"""The free side of a surface, found without knowing where the scanner stood.

Free space is one: what two surfaces see of each other across a room, they see from their free
sides. So rays are sent from both sides of small patches, and each ray that leaves patch i on one
side and meets patch j on one side says that these two sides belong together: both look into the
open, or both into the same wall. Neighbours on a smooth surface say the same. That is a graph
with signs on its edges, a few of them wrong (rays slip through what no station saw). Averaging
each patch's value over its edges, again and again, leads to the assignment that the edges agree
on most (the leading eigenvector of the random walk on the graph, or, from patches that are known,
the harmonic function between them); a majority of each patch's edges has the last word. Free
space itself is one more node: what sends rays into nothing is not tied to it, for that is mostly
the back of a wall.

Right normals by the truth of tests/peers/orientation.py, nothing known: the stair (ten stations,
no blind disc) 99.7 %, chamber1 99.0 %, chamber2 98.0 %, where a bed behind a gallery of rails is
taken for a part of the wall; 4 s of two processors a million points. Rejected: a minimum spanning
tree over the tangent planes (Hoppe et al. 1992), 93 s, and one wrong edge turns all that hangs on
it; neighbours weighted by the cosine of their normals instead of that of one and the other's
reflection (Xie et al. 2003): chamber1 1 % less; rays that count however short: 0.2 % less; splats
of a whole patch, which shut the bed: chamber2 1 % less; 200,000 patches: the same in twice the
time; 40,000: 0.2 % less; rays only 2 to 4 % less, without the last majorities 0.1 % less.
Stations known to see a patch as further edges: chamber2 99.3 %, less than by the depth buffers of
``normals``, whose verdicts are the patches known here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix, csr_matrix
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64
from tourgen.neighbours import Neighbours
from tourgen.rays import ray_scene, rays_of
from tourgen.stages.tangent import across
from tourgen.threads import threads
from tourgen.voxels import voxel_groups

_PATCHES = 90_000
PATCH_M = 0.02
"""Edge of the smallest patches: much wider than noise, which turns what lies too near."""
_RAYS = 4
_NEIGHBOURS = 10
_NEAR = 6.0
"""Patches that a ray must be long to count in full: what it meets nearby is mostly its own."""
_SMOOTH = 4.0
"""Weight of a neighbour, in rays."""
_SPLAT = 0.6
"""Half of a splat's edge in patches: enough to overlap, not to close what stands open."""
_ROUNDS = 60
_MAJORITIES = 10
_VOTERS = 4


@dataclass(frozen=True, slots=True)
class _Edges:
    """Pairs of patches, and how sure (size) they look at the same (sign) side.

    Attributes:
        first, second: (e,) indices.
        weight: (e,) float64.
    """

    first: npt.NDArray[np.int64]
    second: npt.NDArray[np.int64]
    weight: Float64


def face_free_space(points: Float32, normals: Float32, known: npt.NDArray[np.bool_]) -> None:
    """Turn each normal to the free side of its surface, in place.

    Args:
        points: (n, 3) metres, of the inside of a room.
        normals: (n, 3) unit, either side.
        known: (n,) mask of the normals that are right already, and stay.
    """
    voxel_m = PATCH_M
    order, starts = voxel_groups(points, voxel_m)
    while len(starts) > _PATCHES:
        voxel_m *= 1.15
        order, starts = voxel_groups(points, voxel_m)
    chosen = order[starts]
    place, normal = points[chosen], normals[chosen]
    scene = _splats(place, normal, _SPLAT * voxel_m)
    rays, lost = _rays(scene, place, normal, known[chosen], voxel_m)
    edges = _joined([rays, lost, _smoothness(place, normal)])
    normal = normal * _agreed(edges, known[chosen])[:, None]
    follow(points, normals, ~known, place, normal)


def _rays(
    scene: Any,
    place: Float32,
    normal: Float32,
    known: npt.NDArray[np.bool_],
    patch_m: float,
) -> tuple[_Edges, _Edges]:
    """What each patch meets from both its sides; and, as edges to free space, which meet nothing.

    What meets nothing came from behind a wall, or left through a window; mostly the former. The
    back of what is known tells nothing: a board of which one side was scanned hides free space.
    """
    rng = np.random.default_rng(0)
    u, v = across(normal)
    source = np.repeat(np.arange(len(place)), _RAYS)
    found = []
    behind = np.zeros(len(place))
    for side in (1, -1):
        turn = rng.random((len(source), 1), np.float32) * np.float32(2 * np.pi)
        square = rng.random((len(source), 1), np.float32) * np.float32(0.9)
        flat = np.sqrt(square)
        way = flat * (np.cos(turn) * u[source] + np.sin(turn) * v[source])
        way += side * np.sqrt(1 - square) * normal[source]
        start = place[source] + np.float32(0.5 * side * patch_m) * normal[source]
        answer = scene.cast_rays(rays_of(start, way))
        reach = answer["t_hit"].numpy()
        hit = np.isfinite(reach)
        behind -= side * np.bincount(source[~hit], minlength=len(place))
        target = answer["primitive_ids"].numpy()[hit].astype(np.int64) // 2
        facing = -np.einsum("ij,ij->i", way[hit], normal[target])
        trust = np.minimum(reach[hit] / (_NEAR * patch_m), 1)
        told = ~(known[target] & (facing < 0))
        if side < 0:
            told &= ~known[source[hit]]
        weight = (side * facing * trust).astype(np.float64)
        found.append(_Edges(source[hit][told], target[told], weight[told]))
    lost = np.flatnonzero(behind)
    return _joined(found), _Edges(lost, np.full(len(lost), len(place)), behind[lost])


def _splats(place: Float32, normal: Float32, half_m: float) -> Any:
    """A ray casting scene with two triangles a patch, which overlap: rays must not slip."""
    u, v = (np.float32(half_m) * axis for axis in across(normal))
    corner = np.stack([place - u - v, place + u - v, place + u + v, place - u + v], axis=1)
    first = 4 * np.arange(len(place), dtype=np.uint32)[:, None, None]
    face = first + np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    return ray_scene(corner.reshape(-1, 3), face.reshape(-1, 3))


def _smoothness(place: Float32, normal: Float32) -> _Edges:
    count = min(_NEIGHBOURS + 1, len(place))
    near = np.asarray(cKDTree(place).query(place, k=np.arange(2, count + 1), workers=threads())[1])
    first, second = np.repeat(np.arange(len(place)), near.shape[1]), near.reshape(-1)
    alike = _likeness(place[first], normal[first], place[second], normal[second])
    return _Edges(first, second, (_SMOOTH * alike * np.abs(alike)).astype(np.float64))


def _likeness(at: Float32, normal: Float32, other_at: Float32, other: Float32) -> Float32:
    """Cosine of a normal and another one's reflection in the plane between the two places.

    On a round or a creased surface the reflection is what the normal becomes on the way.
    """
    way = other_at - at
    way /= np.linalg.norm(way, axis=-1, keepdims=True) + np.float32(1e-9)
    bend = (way * normal).sum(axis=-1) * (way * other).sum(axis=-1)
    return np.asarray((normal * other).sum(axis=-1) - 2 * bend)


def _joined(edges: list[_Edges]) -> _Edges:
    return _Edges(
        np.concatenate([each.first for each in edges]),
        np.concatenate([each.second for each in edges]),
        np.concatenate([each.weight for each in edges]),
    )


def _agreed(edges: _Edges, known: npt.NDArray[np.bool_]) -> Float32:
    """1 or -1 for each patch, so that the edges agree most; 1 for those known.

    The last node of the graph, after the patches, stands for free space.
    """
    count = len(known)
    fixed = np.append(np.flatnonzero(known), count) if known.any() else np.array([count])
    one_way = coo_matrix((edges.weight, (edges.first, edges.second)), (count + 1, count + 1))
    graph: csr_matrix = one_way.tocsr() + one_way.T.tocsr()
    degree = np.asarray(abs(graph).sum(axis=1)).reshape(-1) + 1e-9
    value = np.random.default_rng(0).normal(size=count + 1) * 1e-3
    value[fixed] = 1
    for _ in range(_ROUNDS):
        value = graph @ value / degree
        value /= np.abs(value).max() + 1e-30
        if known.any():
            value[fixed] = 1
    side = np.where(value * value[count] >= 0, 1.0, -1.0)
    for _ in range(_MAJORITIES):
        votes = graph @ side
        side = np.where(votes == 0, side, np.sign(votes))
        side[fixed] = 1
    return side[:count].astype(np.float32)


def follow(
    points: Float32,
    normals: Float32,
    those: npt.NDArray[np.bool_],
    place: Float32,
    normal: Float32,
) -> None:
    """Turn some normals as those of the places around them are turned, in place.

    Args:
        points: (n, 3) metres.
        normals: (n, 3) unit; is written.
        those: (n,) mask of the normals to turn.
        place: (m, 3) metres.
        normal: (m, 3) unit, of the places.
    """
    voters = min(_VOTERS, len(place))
    around = Neighbours.of(place, voters)
    left = np.flatnonzero(those)
    for start in range(0, len(left), 200_000):
        part = left[start : start + 200_000]
        near, away = around.nearest(points[part], voters)
        at, own = points[part][:, None], normals[part][:, None]
        alike = _likeness(at, own, place[near], normal[near])
        votes = (alike / (away + PATCH_M)).sum(axis=1)
        normals[part[votes < 0]] *= -1
