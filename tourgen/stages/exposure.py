"""Exposure: bring the stations' gains and white balances into agreement.

Each station's camera chose its own exposure. A factor a station and channel explains that: values
of sRGB times a gain, which is what a factor on the light comes to under a power law. Small cells
of the room that two stations measured give a ratio each; their median is that pair's ratio, and
all pairs at once are solved for the gains by robust least squares (IRLS with Huber's weights; the
graph of pairs as in Brown and Lowe: Automatic panoramic image stitching, 2007, section 6). The
gauge is free: the gains' geometric mean is 1.

Where a channel is clipped a factor tells too little: what was clipped is as bright as other
stations saw it there or, where none did, nearest to there.

Tried and rejected: means instead of medians of the ratios: a passer-by and mixed pixels pull them
by 1 %; a curve instead of a factor, which the range of one room's tones does not fix.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from tourgen.geometry import Float32, Float64, PointCloud, UInt8
from tourgen.neighbours import Neighbours
from tourgen.stages import glare
from tourgen.stages.burnt import ends
from tourgen.stages.cells import cells_of

VERSION = 7

Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

_HUBER = 2.0  # standard errors
_ROUNDS = 20
_LEAST_ERROR = 5e-4  # of a pair's log ratio, however many cells tell it
_COMPARED = 8  # cells that tell what a camera clipped
_CLIPPED_SHARE = (0.1, 0.9)  # of a cell's points: below, it is not, above, it is


@dataclass(frozen=True, slots=True)
class Settings:
    """Which samples count.

    Attributes:
        cell_m: Edge of the cells in which two stations are compared.
        tones: Darkest and brightest value that a sample may have in any channel: below, rounding
            is coarse, above, the camera clips.
        cell_points: Fewest points of a station in a cell.
        pair_cells: Fewest cells that tell a pair's ratio.
        glare: How that is told.
    """

    cell_m: float = 0.04
    tones: tuple[int, int] = (20, 245)
    cell_points: int = 3
    pair_cells: int = 50
    glare: glare.Settings = field(default_factory=glare.Settings)


def exposure(cloud: PointCloud, stations: Float64, settings: Settings) -> PointCloud:
    """The points in colours of one exposure, without glare where another station tells better.

    Args:
        cloud: n points; those of unknown station (-1) share a gain of their own.
        stations: (s, 3) metres from the cloud's origin.
        settings: See there.

    Returns:
        The points in their order, less those in glare (``glare``). A cloud whose stations are
        unknown, or that comes from one station, is returned as it is.
    """
    count = len(stations)
    if count < 2 or not 0 <= cloud.station.max(initial=-1) < count:
        return cloud
    owner = np.where(cloud.station < 0, count, cloud.station).astype(np.int16)
    gain = gains(cloud.points, cloud.colors, owner, count + 1, settings)
    colors = np.empty_like(cloud.colors)
    for station in range(count + 1):
        own = owner == station
        table = np.clip(np.rint(np.arange(256)[:, None] / gain[station]), 0, 255).astype(np.uint8)
        colors[own] = np.stack([table[cloud.colors[own, k], k] for k in range(3)], axis=1)
    _raise_clipped(colors, cloud, owner, count + 1, settings)
    even = PointCloud(cloud.origin, cloud.points, colors, cloud.station)
    return glare.without_glare(even, cloud.colors, stations, settings.glare)


def _raise_clipped(
    colors: UInt8,
    cloud: PointCloud,
    owner: npt.NDArray[np.int16],
    count: int,
    settings: Settings,
) -> None:
    """Set clipped values to what other stations saw there, or nearest to there; in place.

    Args:
        colors: (n, 3) of one exposure.
        cloud: n points as measured.
        owner: (n,) 0 to ``count`` - 1.
        count: Of owners.
        settings: See there.
    """
    cells = cells_of(cloud.points, owner, count, settings.cell_m)
    means, middles = cells.means(colors), cells.means(cloud.points)
    firsts = np.flatnonzero(np.diff(cells.cell, prepend=-1))
    groups = np.diff(firsts, append=len(cells.cell))
    seldom, mostly = _CLIPPED_SHARE
    clipped = _clipped(cloud.colors, owner, count)
    shares = cells.means(clipped)
    for channel, share in enumerate(shares.T):
        tells = (share < seldom) & (cells.sizes >= settings.cell_points)
        sums = np.add.reduceat(np.where(tells, means[:, channel], 0), firsts)
        told = np.add.reduceat(tells.astype(float), firsts)
        there = np.repeat(sums / np.maximum(told, 1), groups)
        compared = (share > mostly) & (np.repeat(told, groups) > 0)
        for station in np.unique(cells.owner[compared]):
            of = compared & (cells.owner == station)
            if of.sum() >= settings.pair_cells:
                own = np.flatnonzero(clipped[:, channel] & (owner == station))
                compared_to = Neighbours.of(middles[of], _COMPARED)
                near, _ = compared_to.nearest(cloud.points[own], min(_COMPARED, len(compared_to)))
                value = np.clip(np.rint(np.median(there[of][near], axis=1)), 0, 255)
                colors[own, channel] = np.maximum(colors[own, channel], value)


def _clipped(colors: UInt8, owner: npt.NDArray[np.int16], count: int) -> Bool:
    """(n, 3) the values at the end of their station's channel, if it reaches far enough up."""
    highest = np.stack([ends(colors[owner == k]) for k in range(count)])
    return np.asarray(colors >= highest[owner])


def gains(
    points: Float32,
    colors: UInt8,
    station: npt.NDArray[np.int16],
    count: int,
    settings: Settings,
) -> Float64:
    """(s, 3) factor that each station's camera put on each channel.

    Args:
        points: (n, 3) metres.
        colors: (n, 3) sRGB.
        station: (n,) owner, 0 to s - 1.
        count: s
        settings: See there.

    Returns:
        Factors whose geometric mean is 1 over each set of stations that see common places.
    """
    dark, bright = settings.tones
    usable = (colors.min(1) >= dark) & (colors.max(1) <= bright)
    usable &= ~_clipped(colors, station, count).any(1)
    cells = cells_of(points[usable], station[usable], count, settings.cell_m)
    means = cells.means(colors[usable])
    keep = cells.sizes >= settings.cell_points
    cell, owner, shade = cells.cell[keep], cells.owner[keep], np.log(means[keep])
    left, right = [], []
    for ahead in range(1, count):  # groups of one cell follow one another
        first = np.flatnonzero(cell[ahead:] == cell[:-ahead])
        left.append(first)
        right.append(first + ahead)
    a, b = np.concatenate(left or [np.zeros(0, int)]), np.concatenate(right or [np.zeros(0, int)])
    ratio = shade[a] - shade[b]
    pairs, medians, errors = [], [], []
    key = owner[a] * count + owner[b]
    for each in np.unique(key):
        of = ratio[key == each]
        if len(of) < settings.pair_cells:
            continue
        median = np.median(of, axis=0)
        spread = 1.4826 * np.median(np.abs(of - median), axis=0)
        pairs.append(divmod(int(each), count))
        medians.append(median)
        errors.append(1.2533 * spread / np.sqrt(len(of)) + _LEAST_ERROR)
    if not pairs:
        return np.ones((count, 3))
    return solve_gains(np.array(pairs), np.array(medians), np.array(errors), count)


def solve_gains(pairs: Int64, log_ratio: Float64, error: Float64, count: int) -> Float64:
    """(s, 3) gains from ratios of pairs.

    Args:
        pairs: (p, 2) stations a and b.
        log_ratio: (p, 3) logarithm of a's values over b's.
        error: (p, 3) standard error of each.
        count: s
    """
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count))
    _, part = connected_components(graph, directed=False)
    gauge = (part[:, None] == np.unique(part)).T / np.bincount(part)[:, None]  # one row a part
    rows = np.arange(len(pairs))
    design = np.zeros((len(pairs), count))
    design[rows, pairs[:, 0]], design[rows, pairs[:, 1]] = 1, -1
    log_gain = np.zeros((count, 3))
    for channel in range(3):
        target, sigma = log_ratio[:, channel], error[:, channel]
        weight = np.ones(len(pairs))
        for _ in range(_ROUNDS):
            scale = np.sqrt(weight) / sigma
            system = np.concatenate([design * scale[:, None], gauge * scale.max()])
            wanted = np.concatenate([target * scale, np.zeros(len(gauge))])
            log_gain[:, channel] = np.linalg.lstsq(system, wanted, rcond=None)[0]
            off = np.abs(design @ log_gain[:, channel] - target) / sigma
            weight = np.minimum(1, _HUBER / np.maximum(off, 1e-12))
    return np.asarray(np.exp(log_gain))
