"""Unwrap: give each face of a tile its place in a picture.

Rooms are mostly flat, and noise is what shatters their charts. So faces are grouped by normals
averaged over the faces about them, each group is seen from its front and relaxed as rigidly as
possible, what still folds over itself is opened conformally or cut, what fills its box badly (an
L, a frame) is halved, crumbs join a neighbour, and the charts drop into the picture like the
pieces of a falling-block game. Everything is deterministic.

Eight leaves of a scanned room of 6 m (3,960 faces each, texels of 5 mm, 4 texels apart), one busy
core, seconds for 10,000 faces, faces a chart in the median, share of the picture that faces fill:

    xatlas 0.0.11, its defaults                                           2.9 s     4    56 %
    xatlas, max_cost 100, normal deviation 0.5, no straightness or seams  2.9 s     7    54 %
    this stage                                                            2.4 s    19    64 %

A sixth of its charts are pieces of the tile that hang on nothing (22 of 137, most of 1 to 4 faces),
which no unwrapping can join; the others have 66 faces in the median.

Also tried and rejected: xatlas for packing alone (``add_uv_mesh``), 4 points less filled than
dropping, and it loses flat charts and stretches the others to whole texels; its ``bruteForce``,
1 point less filled and up to 2.4 s a tile; projection without relaxing, which would stretch a
curved wall by up to 1.3 where relaxing keeps it within 1.05; cutting two rings about every fold,
which leaves twice the crumbs; wider cones of normals (50 degrees), 2 points less filled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.ndimage import minimum_filter1d
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from tourgen.errors import StageError
from tourgen.geometry import Mesh, UvMesh
from tourgen.raster import rasterize

if TYPE_CHECKING:
    from tourgen.geometry import Float64

VERSION = 1

Int64 = npt.NDArray[np.int64]
Bool = npt.NDArray[np.bool_]

_SMOOTHING_ROUNDS = 8
_AXIS_COS = np.cos(np.radians(40.0))  # a group's normals lie about an axis
_MAX_AXES = 14
_LABEL_ROUNDS = 12
_LABEL_WEIGHT = 0.5  # of agreeing with the faces about, against looking along the axis
_MERGE_COS = np.cos(np.radians(75.0))
_RELAX_ROUNDS = 6
_UNTANGLE_ROUNDS = 4
_TUTTE_ROUNDS = 20
_FEW_FOLDS = 0.1  # share of a chart's faces up to which folds are taken out
_RINGS = 3  # taken out with a fold
_LEAST_AREA = 0.1  # of a face, as drawn, for a crumb to stay joined
_HALVE_GAIN = 0.8  # two boxes, as a share of the one that they replace
_ANGLES = np.radians(np.arange(0.0, 90.0, 3.0))
_TOUCH = 0.71  # half a texel's diagonal: any texel touched at all
_EDGE = 1e-3  # share of a corner below which a place counts as on the edge
_MAX_TEXTURE = 4096
_COARSER = 1.2
_WIDTHS = (0.55, 0.7, 0.85, 1.0, 1.15, 1.35)  # of the side of a square that all charts would fill


@dataclass(frozen=True, slots=True)
class Settings:
    """How a tile is unwrapped.

    Attributes:
        texel_m: Edge of a texel on the surface.
        padding_texels: Between any two charts, and between a chart and the picture's border.
        min_chart_faces: A chart of fewer joins a neighbour, where one looks about its way.
    """

    texel_m: float = 0.004
    padding_texels: int = 4
    min_chart_faces: int = 60


def unwrap(mesh: Mesh, settings: Settings) -> UvMesh:
    """Cut a tile into charts, flatten them and lay them into one picture.

    Args:
        mesh: A tile; faces without area and loose pieces may be among its faces.
        settings: See there.

    Returns:
        The same faces in the same order. Charts lie at least ``padding_texels`` apart and do not
        overlap; the picture's sides are multiples of 4 up to 4096. Where a tile's charts do not
        fit such a picture, its texels grow, and ``texel_m`` says to what.

    Raises:
        StageError: Where the mesh has no face.
    """
    if not len(mesh.faces):
        raise StageError("unwrap: expected a tile of at least 1 face, found 0")
    topology = _topology(mesh)
    charts = _charts(mesh, topology, _segment(topology, settings), settings)
    while True:
        unwrapped = _pack(mesh, charts, settings)
        width, height = unwrapped.texture_size
        corners = unwrapped.uv.astype(np.float64)[unwrapped.mesh.faces] * (width, height)
        twice = _on_another(corners, width, height)
        if not twice.any():
            return unwrapped
        cut = _components(topology, _cut(mesh, topology, charts.chart, twice))
        charts = _unfolded(mesh, topology, cut, settings)


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
    _, index, uses = np.unique(forward, return_index=True, return_counts=True)
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
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, 1e-30), np.float64)


def _sums(label: Int64, values: Float64, count: int) -> Float64:
    """(count, k) the sum of the (n, k) values of each label."""
    columns = [np.bincount(label, column, count) for column in values.T]
    return np.stack(columns, axis=1).astype(np.float64)


def _segment(topology: _Topology, settings: Settings) -> Int64:
    """(f,) chart of each face: connected faces that look about the same way."""
    count = len(topology.areas)
    normals = _smoothed(topology)
    axes = _axes(normals, topology.areas)
    likeness: Float64 = normals @ axes.T
    label = likeness.argmax(1).astype(np.int64)
    adjacency = _adjacency(topology.pairs, topology.lengths, count)
    border = np.maximum(np.asarray(adjacency.sum(1)).ravel(), 1e-30)
    share = sparse.diags(1 / border) @ adjacency
    for _ in range(_LABEL_ROUNDS):
        votes = share @ np.eye(len(axes))[label]
        label = (likeness + _LABEL_WEIGHT * votes).argmax(1).astype(np.int64)
    chart = _components(topology, label)
    return _merge_small(chart, normals, topology, settings.min_chart_faces, 0.0)


def _smoothed(topology: _Topology) -> Float64:
    """(f, 3) normals averaged over the faces about, so that noise does not shatter charts."""
    count = len(topology.areas)
    mixing = _adjacency(topology.pairs, np.ones(len(topology.pairs)), count)
    mixing = mixing + sparse.identity(count, format="csr")
    mixing = sparse.diags(1 / np.asarray(mixing.sum(1)).ravel()) @ mixing
    normals = topology.normals * topology.areas[:, None]
    for _ in range(_SMOOTHING_ROUNDS):
        normals = mixing @ normals
    return _unit(normals)


def _axes(normals: Float64, areas: Float64) -> Float64:
    """Directions such that nearly all area looks within 40 degrees of one of them."""
    step = max(len(normals) // 400, 1)
    candidates = normals[::step]
    near: Float64 = (candidates @ normals.T > _AXIS_COS).astype(np.float64)
    left = np.maximum(areas, 1e-30)
    total = left.sum()
    chosen: list[int] = []
    while len(chosen) < _MAX_AXES and left.sum() > 0.01 * total:
        best = int((near @ left).argmax())
        chosen.append(best)
        left[near[best] > 0] = 0
    axes = candidates[chosen]
    for _ in range(4):
        label = (normals @ axes.T).argmax(1)
        moved = _unit(_sums(label.astype(np.int64), normals * areas[:, None], len(axes)))
        axes = np.where(np.linalg.norm(moved, axis=1, keepdims=True) > 0.5, moved, axes)
    return axes


def _merge_small(
    chart: Int64, normals: Float64, topology: _Topology, least: int, least_cos: float
) -> Int64:
    """Join charts of few faces to the neighbour that shares most border with them."""
    count = int(chart.max()) + 1
    faces = np.bincount(chart, minlength=count)
    sums = _sums(chart, normals * topology.areas[:, None], count)
    one, two = chart[topology.pairs].T
    border = _adjacency(np.stack([one, two], 1)[one != two], topology.lengths[one != two], count)
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
        if axis @ _unit(sums[best]) < least_cos:
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
    return _numbered(target[chart])


@dataclass(frozen=True, slots=True)
class _Charts:
    """Flattened charts, each in a plane of its own.

    Attributes:
        chart: (f,) chart of each face.
        source: (u,) vertex of the mesh that each chart vertex copies.
        faces: (f, 3) indices of chart vertices.
        flat: (u, 2) metres.
        vertex_chart: (u,) chart of each chart vertex.
        bad: (f,) faces that lie on another face of their chart, or upside down.
    """

    chart: Int64
    source: Int64
    faces: Int64
    flat: Float64
    vertex_chart: Int64
    bad: Bool


def _charts(mesh: Mesh, topology: _Topology, chart: Int64, settings: Settings) -> _Charts:
    """Flatten; mend what folds over itself, cut what fills its box badly, join what is small."""
    charts = _unfolded(mesh, topology, chart, settings)
    halved = _halve(charts, settings.min_chart_faces)
    if not np.array_equal(halved, charts.chart):
        charts = _unfolded(mesh, topology, _components(topology, halved), settings)
    return _joined(mesh, topology, charts, settings)


def _unfolded(mesh: Mesh, topology: _Topology, chart: Int64, settings: Settings) -> _Charts:
    """Cut until no chart folds; a round only cuts, and a face alone cannot fold: it ends."""
    charts = _flatten(mesh, topology, chart, settings.texel_m)
    while charts.bad.any():
        cut = _components(topology, _cut(mesh, topology, charts.chart, charts.bad))
        charts = _flatten(mesh, topology, cut, settings.texel_m)
    return charts


def _joined(mesh: Mesh, topology: _Topology, charts: _Charts, settings: Settings) -> _Charts:
    """Join small charts to a neighbour; those that then fold or stretch go back."""
    before = charts.chart
    joined = _merge_small(before, topology.normals, topology, settings.min_chart_faces, -1.0)
    sizes = np.bincount(before)
    if joined.max() == before.max():
        return charts
    for last in (False, False, True):
        tried = _flatten(mesh, topology, joined, settings.texel_m)
        bad = tried.bad | _stretched(tried, topology)
        if not bad.any():
            return tried
        # The largest of a group stays; of the others, those that hold a bad face leave it.
        largest = np.zeros(int(joined.max()) + 1, np.int64)
        np.maximum.at(largest, joined, sizes[before])
        leaves = np.bincount(before, bad) > 0
        leaving = leaves[before] & (sizes[before] < largest[joined])
        groups = np.bincount(joined, bad) > 0
        mended = np.bincount(joined, leaving) > 0
        back = leaving | (groups & (last | ~mended))[joined]
        joined = _numbered(np.where(back, before + joined.max() + 1, joined))
    return _unfolded(mesh, topology, _components(topology, joined), settings)


def _stretched(charts: _Charts, topology: _Topology) -> Bool:
    """(f,) faces drawn at less than a part of their area."""
    return _signed_areas(charts.flat, charts.faces) < _LEAST_AREA * topology.areas


def _numbered(label: Int64) -> Int64:
    return np.unique(label, return_inverse=True)[1].astype(np.int64)


def _components(topology: _Topology, label: Int64) -> Int64:
    """Number the connected faces of one label."""
    same = label[topology.pairs[:, 0]] == label[topology.pairs[:, 1]]
    joined = _adjacency(topology.pairs[same], np.ones(int(same.sum())), len(label))
    return connected_components(joined, directed=False)[1].astype(np.int64)


def _cut(mesh: Mesh, topology: _Topology, chart: Int64, bad: Bool) -> Int64:
    """Where a few faces fold, take them out with those about them; where many do, cut in two."""
    whole, chart = chart, chart.copy()
    faces, folds = np.bincount(chart), np.bincount(chart, bad)
    few = bad & (folds < _FEW_FOLDS * faces)[chart]
    one, two = topology.pairs[chart[topology.pairs[:, 0]] == chart[topology.pairs[:, 1]]].T
    out = few
    for _ in range(_RINGS):
        grown = out.copy()
        grown[one] |= out[two]
        grown[two] |= out[one]
        out = grown
    centers = mesh.vertices[mesh.faces].mean(1, dtype=np.float64)
    next_chart = len(faces)
    # A chart that is taken out whole would come back as it was.
    many = (folds >= np.maximum(_FEW_FOLDS * faces, 1)) | (np.bincount(chart, out) == faces)
    for which in np.flatnonzero(many):
        inside = np.flatnonzero(chart == which)
        place = centers[inside] - centers[inside].mean(0)
        size = np.sqrt((place**2).sum(1).mean())
        feature = np.concatenate([place / max(size, 1e-30), 2 * topology.normals[inside]], axis=1)
        side = _two_means(feature)
        if side.all() or not side.any():
            side = np.arange(len(inside)) < len(inside) // 2
        chart[inside[side]] = next_chart
        next_chart += 1
    return np.where(out & ~many[whole], chart + next_chart, chart)


def _halve(charts: _Charts, least: int) -> Int64:
    """Cut bent charts (an L, a V, a frame) where two boxes hold them better than one."""
    center = charts.flat[charts.faces].mean(1)
    chart = charts.chart.copy()
    for which in np.flatnonzero(np.bincount(chart) >= 2 * least):
        inside = np.flatnonzero(charts.chart == which)
        whole = charts.flat[charts.faces[inside]]
        side = _two_means(center[inside])
        if not least <= side.sum() <= len(side) - least:
            continue
        area = _box_area(whole)
        halves = _box_area(whole[side]) + _box_area(whole[~side])
        if halves < _HALVE_GAIN * area:
            chart[inside[side]] = chart.max() + 1
    return chart


def _two_means(points: Float64) -> Bool:
    """(n,) which of two groups, by Lloyd's rounds from the ends of the longest axis."""
    apart = points - points.mean(0)
    along = apart @ np.linalg.eigh(apart.T @ apart)[1][:, -1]
    side: Bool = along > 0
    for _ in range(10):
        if side.all() or not side.any():
            break
        one, two = points[side].mean(0), points[~side].mean(0)
        side = ((points - one) ** 2).sum(1) < ((points - two) ** 2).sum(1)
    return side


def _box_area(corners: Float64) -> float:
    """The area of the smallest box about the corners, of boxes turned by steps of 3 degrees."""
    points = corners.reshape(-1, 2)
    cos, sin = np.cos(_ANGLES), np.sin(_ANGLES)
    across = points @ np.stack([cos, -sin])
    down = points @ np.stack([sin, cos])
    return float((np.ptp(across, axis=0) * np.ptp(down, axis=0)).min())


def _flatten(mesh: Mesh, topology: _Topology, chart: Int64, texel_m: float) -> _Charts:
    """Each chart into a plane: seen from the front and relaxed, or conformally where that folds."""
    vertices = mesh.vertices.astype(np.float64)
    key = chart[:, None] * len(vertices) + mesh.faces
    unique, faces = np.unique(key, return_inverse=True)
    faces = faces.reshape(-1, 3)
    source, vertex_chart = unique % len(vertices), unique // len(vertices)
    count = int(chart.max()) + 1

    axis = _unit(_sums(chart, topology.normals * topology.areas[:, None], count))
    axis[np.linalg.norm(axis, axis=1) < 0.5] = (0.0, 0.0, 1.0)
    least = np.eye(3)[np.abs(axis).argmin(1)]
    right = _unit(np.cross(least, axis))
    up = np.cross(axis, right)
    at = vertices[source]
    seen = np.stack([(at * right[vertex_chart]).sum(1), (at * up[vertex_chart]).sum(1)], axis=1)
    own = _laid(at[faces])
    flat = _untangle(_relax(own, faces, seen, vertex_chart), faces)
    bad = _folded(flat, faces, chart, vertex_chart, texel_m)
    folds = np.bincount(chart, bad)
    if bad.any():
        some = folds[chart] > 0
        used, again = np.unique(faces[some], return_inverse=True)
        again = again.reshape(-1, 3)
        owner = vertex_chart[used]
        start = _conformal(own[some], again, seen[used], at[used], owner)
        other = flat.copy()
        other[used] = _untangle(_relax(own[some], again, start, owner), again)
        folded = _folded(other, faces, chart, vertex_chart, texel_m)
        better = np.bincount(chart, folded) < folds
        flat = np.where(better[vertex_chart, None], other, flat)
        bad = np.where(better[chart], folded, bad)
    return _Charts(chart, source, faces, flat, vertex_chart, bad)


def _laid(corners: Float64) -> Float64:
    """(f, 3, 2) each face in its own plane, its first edge along the first axis."""
    edge = corners[:, 1] - corners[:, 0]
    length = np.linalg.norm(edge, axis=1)
    along = edge / np.maximum(length, 1e-30)[:, None]
    other = corners[:, 2] - corners[:, 0]
    x = (other * along).sum(1)
    y = np.linalg.norm(other - x[:, None] * along, axis=1)
    zero = np.zeros_like(x)
    return np.stack([zero, zero, length, zero, x, y], axis=1).reshape(-1, 3, 2)


def _conformal(
    own: Float64, faces: Int64, seen: Float64, at: Float64, vertex_chart: Int64
) -> Float64:
    """Angles kept as far as possible, two far vertices of each chart pinned.

    It starts from no picture of the chart, so it opens folds that would stay folded if seen.

    Lévy, Petitjean, Ray, Maillot: Least squares conformal maps, 2002, in complex numbers.
    """
    count = len(seen)
    plane = own[..., 0] + 1j * own[..., 1]
    opposite = np.roll(plane, -2, 1) - np.roll(plane, -1, 1)
    area = np.abs((np.conj(opposite[:, 2]) * opposite[:, 0]).imag)
    value = opposite / np.sqrt(np.maximum(area, 1e-12))[:, None]
    row = np.repeat(np.arange(len(faces)), 3)
    residual = sparse.csr_matrix((value.ravel(), (row, faces.ravel())), shape=(len(faces), count))
    # Far apart: the two ends along the axis in which the chart, as seen, is longest.
    across = np.unique(vertex_chart, return_inverse=True)[1]
    low, high = _boxes(seen, across, int(across.max()) + 1)
    longest = (high - low).argmax(1)[across]
    order = np.lexsort((seen[np.arange(count), longest], across))
    first = np.flatnonzero(np.diff(across[order], prepend=-1))
    last = np.append(first[1:], count) - 1
    ends = order[first], order[last]
    pin, target = np.zeros(count), np.zeros(count, complex)
    pin[ends[0]] = pin[ends[1]] = 1.0
    target[ends[1]] = np.linalg.norm(at[ends[1]] - at[ends[0]], axis=1)
    normal = residual.conj().T @ residual + sparse.diags(pin + 1e-9)
    solved = np.asarray(splu(sparse.csc_matrix(normal)).solve(pin * target))
    return np.stack([solved.real, solved.imag], axis=1)


def _relax(own: Float64, faces: Int64, flat: Float64, vertex_chart: Int64) -> Float64:
    """As rigid as possible: each face keeps its shape as far as its neighbours let it.

    Liu, Zhang, Xu, Gotsman, Gortler: A local/global approach to mesh parameterization, 2008.
    """
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
    solve = splu(
        sparse.csc_matrix(sparse.diags(degree + pin + 1e-9) - off),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    own_edges = np.roll(own, -2, 1) - np.roll(own, -1, 1)
    for _ in range(_RELAX_ROUNDS):
        now = flat[end] - flat[begin]
        a = (weight[..., None] * now * own_edges).sum((1, 2))
        b = (weight * (now[..., 1] * own_edges[..., 0] - now[..., 0] * own_edges[..., 1])).sum(1)
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
        flat = np.asarray(solve.solve(right_side))
    return flat


def _signed_areas(flat: Float64, faces: Int64) -> Float64:
    one, two = flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]
    return (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2


def _untangle(flat: Float64, faces: Int64) -> Float64:
    """Draw the vertices about upside-down faces toward the middle of their neighbours.

    Tutte: How to draw a graph, 1963, on small patches; the border of a chart stays.
    """
    count = len(flat)
    begin, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edges = sparse.coo_matrix((np.ones(len(begin)), (begin, end)), shape=(count, count)).tocsr()
    lone = (edges - edges.T).tocoo()
    inner = np.ones(count, bool)
    inner[lone.row[lone.data != 0]] = False
    both = edges + edges.T
    degree = np.maximum(np.asarray(both.sum(1)).ravel(), 1.0)
    mean = sparse.csr_matrix(sparse.diags(1 / degree) @ both)
    for ring in range(1, _UNTANGLE_ROUNDS + 1):
        upside_down = _signed_areas(flat, faces) <= 0
        upside_down &= inner[faces].any(1)
        if not upside_down.any():
            break
        near = np.zeros(count)
        near[faces[upside_down]] = 1.0
        for _ in range(ring - 1):
            near = near + np.asarray(both @ near)
        moving = np.flatnonzero((near > 0) & inner)
        rows = mean[moving]
        for _ in range(_TUTTE_ROUNDS):
            flat = flat.copy()
            flat[moving] = np.asarray(rows @ flat)
    return flat


def _folded(flat: Float64, faces: Int64, chart: Int64, vertex_chart: Int64, texel_m: float) -> Bool:
    """(f,) faces that lie on another face of their chart, or upside down.

    Charts are rasterised apart from one another.
    """
    low, high = _boxes(flat, vertex_chart, int(chart.max()) + 1)
    heights = np.ceil((high - low)[:, 1] / texel_m).astype(np.int64) + 2
    tops = np.cumsum(heights) - heights
    at = (flat - low[vertex_chart]) / texel_m + 1
    at[:, 1] += tops[vertex_chart]
    width = int(np.ceil((high - low)[:, 0].max() / texel_m)) + 3
    upside_down: Bool = _signed_areas(flat, faces) < 0
    return upside_down | _on_another(at[faces], width, int(heights.sum()))


def _on_another(corners: Float64, width: int, height: int) -> Bool:
    """(f,) faces that cover the centre of a texel which another face covers too."""
    hits = rasterize(corners, width, height)
    # A centre on a common edge belongs to both of its faces, and is no overlap.
    deep = hits.barycentric.min(1) > _EDGE
    key = hits.row[deep].astype(np.int64) * width + hits.column[deep]
    order = np.argsort(key, kind="stable")
    twice = np.flatnonzero(np.diff(key[order]) == 0)
    found = hits.face[deep][order]
    bad = np.zeros(len(corners), bool)
    bad[found[twice]] = True
    bad[found[twice + 1]] = True
    return bad


def _boxes(flat: Float64, owner: Int64, count: int) -> tuple[Float64, Float64]:
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, owner, flat)
    np.maximum.at(high, owner, flat)
    return low, high


@dataclass(frozen=True, slots=True)
class _Shape:
    """A chart's outline as a stack of columns, in one of four turns.

    Attributes:
        turn: Quarter turns.
        top: (w,) first row of each column.
        bottom: (w,) row after the last.
    """

    turn: int
    top: Int64
    bottom: Int64


@dataclass(frozen=True, slots=True)
class _Layout:
    """Where each chart goes: turned, then shifted by whole texels."""

    width: int
    height: int
    turn: Int64  # (c,)
    shift: Int64  # (c, 2) column, row


def _pack(mesh: Mesh, charts: _Charts, settings: Settings) -> UvMesh:
    """Lay the charts into the smallest of several widths of picture."""
    texel_m = settings.texel_m
    flat = _upright(charts)
    count = int(charts.chart.max()) + 1
    low, high = _boxes(flat, charts.vertex_chart, count)
    while True:
        extent = np.ceil((high - low) / texel_m).astype(np.int64) + 2
        at = (flat - low[charts.vertex_chart]) / texel_m + 1
        shapes = _shapes(at, charts, extent)
        layout = _best_layout(shapes, settings.padding_texels)
        if layout is not None:
            break
        texel_m *= _COARSER
    quarter = layout.turn[charts.vertex_chart]
    size = extent[charts.vertex_chart]
    placed = _quarter_turns(at, size, quarter) + layout.shift[charts.vertex_chart]
    uv = placed / (layout.width, layout.height)
    return UvMesh(
        Mesh(mesh.origin, mesh.vertices[charts.source], charts.faces.astype(np.int32)),
        np.clip(uv, 0, 1).astype(np.float32),
        charts.chart.astype(np.int32),
        (layout.width, layout.height),
        texel_m,
    )


def _quarter_turns(at: Float64, size: Int64, turn: Int64) -> Float64:
    """Turn points of boxes of ``size`` about, so that the turned box begins at 0 again."""
    x, y = at.T
    width, height = size.T
    return np.stack(
        [
            np.choose(turn, [x, height - y, width - x, y]),
            np.choose(turn, [y, x, height - y, width - x]),
        ],
        axis=1,
    )


def _shapes(at: Float64, charts: _Charts, extent: Int64) -> list[list[_Shape]]:
    """For each chart its outline in four turns: every texel that it touches."""
    first_row = np.cumsum(extent[:, 1]) - extent[:, 1]
    apart = at.copy()
    apart[:, 1] += first_row[charts.vertex_chart]
    hits = rasterize(
        apart[charts.faces], int(extent[:, 0].max()), int(extent[:, 1].sum()), reach=_TOUCH
    )
    owner = charts.chart[hits.face]
    order = np.argsort(owner, kind="stable")
    row = (hits.row - first_row[owner])[order]
    column = hits.column[order].astype(np.int64)
    ends = np.cumsum(np.bincount(owner, minlength=len(extent)))
    shapes = []
    for which, (width, height) in enumerate(extent):
        part = slice(ends[which - 1] if which else 0, ends[which])
        # A neighbour's margin may reach in, where two charts were stacked: its own rows only.
        x, y = column[part], np.clip(row[part], 0, height - 1)
        left, right = _columns(x, y, int(width))
        up, down = _columns(y, x, int(height))
        shapes.append(
            [
                _Shape(0, left, right),
                _Shape(1, up[::-1], down[::-1]),
                _Shape(2, height - right[::-1], height - left[::-1]),
                _Shape(3, width - down, width - up),
            ]
        )
    return shapes


def _columns(x: Int64, y: Int64, width: int) -> tuple[Int64, Int64]:
    """First row of each column and the row after its last; an empty one takes a neighbour's."""
    top, bottom = np.full(width, np.iinfo(np.int64).max), np.full(width, -1)
    np.minimum.at(top, x, y)
    np.maximum.at(bottom, x, y + 1)
    filled = np.flatnonzero(bottom >= 0)
    nearest = filled[np.searchsorted((filled[1:] + filled[:-1]) // 2, np.arange(width))]
    return top[nearest], bottom[nearest]


def _best_layout(shapes: list[list[_Shape]], padding: int) -> _Layout | None:
    """The smallest picture, or None where none stays within the largest texture."""
    texels = sum(int((chart[0].bottom - chart[0].top + padding).sum()) for chart in shapes)
    lengths = np.array([[len(shape.top) for shape in chart[:2]] for chart in shapes]) + 2 * padding
    order = np.argsort(-lengths.max(1), kind="stable")
    side = float(np.sqrt(texels))
    widths = {int(side * factor) for factor in _WIDTHS} | {int(lengths.max())}
    least = int(lengths.min(1).max())
    layouts = [
        _lay(shapes, order, -(-max(width, least) // 4) * 4, padding)
        for width in sorted({max(width, least) for width in widths})
    ]
    fitting = [one for one in layouts if max(one.width, one.height) <= _MAX_TEXTURE]
    return min(fitting, key=lambda one: one.width * one.height, default=None)


def _lay(shapes: list[list[_Shape]], order: Int64, width: int, padding: int) -> _Layout:
    """Drop the charts, longest first, each where and how turned its lowest row comes highest up.

    Lévy, Petitjean, Ray, Maillot: Least squares conformal maps for automatic texture atlas
    generation, 2002, section 4.
    """
    skyline = np.full(width, padding, np.int64)
    turn = np.zeros(len(shapes), np.int64)
    shift = np.zeros((len(shapes), 2), np.int64)
    used = 0
    for which in order:
        best: tuple[tuple[int, int], _Shape, int, int] | None = None
        for shape in shapes[which]:
            if len(shape.top) + 2 * padding > width:
                continue
            reach = minimum_filter1d(np.pad(shape.top, padding, mode="edge"), 2 * padding + 1)
            windows = np.lib.stride_tricks.sliding_window_view(skyline, len(reach))
            rows = (windows - reach).max(1)
            column = int(rows.argmin())
            row = int(rows[column])
            wasted = int((row + reach - windows[column]).sum())
            key = (row + int(shape.bottom.max()), wasted)
            if best is None or key < best[0]:
                best = (key, shape, column + padding, row)
        assert best is not None
        _, shape, column, row = best
        span = slice(column, column + len(shape.top))
        skyline[span] = np.maximum(skyline[span], row + shape.bottom + padding)
        turn[which] = shape.turn
        shift[which] = (column, row)
        used = max(used, column + len(shape.top) + padding)
    height = int(skyline.max())
    return _Layout(-(-used // 4) * 4, -(-height // 4) * 4, turn, shift)


def _upright(charts: _Charts) -> Float64:
    """Turn each chart so that the box about it is smallest."""
    count = int(charts.chart.max()) + 1
    best_area = np.full(count, np.inf)
    best = np.zeros(count)
    for angle in _ANGLES:
        low, high = _boxes(_turn(charts.flat, angle), charts.vertex_chart, count)
        area = (high - low).prod(1)
        better = area < best_area * (1 - 1e-6)
        best_area[better], best[better] = area[better], angle
    return _turn(charts.flat, best[charts.vertex_chart])


def _turn(flat: Float64, angle: float | Float64) -> Float64:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * flat[:, 0] - sin * flat[:, 1], sin * flat[:, 0] + cos * flat[:, 1]], 1)
