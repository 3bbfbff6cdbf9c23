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

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.errors import StageError
from tourgen.geometry import Float32, OrientedCloud, PointCloud, UInt8
from tourgen.neighbours import Grid, Neighbours, nearest_to
from tourgen.stages.bake.texels import Texels, to_bytes, unit
from tourgen.threads import in_parts
from tourgen.voxels import grouped, means, voxels

Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

_LARGEST_CELL_M = 0.5
_FEWER = 0.7
_BLOCKS_AT_ONCE = 1 << 12
_ABOUT = 16
"""Points that cells of an index are made for."""
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
        around: The n points.
        normals: (n, 3) float32, unit, as ``around`` sorts its points.
        colors: (n, 3) uint8, likewise.
    """

    cell_m: float
    around: Neighbours
    normals: Float32
    colors: UInt8

    @property
    def points(self) -> Float32:
        """(n, 3) float32, metres."""
        return self.around.points


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
        An index of about 45 bytes a cell of the finest level.

    Raises:
        StageError: Where either cloud is empty.
    """
    if not len(cloud) or not len(oriented.cloud):
        raise StageError("bake: expected a cloud of at least 1 point, found 0")
    cell_m = finest_texel_m / 2
    points, normals, colors = _first_cells(cloud, oriented, cell_m)
    levels = [_level(cell_m, points, normals, colors)]
    while cell_m < _LARGEST_CELL_M:
        cell_m *= 2
        fewer = _averaged(points, normals, colors, cell_m)
        if len(fewer[0]) > _FEWER * len(points) and cell_m < _LARGEST_CELL_M:
            continue  # these cells hold about one point each: the finer level tells as much
        points, normals, colors = fewer
        levels.append(_level(cell_m, points, normals, colors))
    return ColorIndex(tuple(levels))


def _normals(cloud: PointCloud, oriented: OrientedCloud) -> Float32:
    """(n, 3) for each point the normal of the nearest one of its own station, if any is near.

    A station sees one side of a thin board: the nearest of all may lie on the other.
    """
    points, station = oriented.cloud.points, oriented.cloud.station
    count = min(_NORMALS_NEAR, len(points))
    around = Neighbours.of(points, count)
    nearest = around.nearest(cloud.points, 1)[0][:, 0]
    others = np.flatnonzero(station[nearest] != cloud.station)
    near = around.nearest(cloud.points[others], count)[0]
    first = (station[near] == cloud.station[others, None]).argmax(1)[:, None]
    nearest[others] = np.take_along_axis(near, first, 1)[:, 0]
    normals: Float32 = oriented.normals[nearest]
    return normals


def _level(cell_m: float, points: Float32, normals: Float32, colors: Float32) -> Level:
    around = Neighbours.of(points, _ABOUT)
    order = around.number
    return Level(cell_m, around, normals[order], to_bytes(colors[order]))


def _first_cells(
    cloud: PointCloud, oriented: OrientedCloud, cell_m: float
) -> tuple[Float32, Float32, Float32]:
    """See ``_averaged``; apart, so that the points' own normals are gone when levels follow."""
    return _averaged(cloud.points, _normals(cloud, oriented), cloud.colors, cell_m)


def _averaged(
    points: Float32, normals: Float32, colors: npt.NDArray[np.generic], cell_m: float
) -> tuple[Float32, Float32, Float32]:
    """Mean point, unit normal and colour of the points of each cell that face the same way."""
    key, _ = voxels(points, cell_m)
    _face(normals, key)
    order, starts = grouped(key)
    del key
    return (
        means(points, order, starts),
        unit(means(normals, order, starts)),
        means(colors, order, starts),
    )


@compiled
def _face(normals: Float32, key: Int64) -> None:
    """Put into each key by which of six sides of a cube a normal leaves: boards have two sides."""
    for i in range(len(key)):
        x, y, z = abs(normals[i, 0]), abs(normals[i, 1]), abs(normals[i, 2])
        axis = 0 if x >= y and x >= z else 1 if y >= z else 2
        key[i] = 6 * key[i] + 2 * axis + (1 if normals[i, axis] < 0 else 0)


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


class _Lengths(NamedTuple):
    """What the blend of a level goes by, metres."""

    texel_m: np.float32
    reach_m: np.float32
    agree_cos: np.float32


class _Blocks(NamedTuple):
    """Blocks of texels, and the texels of each.

    Attributes:
        middles: (b, 3)
        normals: (b, 3)
        starts: (b + 1,) where each block's texels begin in ``texel``.
        texel: (t,) numbers of texels.
    """

    middles: Float32
    normals: Float32
    starts: Int64
    texel: Int64


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
    numbers, block, sizes = np.unique(texels.block[which], return_inverse=True, return_counts=True)
    blocks = _Blocks(
        texels.middles[numbers].astype(np.float32),
        np.ascontiguousarray(texels.normals[numbers], np.float32),
        np.concatenate([[0], np.cumsum(sizes)]),
        which[np.argsort(block, kind="stable")],
    )
    reach_m = max(settings.reach_m, _REACH_OF_SPACING * level.cell_m)
    lengths = _Lengths(*map(np.float32, (texel_m, reach_m, settings.agree_cos)))
    count = min(settings.neighbours, len(level.around))
    known = np.zeros(len(texels.row), np.bool_)

    def blend(first: int, last: int) -> None:
        _blend_blocks(
            first,
            last,
            count,
            level.around.grid,
            level.normals,
            level.colors,
            blocks,
            texels.positions,
            others,
            lengths,
            known,
            (told.colors, told.mass, told.sigma_m),
        )

    in_parts(blend, len(numbers), _BLOCKS_AT_ONCE)
    return known[which]


@compiled
def _blend_blocks(
    first: int,
    last: int,
    count: int,
    grid: Grid,
    normals: Float32,
    colors: UInt8,
    blocks: _Blocks,
    positions: Float32,
    others: Float32,
    lengths: _Lengths,
    known: Bool,
    told: tuple[Float32, Float32, Float32],
) -> None:
    """Blend the points about each of some blocks, seen in its plane, at its texels."""
    points = grid[0]
    index, square = np.empty(count, np.int32), np.empty(count, np.float32)
    x, y, off, weight = np.empty((4, count), np.float32)
    shade = np.empty((count, 3), np.float32)
    frame, metric = np.empty((2, 3), np.float32), np.empty(3, np.float32)
    reach2 = lengths.reach_m * lengths.reach_m
    finest = np.float32(_SIGMA_OF_TEXEL) * lengths.texel_m
    several = min(_SPACING_POINTS, count)
    for block in range(first, last):
        middle, normal = blocks.middles[block], blocks.normals[block]
        nearest_to(
            grid,
            middle[0],
            middle[1],
            middle[2],
            np.float32(np.inf),
            np.float32(np.inf),
            index,
            square,
        )
        # So many points lie in a disc of that radius.
        spacing_m = np.sqrt(square[several - 1] * np.float32(np.pi / several))
        spacing_m = max(spacing_m, np.float32(1e-6))
        noise_m = max(spacing_m * np.float32(_SIGMA_OF_SPACING), finest)
        _across(normal, frame)
        alone = True
        for k in range(count):
            j = index[k]
            alike = np.float32(0)
            for i in range(3):
                alike += normals[j, i] * normal[i]
            if alike > lengths.agree_cos:
                alone = False
        for k in range(count):
            j = index[k]
            right = up = above = alike = np.float32(0)
            for i in range(3):
                offset = points[j, i] - middle[i]
                right += offset * frame[0, i]
                up += offset * frame[1, i]
                above += offset * normal[i]
                alike += normals[j, i] * normal[i]
                shade[k, i] = colors[j, i]
            x[k], y[k] = right, up
            # Noise lifts points off the surface: what counts is the distance along it, unless a
            # point is off by more than noise, or looks another way.
            beyond = max(abs(above) - noise_m, np.float32(0))
            off[k] = beyond * beyond if alone or alike > lengths.agree_cos else np.inf
        _steer(x, y, off, shade, spacing_m, metric)
        for texel in blocks.texel[blocks.starts[block] : blocks.starts[block + 1]]:
            at_x = at_y = np.float32(0)
            for i in range(3):
                offset = positions[texel, i] - middle[i]
                at_x += offset * frame[0, i]
                at_y += offset * frame[1, i]
            near = nearest = np.float32(np.inf)
            for k in range(count):
                along, across = x[k] - at_x, y[k] - at_y
                near = min(near, along * along + across * across + off[k])
                weight[k] = metric[0] * along * along + 2 * metric[1] * along * across
                weight[k] += metric[2] * across * across + off[k]
                nearest = min(nearest, weight[k])
            known[texel] = near <= reach2 and not alone
            density = 1 / (spacing_m * spacing_m) + others[texel]
            sigma = max(np.float32(_SIGMA_OF_SPACING) / np.sqrt(density), finest)
            half = 1 / (2 * sigma * sigma)
            total = red = green = blue = np.float32(0)
            for k in range(count):
                w = np.exp((nearest - weight[k]) * half)
                total += w
                red += w * shade[k, 0]
                green += w * shade[k, 1]
                blue += w * shade[k, 2]
            told[0][texel, 0] = red / total
            told[0][texel, 1] = green / total
            told[0][texel, 2] = blue / total
            told[1][texel] = total * np.exp(-nearest * half)
            told[2][texel] = sigma


@compiled
def _across(normal: Float32, frame: Float32) -> None:
    """Write two unit vectors across a unit normal; none where faces' normals cancel."""
    least = np.argmin(np.abs(normal))
    one, other = (least + 1) % 3, (least + 2) % 3
    length = max(np.sqrt(normal[one] ** 2 + normal[other] ** 2), np.float32(1e-12))
    frame[0, least] = 0
    frame[0, one], frame[0, other] = -normal[other] / length, normal[one] / length
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        frame[1, i] = normal[a] * frame[0, b] - normal[b] * frame[0, a]


@compiled
def _steer(
    x: Float32, y: Float32, off: Float32, shade: Float32, spacing_m: np.float32, metric: Float32
) -> None:
    """Write how to square distances among points: long along edges of colour; xx, xy and yy.

    From the structure tensor: the mean square of the slopes between any two points, in their
    direction.
    """
    least = (np.float32(_PAIR_OF_SPACING) * spacing_m) ** 2
    xx = xy = yy = np.float32(0)
    total = np.float32(1e-6)
    for one in range(len(x)):
        if off[one] > 0:
            continue
        for other in range(one + 1, len(x)):
            if off[other] > 0:
                continue
            across, along = x[one] - x[other], y[one] - y[other]
            step = np.float32(0)
            for i in range(3):
                step += (shade[one, i] - shade[other, i]) ** 2
            weight = 1 / (across * across + along * along + least)
            slope = weight * weight * step
            xx += slope * across * across
            xy += slope * across * along
            yy += slope * along * along
            total += weight
    xx, xy, yy = xx / total, xy / total, yy / total
    middle = (xx + yy) / 2 + np.float32(_COLOR_NOISE * _COLOR_NOISE)
    spread = np.sqrt(((xx - yy) / 2) ** 2 + xy * xy)
    most = (middle + spread) / max(middle - spread, np.float32(1))
    steered = min(most, np.float32(_MOST_STEERED))
    angle = np.arctan2(2 * xy, xx - yy)
    even, odd = (steered + 1 / steered) / 2, (steered - 1 / steered) / 2
    metric[0], metric[2] = even + odd * np.cos(angle), even - odd * np.cos(angle)
    metric[1] = odd * np.sin(angle)
