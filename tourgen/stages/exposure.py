"""Exposure: bring the stations' gains and white balances into agreement, and drop glare.

Each station's camera chose its own exposure. A factor a station and channel explains that: values
of sRGB times a gain, which is what a factor on the light comes to under a power law. Small cells
of the room that two stations measured give a ratio each; their median is that pair's ratio, and
all pairs at once are solved for the gains by robust least squares (IRLS with Huber's weights; the
graph of pairs as in Brown and Lowe: Automatic panoramic image stitching, 2007, section 6). The
gauge is free: the gains' geometric mean is 1.

About a lamp a camera burns out, and its glare lies over what is near. Other stations see the same
lamp before other things, so that between them nearly all is told: points that lie about burnt-out
directions and are brighter than what another station saw at their place are dropped. By how much
they are brighter, degree by degree off the lamp, says where the rest is dazzled that no other
station saw: it takes the colours about it.

Tried and rejected: means instead of medians of the ratios: a passer-by and mixed pixels pull them
by 1 %; a curve instead of a factor, which the range of one room's tones does not fix.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64, PointCloud, UInt8
from tourgen.stages.burnt import burnt_out

VERSION = 2

Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]

_HUBER = 2.0  # standard errors
_ROUNDS = 20
_LEAST_ERROR = 5e-4  # of a pair's log ratio, however many cells tell it
_DIRECTION_DEG = 1.0
_TOUCHING_CELLS = 2.5
_SURROUNDING_POINTS = 16


@dataclass(frozen=True, slots=True)
class Settings:
    """Which samples count.

    Attributes:
        cell_m: Edge of the cells in which two stations are compared.
        tones: Darkest and brightest value that a sample may have in any channel: below, rounding
            is coarse, above, the camera clips.
        cell_points: Fewest points of a station in a cell.
        pair_cells: Fewest cells that tell a pair's ratio.
        glare_deg: How far glare reaches about a burnt-out direction.
        glare_cell_m: Edge of the cells in which glare is told.
        glare: How much brighter than another station's such a cell is, at the least.
        ring_cells: So many cells, at the least, tell the glare at one angle off a lamp.
        dazzled: How much brighter cells so far off the lamp have to be, in the middle, for those
            that no other station saw to take the colours about them.
        lamp_m: What two stations see burnt out so near to one another is a lamp.
    """

    cell_m: float = 0.04
    tones: tuple[int, int] = (20, 245)
    cell_points: int = 3
    pair_cells: int = 50
    glare_deg: float = 12.0
    glare_cell_m: float = 0.04
    glare: float = 3.0
    ring_cells: int = 10
    dazzled: float = 5.0
    lamp_m: float = 0.25


def exposure(cloud: PointCloud, stations: Float64, settings: Settings) -> PointCloud:
    """The points in colours of one exposure, without glare where another station tells better.

    Args:
        cloud: n points; those of unknown station (-1) share a gain of their own.
        stations: (s, 3) metres from the cloud's origin.
        settings: See there.

    Returns:
        The points in their order, less those in glare. A cloud whose stations are unknown, or
        that comes from one station, is returned as it is.
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
    even = PointCloud(cloud.origin, cloud.points, colors, cloud.station)
    burnt = _burnt(cloud, count)
    lamps = _near_lamps(even.points, burnt, cloud.station, settings)
    spots = _about_burnt(cloud, burnt, stations, settings)
    glared, dazzled = _glared(even, spots, lamps, settings)
    _take_surroundings(even, dazzled, ~(glared | dazzled))
    return even.take(~glared) if glared.any() else even


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
    cells = _cells(points[usable], station[usable], count, settings.cell_m)
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


@dataclass(frozen=True, slots=True)
class _Cells:
    """Points sorted into groups of one cell and one station, the groups of a cell in a row.

    Attributes:
        order: (n,) positions of the points, group after group.
        starts: (g,) where each group begins.
        sizes: (g,)
        cell: (g,) number of the group's cell.
        owner: (g,) its station.
    """

    order: Int64
    starts: Int64
    sizes: Int64
    cell: Int64
    owner: Int64

    def means(self, values: npt.NDArray[np.generic]) -> Float64:
        """(g, k) mean of (n, k) values by group."""
        columns = [
            np.add.reduceat(column[self.order].astype(np.float32), self.starts, dtype=np.float64)
            for column in values.T
        ]
        return np.stack(columns, axis=1) / self.sizes[:, None]

    def of_points(self, values: Bool) -> Bool:
        """(n,) each point's group's value."""
        spread = np.empty(len(self.order), bool)
        spread[self.order] = np.repeat(values, self.sizes)
        return spread


def _cells(points: Float32, owner: npt.NDArray[np.int16], count: int, cell_m: float) -> _Cells:
    if not len(points):
        none = np.zeros(0, np.int64)
        return _Cells(none, none, none, none, none)
    at = np.floor((points - points.min(0)) / cell_m).astype(np.int64)
    span = at.max(0) + 1
    key = ((at[:, 0] * span[1] + at[:, 1]) * span[2] + at[:, 2]) * count + owner
    order = np.argsort(key, kind="stable")
    key = key[order]
    starts = np.flatnonzero(np.diff(key, prepend=-1))
    cell, of = np.divmod(key[starts], count)
    return _Cells(order, starts, np.diff(starts, append=len(key)), cell, of)


def _burnt(cloud: PointCloud, count: int) -> Bool:
    """(n,) where a station's camera burnt out."""
    burnt = np.zeros(len(cloud), bool)
    for number in range(count):
        own = cloud.station == number
        burnt[own] = burnt_out(cloud.colors[own])
    return burnt


@dataclass(frozen=True, slots=True)
class _About:
    """Which burnt-out spot of its station's picture a point lies about.

    Attributes:
        spot: (n,) number, -1 for none. Directions that touch are one spot of one station.
        off_deg: (n,) angle to its middle, whole degrees.
    """

    spot: Int64
    off_deg: Int64


def _about_burnt(cloud: PointCloud, burnt: Bool, stations: Float64, settings: Settings) -> _About:
    about = _About(np.full(len(cloud), -1), np.zeros(len(cloud), np.int64))
    reach = 2 * np.sin(np.radians(settings.glare_deg) / 2) / np.radians(_DIRECTION_DEG)
    spots = 0
    for number, station in enumerate(stations):
        own = np.flatnonzero(cloud.station == number)
        if not burnt[own].any():
            continue
        way = cloud.points[own] - station.astype(np.float32)
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-6)
        steps = np.rint(way / np.radians(_DIRECTION_DEG)).astype(np.int64) + 128
        key, place = np.unique(
            (steps[:, 0] * 256 + steps[:, 1]) * 256 + steps[:, 2], return_inverse=True
        )
        cells = np.stack([key >> 16, key >> 8 & 255, key & 255], axis=1).astype(np.float32)
        seeds = cKDTree(cells[np.unique(place[burnt[own]])])
        _, nearest = seeds.query(cells, distance_upper_bound=reach)
        touching = seeds.sparse_distance_matrix(seeds, _TOUCHING_CELLS)
        found, spot = connected_components(touching, directed=False)
        spot_of = np.append(spot, -1)[nearest][place]
        middles = np.stack(
            [np.bincount(spot, axis, found) / np.bincount(spot) for axis in seeds.data.T - 128], 1
        )
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        cosine = (way * middles[spot_of].astype(np.float32)).sum(1)
        about.off_deg[own] = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        about.spot[own] = np.where(spot_of < 0, -1, spot_of + spots)
        spots += found
    return about


def _glared(cloud: PointCloud, burnt: _About, lamps: Bool, settings: Settings) -> tuple[Bool, Bool]:
    """(n,) points too bright for their place, and those that are it unseen by other stations."""
    glared, dazzled = np.zeros((2, len(cloud)), bool)
    near = burnt.spot >= 0
    if not near.any():
        return glared, dazzled
    low = cloud.points[near].min(0) - settings.glare_cell_m
    high = cloud.points[near].max(0) + settings.glare_cell_m
    about = (cloud.station >= 0) & ((cloud.points >= low) & (cloud.points <= high)).all(1)
    count = int(cloud.station.max()) + 1
    cells = _cells(cloud.points[about], cloud.station[about], count, settings.glare_cell_m)
    shade = cells.means(cloud.colors[about]).mean(1)
    enough = cells.sizes >= settings.cell_points
    firsts = np.flatnonzero(np.diff(cells.cell, prepend=-1))
    groups = np.diff(firsts, append=len(cells.cell))
    least = np.repeat(np.minimum.reduceat(np.where(enough, shade, np.inf), firsts), groups)
    told = np.repeat(np.add.reduceat(enough.astype(np.int64), firsts), groups) - enough > 0
    suspect = cells.means(near[about][:, None])[:, 0] > 0.5
    glared[about] = cells.of_points(suspect & (shade > least + settings.glare))
    first = cells.order[cells.starts]
    spot, ring = burnt.spot[about][first], burnt.off_deg[about][first]
    dark = ~lamps[about][first] & (spot >= 0)
    compared = np.flatnonzero(suspect & dark & told & enough)
    excess = np.zeros((int(spot.max(initial=0)) + 1, int(ring.max(initial=0)) + 1))
    key = spot[compared] * excess.shape[1] + ring[compared]
    for each, cells_there in zip(*np.unique(key, return_counts=True), strict=True):
        if cells_there >= settings.ring_cells:
            of = compared[key == each]
            excess.flat[each] = np.median(shade[of] - least[of])
    # Glare only fades: what is nearer the lamp's middle is dazzled at least as much.
    excess = np.maximum.accumulate(excess[:, ::-1], axis=1)[:, ::-1]
    alone = suspect & dark & ~told & (excess[spot, ring] > settings.dazzled)
    dazzled[about] = cells.of_points(alone)
    return glared, dazzled


def _near_lamps(
    points: Float32, burnt: Bool, station: npt.NDArray[np.int16], settings: Settings
) -> Bool:
    """(n,) points at what at least two stations saw burnt out."""
    near = np.zeros(len(points), bool)
    if not burnt.any():
        return near
    at, owner = points[burnt], station[burnt]
    trees = {each: cKDTree(at[owner == each]) for each in np.unique(owner)}
    reach = settings.lamp_m
    shared = np.zeros(len(at), bool)
    for each, tree in trees.items():
        others = owner != each
        shared[others] |= np.isfinite(tree.query(at[others], distance_upper_bound=reach)[0])
    if shared.any():
        lamps = cKDTree(at[shared])
        near = np.isfinite(lamps.query(points, distance_upper_bound=reach)[0])
    return near


def _take_surroundings(cloud: PointCloud, some: Bool, sound: Bool) -> None:
    """Give some points the mean colour of the sound ones next to them; in place."""
    if some.any() and sound.any():
        _, near = cKDTree(cloud.points[sound]).query(
            cloud.points[some], k=np.arange(1, min(_SURROUNDING_POINTS, int(sound.sum())) + 1)
        )
        cloud.colors[some] = np.rint(cloud.colors[sound][near].mean(1)).astype(np.uint8)
