"""Unwrap: give each face of a tile its place in a picture.

Faces that look about one way make a chart (``charts``), which is laid flat as rigidly as possible
(``flatten``). What folds over itself is cut out, crumbs join a neighbour where that folds nothing,
and xatlas packs the charts. Everything is deterministic.

Seven leaves, a branch and the root of a scanned room of 6 m (4,000 to 12,000 faces each, texels of
5 mm on leaves), one core of a busy machine, seconds for 10,000 faces, share of the picture that
faces fill, and how far edges are stretched at the 95th percentile of the area:

    before: own packing, conformal maps, halved boxes        4.1 s    58 %    1.10
    this stage                                               1.4 s    61 %    1.11
    this stage, packing by bruteForce                        2.5 s    63 %    1.11

Xatlas making the charts too: 2.9 s and 56 %, charts of 4 faces in the median (eight other leaves).

Packing alone, fourteen leaves, seconds for 10,000 faces and share of the picture filled:

    random places, charts turned to the least box            0.11 s   55 %
    all standing                                             0.11 s   58 %   (chosen)
    all lying                                                0.11 s   57 %
    the best of the three                                    0.33 s   59 %
    bruteForce, the best of the three                        0.57 s   61 %
    the same, and turned as rotate_charts would              0.99 s   62 %
    bruteForce and rotate_charts, which mirrors charts       0.23 s   60 %
    own falling-block packing, on charts made for it         0.78 s   61 %

Also tried, with next to no effect on charts or fill, and so left out: opening folds conformally,
halving charts that fill their box badly, halving by two means, cutting many folds otherwise than
few, twelve rounds of relabelling. Worth their time: joining in rounds (577 charts without, 366
with), drawing out tangles (433 without), three rings about a fold (394 with two).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tourgen.errors import StageError
from tourgen.geometry import Mesh, UvMesh
from tourgen.stages.charts import (
    Topology,
    components,
    cut,
    merge_small,
    numbered,
    segment,
    topology,
)
from tourgen.stages.flatten import boxes, drawn_twice, flatten
from tourgen.stages.packing import laid_out

if TYPE_CHECKING:
    from tourgen.geometry import Float64
    from tourgen.stages.charts import Bool, Int64

VERSION = 4

_THIN = 2e-3  # texels; a thinner face is drawn as nothing
_JOIN_ROUNDS = 3
_LEAST_AREA = 0.1  # of a face, as drawn, for a crumb to stay joined
_MAX_TEXTURE = 4096
_COARSER = 1.2


@dataclass(frozen=True, slots=True)
class Settings:
    """How a tile is unwrapped.

    Attributes:
        texel_m: Edge of a texel on the surface.
        padding_texels: Between any two charts, at least.
        min_chart_faces: A chart of fewer joins a neighbour, where one looks about its way.
    """

    texel_m: float = 0.004
    padding_texels: int = 2
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
    vertices = mesh.vertices.astype(np.float64)
    thick = _thick(vertices[mesh.faces], settings.texel_m)
    charts = _charts(vertices, mesh.faces[thick].astype(np.int64), settings)
    while True:
        unwrapped = _packed(mesh, charts, thick, settings)
        width, height = unwrapped.texture_size
        if max(width, height) > _MAX_TEXTURE:
            return unwrap(mesh, replace(settings, texel_m=settings.texel_m * _COARSER))
        corners = unwrapped.uv.astype(np.float64)[unwrapped.mesh.faces[thick]] * (width, height)
        twice = drawn_twice(corners, width, height)
        if not twice.any():
            return unwrapped
        charts = _mended(replace(charts, bad=twice))


def _thick(corners: Float64, texel_m: float) -> Bool:
    """(f,) faces that any texel could show."""
    edges = np.roll(corners, -1, 1) - corners
    longest = np.linalg.norm(edges, axis=2).max(1)
    double_areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return np.asarray(double_areas > _THIN * texel_m * np.maximum(longest, _THIN * texel_m))


@dataclass(frozen=True, slots=True)
class _Charts:
    """A tile's faces, drawn.

    Attributes:
        tile: Measured faces.
        faces: (f, 3) their vertices.
        texel_m: Edge of a texel.
        chart: (f,) numbered from 0.
        corners: (f, 3, 2) texels, each chart in a plane of its own, from (0, 0).
        bad: (f,) which faces cannot stay as they are drawn.
    """

    tile: Topology
    faces: Int64
    texel_m: float
    chart: Int64
    corners: Float64
    bad: Bool


def _charts(vertices: Float64, faces: Int64, settings: Settings) -> _Charts:
    """Segment, flatten, cut what folds, join what is small."""
    count = len(faces)
    tile = topology(vertices, faces)
    empty = np.zeros(count, np.int64), np.zeros((count, 3, 2)), np.zeros(count, bool)
    charts = _Charts(tile, faces, settings.texel_m, *empty)
    if not count:
        return charts
    segments = segment(tile, settings.min_chart_faces)
    charts = _mended(_redrawn(charts, segments, np.arange(count)))
    return _joined(charts, settings.min_chart_faces)


def _redrawn(charts: _Charts, chart: Int64, some: Int64) -> _Charts:
    """Flatten the charts of some faces, and keep the others as drawn."""
    corners, bad = charts.corners.copy(), np.zeros(len(chart), bool)
    corners[some], bad[some] = flatten(charts.tile, charts.faces, chart, some, charts.texel_m)
    return replace(charts, chart=chart, corners=corners, bad=bad)


def _mended(charts: _Charts) -> _Charts:
    """Cut until no chart folds; a round only cuts, and a face alone cannot fold: it ends."""
    while charts.bad.any():
        broken = np.isin(charts.chart, charts.chart[charts.bad])
        chart = cut(charts.tile, charts.chart, charts.bad)
        charts = _redrawn(charts, chart, np.flatnonzero(broken))
    return charts


def _joined(charts: _Charts, least_faces: int) -> _Charts:
    """Join small charts to a neighbour; those that then fold stay apart."""
    tile, apart = charts.tile, charts.chart
    size = np.bincount(apart)[apart]
    group = merge_small(tile, apart, tile.normals, least_faces, -1.0)
    drawn = charts.corners.copy()
    settled = np.bincount(group)[group] == size
    for _ in range(_JOIN_ROUNDS):
        if settled.all():
            break
        tried = _redrawn(charts, group, np.flatnonzero(~settled))
        failed = np.isin(group, group[tried.bad])
        passed = ~settled & ~failed
        drawn[passed] = tried.corners[passed]
        # The largest of a group stays; of the others, those that hold a bad face leave it.
        largest = np.zeros(int(group.max()) + 1, np.int64)
        np.maximum.at(largest, group, size)
        leaving = failed & np.isin(apart, apart[tried.bad]) & (size < largest[group])
        stuck = failed & ~np.isin(group, group[leaving])
        settled |= passed
        group = components(tile, np.where(leaving | stuck, apart + len(largest), group))
        settled |= np.bincount(group)[group] == size
    group = numbered(np.where(settled, group, apart + int(group.max()) + 1))
    return replace(charts, chart=group, corners=drawn)


def _packed(mesh: Mesh, charts: _Charts, thick: Bool, settings: Settings) -> UvMesh:
    """Lay the charts into one picture; what no texel could show shares one place in it."""
    count = int(charts.chart.max(initial=-1)) + 1
    chart = np.full(len(thick), count)
    chart[thick] = charts.chart
    corners = np.full((len(thick), 3, 2), 0.5)
    corners[thick] = charts.corners
    key, first, faces = np.unique(
        chart[:, None] * len(mesh.vertices) + mesh.faces, return_index=True, return_inverse=True
    )
    faces = faces.reshape(-1, 3)
    flat = corners.reshape(-1, 2)[first]
    owner = (key // len(mesh.vertices)).astype(np.int64)
    shown = np.where(thick[:, None], faces, -1)
    width, height, placed = laid_out(_standing(flat, owner), owner, shown, settings.padding_texels)
    return UvMesh(
        Mesh(mesh.origin, mesh.vertices[key % len(mesh.vertices)], faces.astype(np.int32)),
        (placed / (width, height)).astype(np.float32),
        chart.astype(np.int32),
        (width, height),
        settings.texel_m,
    )


def _standing(flat: Float64, owner: Int64) -> Float64:
    """(u, 2) the charts, those that lie set upright: so they fill more of a picture."""
    _, high = boxes(flat, owner)
    quarter = np.stack([high[owner, 1] - flat[:, 1], flat[:, 0]], axis=1)
    return np.where((high[:, 0] > high[:, 1])[owner, None], quarter, flat)
