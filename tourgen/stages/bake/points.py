"""The colours of points, averaged in cells that double in size, and blended at texels.

The bell of the blend is steered: long along the edges of inlays and letters, narrow across them
(Takeda, Farsiu, Milanfar: Kernel regression for image processing and reconstruction, 2007,
section III-B), so that they come out straight where a round bell shows every point as a tooth.

What limits the picture is the points' spacing: at 11 mm, on the demo's first chamber with inlays
of some millimetres, the truth's own colours in place of the scanned ones gain 0.07 dB, texels half
as large again 0.03 dB. Over 700,000 texels there:

    round bell of 0.5 of the spacing, 8 points        23.46 dB, 1.0 of the time
    steered, 0.5, 12 or 16 points                     23.53, 23.61 dB, 1.4, 1.7
    steered, 0.55, 16 points (this one)               23.64 dB, 1.7
    steered, 0.6, 16 or 24 points                     23.65, 23.62 dB (letters blur)

Earlier, over 5,000 pixels of ten views, round bells of 0.25, 0.35 and 0.6 of the spacing did
-0.6, -0.3 and +0.1 dB, local linear regression of 8, 12 and 16 neighbours +0.10, +0.15, +0.18.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tourgen.errors import StageError
from tourgen.geometry import Float32, Float64, OrientedCloud, PointCloud, UInt8
from tourgen.stages.bake.texels import Texels, to_bytes, unit

Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

_LEAF_POINTS = 24
_LARGEST_CELL_M = 0.5
_FEWER = 0.7
_TEXELS_AT_ONCE = 100_000
_POINTS_AT_ONCE = 500_000
_NORMALS_NEAR = 8
_CELL_OF_TEXEL = 0.75  # a level's cells are at most so large
_SIGMA_OF_SPACING = 0.55  # narrow enough for letters a few points wide
_SPACING_POINTS = 8  # nearer than the last of these tells the spacing
_MOST_STEERED = 4.0  # variance along an edge over that across
_COLOR_NOISE = 10.0  # a step between neighbours that is no edge
_PAIR_OF_SPACING = 0.3  # what is nearer together than this weighs no more
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

    neighbours: int = 16
    agree_cos: float = 0.3
    reach_m: float = 0.03


@dataclass(frozen=True, slots=True)
class Level:
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

    levels: tuple[Level, ...]


def color_index(cloud: PointCloud, oriented: OrientedCloud, finest_texel_m: float) -> ColorIndex:
    """Average the full cloud in cells, from half the finest texel up to half a metre.

    Args:
        cloud: Every point kept by cleaning; n points.
        oriented: The points with normals; each point of ``cloud`` takes that of the nearest one
            that its station saw.
        finest_texel_m: Detail below half of it is averaged away.

    Returns:
        An index of about 90 bytes a cell of the finest level.

    Raises:
        StageError: Where either cloud is empty.
    """
    if not len(cloud) or not len(oriented.cloud):
        raise StageError("bake: expected a cloud of at least 1 point, found 0")
    cell_m = finest_texel_m / 2
    own = _normals(cloud, oriented)
    points, normals, colors = _averaged(
        cloud.points, _facing(own), cell_m, cloud.points, own, cloud.colors
    )
    normals = unit(normals)
    levels = [_level(cell_m, points, normals, colors)]
    while cell_m < _LARGEST_CELL_M:
        cell_m *= 2
        fewer = _averaged(points, _facing(normals), cell_m, points, normals, colors)
        if len(fewer[0]) > _FEWER * len(points) and cell_m < _LARGEST_CELL_M:
            continue  # these cells hold about one point each: the finer level tells as much
        points, normals, colors = fewer[0], unit(fewer[1]), fewer[2]
        levels.append(_level(cell_m, points, normals, colors))
    return ColorIndex(tuple(levels))


def _normals(cloud: PointCloud, oriented: OrientedCloud) -> Float32:
    """(n, 3) for each point the normal of the nearest one of its own station, if any is near.

    A station sees one side of a thin board: the nearest of all may lie on the other.
    """
    tree = cKDTree(oriented.cloud.points, leafsize=_LEAF_POINTS)
    nearest = np.asarray(tree.query(cloud.points)[1], np.int64)
    station = oriented.cloud.station
    others = np.flatnonzero(station[nearest] != cloud.station)
    count = min(_NORMALS_NEAR, len(station))
    for start in range(0, len(others), _POINTS_AT_ONCE):
        some = others[start : start + _POINTS_AT_ONCE]
        near = tree.query(cloud.points[some], k=np.arange(1, count + 1))[1]
        first = (station[near] == cloud.station[some, None]).argmax(1)[:, None]
        nearest[some] = np.take_along_axis(near, first, 1)[:, 0]
    normals: Float32 = oriented.normals[nearest]
    return normals


def _level(cell_m: float, points: Float32, normals: Float32, colors: Float32) -> Level:
    tree = cKDTree(points, leafsize=_LEAF_POINTS, balanced_tree=False)
    return Level(cell_m, tree, points, normals, to_bytes(colors))


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


@dataclass(frozen=True, slots=True)
class Told:
    """What the points tell of n texels.

    Attributes:
        colors: (n, 3) float32.
        mass: (n,) float32, sum of the weights of the points blended, 1 for one at the very place.
        sigma_m: (n,) float32, width of the blend's bell.
    """

    colors: Float32
    mass: Float32
    sigma_m: Float32


def of_points(
    texels: Texels, index: ColorIndex, texel_m: float, settings: Settings, others: Float32
) -> Told:
    """What the points tell of the texels.

    Args:
        texels: n of them.
        index: Of their room.
        texel_m: Edge of a texel.
        settings: See there.
        others: (n,) samples of pictures on a square metre there: the denser all samples lie, the
            narrower the blend.
    """
    first = 0
    while (
        first + 1 < len(index.levels) and index.levels[first + 1].cell_m <= _CELL_OF_TEXEL * texel_m
    ):
        first += 1
    count = len(texels.row)
    told = Told(*(np.zeros((count, *shape), np.float32) for shape in ((3,), (), ())))
    left = np.arange(count)
    for level in index.levels[first:]:
        if not len(left):
            break
        known = _blend(texels, left, level, texel_m, settings, others, told)
        left = left[~known]
    return told


@dataclass(frozen=True, slots=True)
class _Nearby:
    """The k points about each of b blocks, seen in the plane of the block.

    Attributes:
        x: (k, b) along the surface from the block's middle, metres.
        y: (k, b)
        off: (k, b) squared distance beyond noise off the surface; infinite for a point that
            looks another way than the block.
        colors: (3, k, b) float32.
        spacing_m: (b,) of the points.
        metric: (3, b) how distances along the surface are squared, xx, xy and yy; determinant 1.
        alone: (b,) no point looks the block's way; all were taken instead.
    """

    x: Float32
    y: Float32
    off: Float32
    colors: Float32
    spacing_m: Float32
    metric: Float32
    alone: Bool


def _nearby(
    middles: Float64, normals: Float32, level: Level, texel_m: float, settings: Settings
) -> _Nearby:
    count = min(settings.neighbours, len(level.points))
    distance, near = (
        np.asarray(found).T for found in level.tree.query(middles, k=np.arange(1, count + 1))
    )
    # So many points lie in a disc of that radius.
    several = min(_SPACING_POINTS, count)
    spacing = distance[several - 1] * np.sqrt(np.pi / several)
    spacing = np.maximum(spacing, 1e-6).astype(np.float32)
    noise = np.maximum(spacing * _SIGMA_OF_SPACING, np.float32(_SIGMA_OF_TEXEL * texel_m))
    right, up = _frames(normals)
    offset = level.points[near] - middles.astype(np.float32)
    x, y, above = (np.einsum("kbx,bx->kb", offset, axis) for axis in (right, up, normals))
    # Noise lifts points off the surface: what counts is the distance along it, unless a point
    # is off by more than noise.
    off = np.maximum(np.abs(above) - noise, 0) ** 2
    agrees = np.einsum("kbx,bx->kb", level.normals[near], normals) > settings.agree_cos
    alone = ~agrees.any(0)
    colors = np.stack([level.colors[near, i].astype(np.float32) for i in range(3)])
    off = np.where(agrees | alone, off, np.float32(np.inf))
    metric = _metric(x, y, colors, off <= 0, spacing)
    return _Nearby(x, y, off, colors, spacing, metric, alone)


def _metric(x: Float32, y: Float32, colors: Float32, usable: Bool, spacing_m: Float32) -> Float32:
    """(3, b) how to square distances among k points of b blocks: long along edges of colour.

    From the structure tensor: the mean square of the slopes between any two points, in their
    direction.
    """
    tensor = np.zeros((3, len(spacing_m)), np.float32)
    total = np.full(len(spacing_m), np.float32(1e-6))
    least = np.square(_PAIR_OF_SPACING * spacing_m)
    for one, other in itertools.combinations(range(len(x)), 2):
        across, along = x[one] - x[other], y[one] - y[other]
        step = colors[:, one] - colors[:, other]
        weight = (usable[one] & usable[other]) / (across**2 + along**2 + least)
        slope = weight**2 * np.einsum("cb,cb->b", step, step)
        tensor += slope * np.stack([across * across, across * along, along * along])
        total += weight
    tensor /= total
    middle = (tensor[0] + tensor[2]) / 2 + np.float32(_COLOR_NOISE**2)
    spread = np.hypot((tensor[0] - tensor[2]) / 2, tensor[1])
    steered = np.minimum((middle + spread) / np.maximum(middle - spread, 1), _MOST_STEERED)
    angle = np.arctan2(2 * tensor[1], tensor[0] - tensor[2])
    even, odd = (steered + 1 / steered) / 2, (steered - 1 / steered) / 2
    turned = np.stack([even + odd * np.cos(angle), odd * np.sin(angle), even - odd * np.cos(angle)])
    return np.asarray(turned, np.float32)


def _frames(normals: Float32) -> tuple[Float32, Float32]:
    """Two unit vectors across each unit normal."""
    least = np.eye(3, dtype=np.float32)[np.abs(normals).argmin(1)]
    right = unit(np.cross(least, normals))
    return right, np.cross(normals, right)


def _blend(
    texels: Texels,
    which: Int64,
    level: Level,
    texel_m: float,
    settings: Settings,
    others: Float32,
    told: Told,
) -> Bool:
    """Write n texels' part of ``told`` from one level; (n,) whether the level supports them."""
    blocks, block = np.unique(texels.block[which], return_inverse=True)
    normals = texels.normals[blocks]
    middles = texels.middles[blocks]
    right, up = _frames(normals)
    offset = texels.positions[which] - middles.astype(np.float32)[block]
    x = np.einsum("tx,tx->t", offset, right[block])
    y = np.einsum("tx,tx->t", offset, up[block])
    reach_m = max(settings.reach_m, _REACH_OF_SPACING * level.cell_m)
    known = np.empty(len(which), bool)
    nearby = _nearby(middles, normals, level, texel_m, settings)
    for start in range(0, len(which), _TEXELS_AT_ONCE):
        part = slice(start, start + _TEXELS_AT_ONCE)
        of, to = block[part], which[part]
        along, across = nearby.x[:, of] - x[part], nearby.y[:, of] - y[part]
        off = nearby.off[:, of]
        known[part] = ((along**2 + across**2 + off).min(0) <= reach_m**2) & ~nearby.alone[of]
        xx, xy, yy = nearby.metric[:, of]
        far = xx * along**2 + 2 * xy * along * across + yy * across**2 + off
        nearest = far.min(0)
        density = 1 / nearby.spacing_m[of] ** 2 + others[to]
        sigma = np.maximum(_SIGMA_OF_SPACING / np.sqrt(density), _SIGMA_OF_TEXEL * texel_m)
        half = 1 / (2 * sigma**2)
        weight = np.exp((nearest - far) * half)
        total = weight.sum(0)
        for i in range(3):
            told.colors[to, i] = (weight * nearby.colors[i][:, of]).sum(0) / total
        told.mass[to] = total * np.exp(-nearest * half)
        told.sigma_m[to] = sigma
    return known
