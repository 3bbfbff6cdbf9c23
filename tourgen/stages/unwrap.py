"""Unwrap: give each face of a tile its place in a picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from tourgen.errors import StageError
from tourgen.geometry import Mesh, UvMesh
from tourgen.raster import rasterize

if TYPE_CHECKING:
    from tourgen.geometry import Float32, Float64, Int32

VERSION = 1

Int64 = npt.NDArray[np.int64]
Bool = npt.NDArray[np.bool_]

_SMOOTHING_ROUNDS = 8
_AXIS_COS = np.cos(np.radians(40.0))
_MAX_AXES = 14
_LABEL_ROUNDS = 12
_LABEL_WEIGHT = 0.5
_MERGE_COS = np.cos(np.radians(75.0))
_RELAX_ROUNDS = 6
_SPLIT_ROUNDS = 6
_MAX_TEXTURE = 4096


@dataclass(frozen=True, slots=True)
class Settings:
    texel_m: float = 0.004
    padding_texels: int = 4
    min_chart_faces: int = 60


def unwrap(mesh: Mesh, settings: Settings) -> UvMesh:
    topology = _topology(mesh)
    chart = _segment(mesh, topology, settings)
    charts = _flatten_all(mesh, topology, chart, settings)
    return _pack(mesh, charts, settings)


@dataclass(frozen=True, slots=True)
class _Topology:
    """Faces that share an edge and agree on its direction."""

    pairs: Int64  # (e, 2) face indices
    lengths: Float64  # (e,) metres
    normals: Float64  # (f, 3) unit, or zero where the face has no area
    areas: Float64  # (f,)


def _topology(mesh: Mesh) -> _Topology:
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double_areas = np.linalg.norm(cross, axis=1)
    normals = cross / np.maximum(double_areas, 1e-30)[:, None]

    start = mesh.faces.astype(np.int64)
    end = np.roll(start, -1, axis=1)
    start, end = start.ravel(), end.ravel()
    face = np.repeat(np.arange(len(mesh.faces)), 3)
    count = len(mesh.vertices)
    forward, backward = start * count + end, end * count + start
    unique, index, uses = np.unique(forward, return_index=True, return_counts=True)
    once = index[uses == 1]  # an edge run twice in one direction is no manifold: cut there
    lookup = forward[once]
    at = np.searchsorted(lookup, backward[once])
    found = (at < len(lookup)) & (lookup[np.minimum(at, len(lookup) - 1)] == backward[once])
    one, two = once[found], once[at[found]]
    half = forward[one] < backward[one]
    one, two = one[half], two[half]
    lengths = np.linalg.norm(
        mesh.vertices[start[one]].astype(np.float64) - mesh.vertices[end[one]], axis=1
    )
    return _Topology(np.stack([face[one], face[two]], 1), lengths, normals, double_areas / 2)


def _adjacency(pairs: Int64, weights: Float64, count: int) -> sparse.csr_matrix:
    half = sparse.coo_matrix((weights, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return (half + half.T).tocsr()


def _unit(vectors: Float64) -> Float64:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def _segment(mesh: Mesh, topology: _Topology, settings: Settings) -> Int64:
    """(f,) chart of each face: connected faces that look about the same way."""
    count = len(mesh.faces)
    adjacency = _adjacency(topology.pairs, topology.lengths, count)
    smooth = topology.normals * topology.areas[:, None]
    mixing = _adjacency(topology.pairs, np.ones(len(topology.pairs)), count) + sparse.identity(count)
    mixing = sparse.diags(1 / np.asarray(mixing.sum(1)).ravel()) @ mixing
    for _ in range(_SMOOTHING_ROUNDS):
        smooth = mixing @ smooth
    smooth = _unit(smooth)

    axes = _axes(smooth, topology.areas)
    likeness = smooth @ axes.T
    label = likeness.argmax(1)
    share = sparse.diags(1 / np.maximum(np.asarray(adjacency.sum(1)).ravel(), 1e-30)) @ adjacency
    for _ in range(_LABEL_ROUNDS):
        votes = share @ np.eye(len(axes))[label]
        label = (likeness + _LABEL_WEIGHT * votes).argmax(1)
    same = label[topology.pairs[:, 0]] == label[topology.pairs[:, 1]]
    _, chart = connected_components(
        _adjacency(topology.pairs[same], np.ones(same.sum()), count), directed=False
    )
    return _merge_small(chart, smooth, topology, settings.min_chart_faces)


def _axes(normals: Float64, areas: Float64) -> Float64:
    """Directions such that nearly all area looks within 40 degrees of one of them."""
    step = max(len(normals) // 400, 1)
    candidates = normals[::step]
    near = (candidates @ normals.T > _AXIS_COS).astype(np.float64)
    left = np.maximum(areas, 1e-30).copy()
    total = left.sum()
    chosen: list[int] = []
    while len(chosen) < _MAX_AXES and left.sum() > 0.01 * total:
        best = int((near @ left).argmax())
        chosen.append(best)
        left[near[best] > 0] = 0
    axes = candidates[chosen]
    for _ in range(4):
        label = (normals @ axes.T).argmax(1)
        sums = np.stack(
            [np.bincount(label, normals[:, i] * areas, len(axes)) for i in range(3)], axis=1
        )
        moved = _unit(sums)
        axes = np.where(np.linalg.norm(moved, axis=1, keepdims=True) > 0.5, moved, axes)
    return axes


def _merge_small(chart: Int64, normals: Float64, topology: _Topology, least: int) -> Int64:
    """Join charts of few faces to the neighbour that shares most border with them."""
    count = int(chart.max()) + 1
    faces = np.bincount(chart, minlength=count)
    sums = np.stack(
        [np.bincount(chart, normals[:, i] * topology.areas, count) for i in range(3)], axis=1
    )
    one, two = chart[topology.pairs].T
    border = _adjacency(
        np.stack([one, two], 1)[one != two], topology.lengths[one != two], count
    )
    border.sum_duplicates()
    neighbours = [
        dict(zip(border.indices[a:b].tolist(), border.data[a:b].tolist(), strict=True))
        for a, b in zip(border.indptr[:-1], border.indptr[1:], strict=True)
    ]
    target = np.arange(count)
    for small in np.argsort(faces, kind="stable"):
        if faces[small] >= least or not neighbours[small]:
            continue
        axis = _unit(sums[small])
        best = max(
            neighbours[small],
            key=lambda other: (
                float(axis @ _unit(sums[other])) > _MERGE_COS,
                neighbours[small][other],
            ),
        )
        if axis @ _unit(sums[best]) < 0:
            continue
        target[small] = best
        faces[best] += faces[small]
        sums[best] += sums[small]
        for other, length in neighbours[small].items():
            del neighbours[other][small]
            if other != best:
                neighbours[best][other] = neighbours[best].get(other, 0.0) + length
                neighbours[other][best] = neighbours[other].get(best, 0.0) + length
        neighbours[small] = {}
    while (target[target] != target).any():
        target = target[target]
    return np.unique(target[chart], return_inverse=True)[1]


@dataclass(frozen=True, slots=True)
class _Charts:
    """Flattened charts, each in a plane of its own.

    Attributes:
        chart: (f,) chart of each face.
        source: (u,) vertex of the mesh that each chart vertex copies.
        faces: (f, 3) indices of chart vertices.
        flat: (u, 2) metres.
        vertex_chart: (u,) chart of each chart vertex.
    """

    chart: Int64
    source: Int64
    faces: Int64
    flat: Float64
    vertex_chart: Int64


def _flatten_all(mesh: Mesh, topology: _Topology, chart: Int64, settings: Settings) -> _Charts:
    """Flatten; where a chart folds over itself, cut it in two and try again."""
    for round_ in range(_SPLIT_ROUNDS + 1):
        charts = _flatten(mesh, topology, chart)
        bad = _folded(mesh, charts, settings.texel_m)
        if not bad.any():
            break
        chart = _cut(mesh, topology, chart, bad, last=round_ >= _SPLIT_ROUNDS - 1)
    return charts


def _flatten(mesh: Mesh, topology: _Topology, chart: Int64) -> _Charts:
    vertices = mesh.vertices.astype(np.float64)
    key = chart[:, None] * len(vertices) + mesh.faces
    unique, faces = np.unique(key, return_inverse=True)
    faces = faces.reshape(-1, 3)
    source, vertex_chart = unique % len(vertices), unique // len(vertices)
    count = int(chart.max()) + 1

    weighted = topology.normals * topology.areas[:, None]
    axis = _unit(np.stack([np.bincount(chart, weighted[:, i], count) for i in range(3)], axis=1))
    axis[np.linalg.norm(axis, axis=1) < 0.5] = (0.0, 0.0, 1.0)
    least = np.eye(3)[np.abs(axis).argmin(1)]
    right = _unit(np.cross(least, axis))
    up = np.cross(axis, right)
    at = vertices[source]
    flat = np.stack([(at * right[vertex_chart]).sum(1), (at * up[vertex_chart]).sum(1)], axis=1)
    flat = _relax(at, faces, flat, vertex_chart)
    return _Charts(chart, source, faces, flat, vertex_chart)


def _relax(at: Float64, faces: Int64, flat: Float64, vertex_chart: Int64) -> Float64:
    """As rigid as possible: each face keeps its shape as far as its neighbours let it.

    Liu, Zhang, Xu, Gotsman, Gortler: A local/global approach to mesh parameterization, 2008.
    """
    corners = at[faces]
    edge = corners[:, 1] - corners[:, 0]
    length = np.linalg.norm(edge, axis=1)
    along = edge / np.maximum(length, 1e-30)[:, None]
    other = corners[:, 2] - corners[:, 0]
    x = (other * along).sum(1)
    y = np.linalg.norm(other - x[:, None] * along, axis=1)
    zero = np.zeros_like(x)
    own = np.stack([zero, zero, length, zero, x, y], axis=1).reshape(-1, 3, 2)

    # Edge i runs from corner i + 1 to corner i + 2 and faces corner i.
    first, second = np.roll(own, -1, 1) - own, np.roll(own, -2, 1) - own
    cross = np.abs(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
    cotangent = (first * second).sum(2) / np.maximum(cross, 1e-12)
    weight = np.clip(cotangent, 0.05, 20.0) / 2
    begin, end = np.roll(faces, -1, 1), np.roll(faces, -2, 1)
    count = len(flat)
    half = sparse.coo_matrix((weight.ravel(), (begin.ravel(), end.ravel())), shape=(count, count))
    off = (half + half.T).tocsr()
    degree = np.asarray(off.sum(1)).ravel()
    pin = np.zeros(count)
    pin[np.unique(vertex_chart, return_index=True)[1]] = 1.0  # each chart may slide freely
    solve = sparse.linalg.splu(
        sparse.csc_matrix(sparse.diags(degree + pin + 1e-9) - off),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    own_edges = np.roll(own, -2, 1) - np.roll(own, -1, 1)
    for _ in range(_RELAX_ROUNDS):
        now = flat[end] - flat[begin]
        a = (weight[..., None] * now * own_edges).sum((1, 2))
        b = (
            weight * (now[..., 1] * own_edges[..., 0] - now[..., 0] * own_edges[..., 1])
        ).sum(1)
        norm = np.maximum(np.hypot(a, b), 1e-30)
        cos, sin = (a / norm)[:, None], (b / norm)[:, None]
        turned = np.stack(
            [
                cos * own_edges[..., 0] - sin * own_edges[..., 1],
                sin * own_edges[..., 0] + cos * own_edges[..., 1],
            ],
            axis=2,
        )
        pull = weight[..., None] * turned
        right_side = pin[:, None] * flat
        for i in range(2):
            right_side[:, i] += np.bincount(end.ravel(), pull[..., i].ravel(), count)
            right_side[:, i] -= np.bincount(begin.ravel(), pull[..., i].ravel(), count)
        flat = solve.solve(right_side)
    return flat


def _signed_areas(flat: Float64, faces: Int64) -> Float64:
    one, two = flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]
    return (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2


def _folded(mesh: Mesh, charts: _Charts, texel_m: float) -> Bool:
    """(f,) faces that lie on another face of their chart, or upside down."""
    return _signed_areas(charts.flat, charts.faces) < 0
