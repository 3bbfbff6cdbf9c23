"""Bake: colour each texel of a tile's picture from the points of the scan.

A texel takes the blend of the points about its place on the surface that look its way. The
blend depends on the place alone, not on the chart or tile that the texel lies in, so colours
run through seams. Points are averaged in cells that double in size from level to level: a
coarse tile reads the level that fits its texels, which keeps it free of aliasing, and a texel
that no scan supports reads the first coarser level that has something to tell, so that holes
take the colours about them, across charts and tiles alike.

A million texels take 2 to 3 s on one busy core. Tried and rejected: a neighbour search and a
dense blend at each texel instead of one search for every 2 x 2 of a chart, 3.5 s; filling holes
inside the picture, which shows each chart's and each tile's border through the hole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.errors import StageError
from tourgen.geometry import (
    Float32,
    Float64,
    Int32,
    OrientedCloud,
    PointCloud,
    TexturedMesh,
    UInt8,
    UvMesh,
)
from tourgen.raster import rasterize

VERSION = 1

Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

_TOUCH = 0.71  # half a texel's diagonal: any texel touched at all
_LEAF_POINTS = 24
_LARGEST_CELL_M = 0.5
_FEWER = 0.7
_TEXELS_AT_ONCE = 100_000
_CELL_OF_TEXEL = 0.75  # a level's cells are at most so large
_SIGMA_OF_SPACING = 0.45  # narrow enough for letters a few points wide
_SIGMA_OF_TEXEL = 0.4
_REACH_OF_SPACING = 3.0  # of a level's cells


@dataclass(frozen=True, slots=True)
class Settings:
    """How colours are read.

    Attributes:
        neighbours: Points that a texel blends at most.
        agree_cos: A point counts where its normal and the surface's enclose less than this.
        reach_m: Where the nearest point is farther along the surface, or than a few times the
            spacing of the level, the texel has no support.
    """

    neighbours: int = 8
    agree_cos: float = 0.3
    reach_m: float = 0.03


@dataclass(frozen=True, slots=True)
class _Level:
    """Points averaged in cells.

    Attributes:
        cell_m: Edge of a cell.
        tree: Over ``points``.
        points: (n, 3) float32.
        normals: (n, 3) float32, unit.
        colors: (n, 3) uint8.
    """

    cell_m: float
    tree: cKDTree
    points: Float32
    normals: Float32
    colors: UInt8


@dataclass(frozen=True, slots=True)
class ColorIndex:
    """The colours of a room, to be looked up by place; made once, shared by the room's tiles.

    Attributes:
        levels: From the finest to the coarsest.
    """

    levels: tuple[_Level, ...]


def color_index(cloud: PointCloud, oriented: OrientedCloud, finest_texel_m: float) -> ColorIndex:
    """Average the full cloud in cells, from half the finest texel up to half a metre.

    Args:
        cloud: Every point kept by cleaning; n points.
        oriented: The points with normals; each point of ``cloud`` takes the nearest one's.
        finest_texel_m: Detail below half of it is averaged away.

    Returns:
        An index of about 90 bytes a cell of the finest level.

    Raises:
        StageError: Where either cloud is empty.
    """
    if not len(cloud) or not len(oriented.cloud):
        raise StageError("bake: expected a cloud of at least 1 point, found 0")
    cell_m = finest_texel_m / 2
    points, colors = _averaged(
        cloud.points, np.zeros(len(cloud), np.int64), cell_m, cloud.points, cloud.colors
    )
    nearest = cKDTree(oriented.cloud.points, leafsize=_LEAF_POINTS).query(points)[1]
    normals = oriented.normals[nearest]
    levels = [_level(cell_m, points, normals, colors)]
    while cell_m < _LARGEST_CELL_M:
        cell_m *= 2
        fewer = _averaged(points, _facing(normals), cell_m, points, normals, colors)
        if len(fewer[0]) > _FEWER * len(points) and cell_m < _LARGEST_CELL_M:
            continue  # these cells hold about one point each: the finer level tells as much
        points, normals, colors = fewer[0], _unit(fewer[1]), fewer[2]
        levels.append(_level(cell_m, points, normals, colors))
    return ColorIndex(tuple(levels))


def _level(cell_m: float, points: Float32, normals: Float32, colors: Float32) -> _Level:
    tree = cKDTree(points, leafsize=_LEAF_POINTS, balanced_tree=False)
    return _Level(cell_m, tree, points, normals, _bytes(colors))


def _averaged(
    points: Float32, kind: Int64, cell_m: float, *values: npt.NDArray[np.generic]
) -> tuple[Float32, ...]:
    """The mean of each value over the points of one cell and one kind."""
    cells = np.floor((points - points.min(0)) / cell_m).astype(np.int64)
    span = cells.max(0) + 1
    key = ((cells[:, 0] * span[1] + cells[:, 1]) * span[2] + cells[:, 2]) * 6 + kind
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    counts = np.diff(starts, append=len(key)).astype(np.float32)[:, None]
    return tuple(
        (np.add.reduceat(value[order].astype(np.float32), starts, axis=0) / counts).astype(
            np.float32
        )
        for value in values
    )


def _facing(normals: Float32) -> Int64:
    """Which of six sides of a cube a normal leaves by, so that two sides of a board stay two."""
    axis = np.abs(normals).argmax(1).astype(np.int64)
    return np.asarray(axis * 2 + (np.take_along_axis(normals, axis[:, None], 1)[:, 0] < 0))


def _unit(vectors: Float32) -> Float32:
    lengths = np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    return np.asarray(vectors / lengths, np.float32)


def _bytes(colors: npt.NDArray[np.floating]) -> UInt8:
    rounded: UInt8 = np.clip(np.rint(colors), 0, 255).astype(np.uint8)
    return rounded


def bake(uv_mesh: UvMesh, index: ColorIndex, settings: Settings) -> TexturedMesh:
    """Colour every texel that a face touches, and run the colours out over the rest.

    Args:
        uv_mesh: A tile.
        index: Of the tile's room.
        settings: See there.

    Returns:
        The tile with its picture; the background holds the colours of the nearest charts at
        every scale, so that no mip level shows another one.
    """
    width, height = uv_mesh.texture_size
    texels = _texels(uv_mesh)
    first = 0
    while (
        first + 1 < len(index.levels)
        and index.levels[first + 1].cell_m <= _CELL_OF_TEXEL * uv_mesh.texel_m
    ):
        first += 1
    colors = np.zeros((len(texels.row), 3), np.float32)
    left = np.arange(len(texels.row))
    for level in index.levels[first:]:
        colors[left], known = _blend(texels, left, level, uv_mesh.texel_m, settings)
        left = left[~known]
        if not len(left):
            break
    picture = np.zeros((height, width, 3), np.float32)
    covered = np.zeros((height, width), np.float32)
    picture[texels.row, texels.column] = colors
    covered[texels.row, texels.column] = 1
    return TexturedMesh(uv_mesh, _bytes(_spread(picture, covered)))


@dataclass(frozen=True, slots=True)
class _Texels:
    """Texels on the surface: t of them, in b blocks of up to 2 x 2 of one chart.

    Attributes:
        row: (t,)
        column: (t,)
        block: (t,)
        positions: (t, 3) metres.
        middles: (b, 3) mean position of each block.
        normals: (b, 3) unit.
    """

    row: Int64
    column: Int64
    block: Int64
    positions: Float32
    middles: Float64
    normals: Float32


def _texels(uv_mesh: UvMesh) -> _Texels:
    """Every texel that a face touches, once: the face that it lies deepest in says where."""
    width, height = uv_mesh.texture_size
    mesh = uv_mesh.mesh
    corners = uv_mesh.uv.astype(np.float64)[mesh.faces] * (width, height)
    hits = rasterize(corners, width, height, reach=_TOUCH)
    place = hits.row.astype(np.int64) * width + hits.column
    depth = hits.barycentric.min(1)
    outside = np.flatnonzero(depth < 0)
    outside = outside[np.argsort(depth[outside], kind="stable")]
    best = np.full(width * height, -1)
    best[place[outside]] = outside
    inside = np.flatnonzero(depth >= 0)
    best[place[inside]] = inside
    chosen = best[best >= 0]
    face, row, column = hits.face[chosen], hits.row[chosen], hits.column[chosen]
    share = np.maximum(hits.barycentric[chosen], 0)
    share /= share.sum(1, keepdims=True)
    at = mesh.faces[face]
    positions = _mixed(share, mesh.vertices, at)
    block_rows, block_columns = (height + 1) // 2, (width + 1) // 2
    key = (uv_mesh.chart[face].astype(np.int64) * block_rows + row // 2) * block_columns
    _, first, block, sizes = np.unique(
        key + column // 2, return_index=True, return_inverse=True, return_counts=True
    )
    sums = [np.bincount(block, axis, len(first)) for axis in positions.T]
    return _Texels(
        row.astype(np.int64),
        column.astype(np.int64),
        block.astype(np.int64),
        positions,
        np.stack(sums, axis=1) / sizes[:, None],
        _unit(_mixed(share[first], _vertex_normals(uv_mesh), at[first])),
    )


def _mixed(share: Float32, values: Float32, at: Int32) -> Float32:
    """The values at three corners, by their shares."""
    mixed: Float32 = share[:, :1] * values[at[:, 0]]
    for corner in (1, 2):
        mixed += share[:, corner : corner + 1] * values[at[:, corner]]
    return mixed


def _vertex_normals(uv_mesh: UvMesh) -> Float32:
    """(v, 3) mean normal of the faces about each place, across chart borders too."""
    mesh = uv_mesh.mesh
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    place = place.ravel()
    at = place[mesh.faces].ravel()
    sums = np.stack([np.bincount(at, np.repeat(cross[:, i], 3)) for i in range(3)], axis=1)
    return _unit(sums[place].astype(np.float32))


@dataclass(frozen=True, slots=True)
class _Nearby:
    """The k points about each of b blocks, seen in the plane of the block.

    Attributes:
        x: (k, b) along the surface from the block's middle, metres.
        y: (k, b)
        off: (k, b) squared distance beyond noise off the surface; infinite for a point that
            looks another way than the block.
        colors: (3, k, b) float32.
        sigma_m: (b,) width of the blend.
        alone: (b,) no point looks the block's way; all were taken instead.
    """

    x: Float32
    y: Float32
    off: Float32
    colors: Float32
    sigma_m: Float32
    alone: Bool


def _nearby(
    middles: Float64, normals: Float32, level: _Level, texel_m: float, settings: Settings
) -> _Nearby:
    count = min(settings.neighbours, len(level.points))
    distance, near = (
        np.asarray(found).T for found in level.tree.query(middles, k=np.arange(1, count + 1))
    )
    # ``count`` points lie in a disc of that radius.
    spacing = distance[-1] * np.sqrt(np.pi / count)
    sigma = np.maximum(spacing * _SIGMA_OF_SPACING, _SIGMA_OF_TEXEL * texel_m).astype(np.float32)
    right, up = _frames(normals)
    offset = level.points[near] - middles.astype(np.float32)
    x, y, above = (np.einsum("kbx,bx->kb", offset, axis) for axis in (right, up, normals))
    # Noise lifts points off the surface: what counts is the distance along it, unless a point
    # is off by more than noise.
    off = np.maximum(np.abs(above) - sigma, 0) ** 2
    agrees = np.einsum("kbx,bx->kb", level.normals[near], normals) > settings.agree_cos
    alone = ~agrees.any(0)
    colors = np.stack([level.colors[near, i].astype(np.float32) for i in range(3)])
    off = np.where(agrees | alone, off, np.float32(np.inf))
    return _Nearby(x, y, off, colors, sigma, alone)


def _frames(normals: Float32) -> tuple[Float32, Float32]:
    """Two unit vectors across each unit normal."""
    least = np.eye(3, dtype=np.float32)[np.abs(normals).argmin(1)]
    right = _unit(np.cross(least, normals))
    return right, np.cross(normals, right)


def _blend(
    texels: _Texels, which: Int64, level: _Level, texel_m: float, settings: Settings
) -> tuple[Float32, Bool]:
    """(n, 3) colours of n texels from one level, and (n,) whether the level supports them."""
    blocks, block = np.unique(texels.block[which], return_inverse=True)
    normals = texels.normals[blocks]
    middles = texels.middles[blocks]
    right, up = _frames(normals)
    offset = texels.positions[which] - middles.astype(np.float32)[block]
    x = np.einsum("tx,tx->t", offset, right[block])
    y = np.einsum("tx,tx->t", offset, up[block])
    reach_m = max(settings.reach_m, _REACH_OF_SPACING * level.cell_m)
    colors = np.empty((len(which), 3), np.float32)
    known = np.empty(len(which), bool)
    nearby = _nearby(middles, normals, level, texel_m, settings)
    for start in range(0, len(which), _TEXELS_AT_ONCE):
        part = slice(start, start + _TEXELS_AT_ONCE)
        of = block[part]
        far = (nearby.x[:, of] - x[part]) ** 2
        far += (nearby.y[:, of] - y[part]) ** 2
        far += nearby.off[:, of]
        nearest = far.min(0)
        known[part] = (nearest <= reach_m**2) & ~nearby.alone[of]
        weight = np.exp((nearest - far) / (2 * nearby.sigma_m[of] ** 2))
        total = weight.sum(0)
        for i in range(3):
            colors[part, i] = (weight * nearby.colors[i][:, of]).sum(0) / total
    return colors, known


def _spread(picture: Float32, covered: Float32) -> Float32:
    """Fill what is not covered from what is, by halving the picture until all is known.

    Gortler, Grzeszczuk, Szeliski, Cohen: The lumigraph, 1996, section 3.4 (pull and push).
    """
    if covered.min() > 0 or covered.max() <= 0:
        return picture
    height, width = covered.shape
    pad = ((0, height % 2), (0, width % 2))
    weight = np.pad(covered, pad)
    value = np.pad(picture * covered[..., None], (*pad, (0, 0)))
    weights = weight.reshape(weight.shape[0] // 2, 2, -1, 2).sum((1, 3))
    values = value.reshape(value.shape[0] // 2, 2, -1, 2, 3).sum((1, 3))
    half = values / np.maximum(weights, 1e-12)[..., None]
    coarse = _spread(half, np.minimum(weights, 1))
    fine = _doubled(coarse)[:height, :width]
    return picture * covered[..., None] + fine * (1 - covered[..., None])


def _doubled(picture: Float32) -> Float32:
    """Twice the size, blended between centres."""
    for axis in (0, 1):
        size = picture.shape[axis]
        before = picture.take(np.maximum(np.arange(size) - 1, 0), axis)
        after = picture.take(np.minimum(np.arange(size) + 1, size - 1), axis)
        pair = np.stack([0.75 * picture + 0.25 * before, 0.75 * picture + 0.25 * after], axis + 1)
        shape = list(picture.shape)
        shape[axis] *= 2
        picture = pair.reshape(shape)
    return picture
