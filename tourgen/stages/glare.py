"""Glare: what a lamp lays over the picture of a camera that it burns out.

Stations see the same lamp before other things, so that between them nearly all is told: points
that lie about burnt-out directions and are brighter than what another station saw at their place
are dropped. By how much they are brighter, degree by degree off the lamp, says where the rest is
dazzled that no other station saw: it takes the colours about it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, Float64, Int32, PointCloud, UInt8
from tourgen.neighbours import Neighbours
from tourgen.stages.burnt import burnt_out
from tourgen.stages.cells import Cells, cells_of

Bool = npt.NDArray[np.bool_]
Int16 = npt.NDArray[np.int16]

_DIRECTION_DEG = 1.0
_WIDEST = 60
"""Cells of directions lie no farther from the middle along any axis."""
_TOUCHING_CELLS = 2.5
_SURROUNDING_POINTS = 16


@dataclass(frozen=True, slots=True)
class Settings:
    """How glare is told.

    Attributes:
        reach_deg: How far it reaches about a burnt-out direction.
        cell_m: Edge of the cells in which stations are compared.
        cell_points: Fewest points of a station in a cell.
        brighter: By how much such a cell is brighter than another station's, at the least, and all
            that lie as far off the lamp in the middle: white things burn out, and lay nothing over
            what is about them.
        ring_cells: So many cells, at the least, tell the glare at one angle off a lamp.
        dazzled: How much brighter cells so far off the lamp have to be, in the middle, for those
            that no other station saw to take the colours about them.
        lamp_m: What two stations see burnt out so near to one another is a lamp.
    """

    reach_deg: float = 12.0
    cell_m: float = 0.04
    cell_points: int = 3
    brighter: float = 3.0
    ring_cells: int = 10
    dazzled: float = 5.0
    lamp_m: float = 0.25


def without_glare(
    even: PointCloud, measured: UInt8, stations: Float64, settings: Settings
) -> PointCloud:
    """The points without glare, where another station tells better.

    Args:
        even: n points in colours of one exposure.
        measured: (n, 3) sRGB, their colours before.
        stations: (s, 3) metres from the cloud's origin.
        settings: See there.

    Returns:
        The points in their order, less those in glare; those that are dazzled and that no other
        station saw have the colours about them.
    """
    burnt = _burnt(measured, even.station, len(stations))
    lamps = _near_lamps(even.points, burnt, even.station, settings)
    spots = _about_burnt(even, burnt, stations, settings)
    glared, dazzled = _glared(even, spots, lamps, settings)
    _take_surroundings(even, dazzled, ~(glared | dazzled))
    return even.take(~glared) if glared.any() else even


def _burnt(colors: UInt8, station: npt.NDArray[np.int16], count: int) -> Bool:
    """(n,) where a station's camera burnt out."""
    burnt = np.zeros(len(colors), bool)
    for number in range(count):
        own = station == number
        burnt[own] = burnt_out(colors[own])
    return burnt


@dataclass(frozen=True, slots=True)
class _About:
    """Which burnt-out spot of its station's picture a point lies about.

    Attributes:
        spot: (n,) number, -1 for none. Directions that touch are one spot of one station.
        off_deg: (n,) angle to its middle, whole degrees.
    """

    spot: Int32
    off_deg: Int16


def _about_burnt(cloud: PointCloud, burnt: Bool, stations: Float64, settings: Settings) -> _About:
    """About which spots the points of all stations lie."""
    about = _About(np.full(len(cloud), -1, np.int32), np.zeros(len(cloud), np.int16))
    spots = 0
    for number, station in enumerate(stations):
        own = np.flatnonzero(cloud.station == number)
        if burnt[own].any():
            way = cloud.points[own] - station.astype(np.float32)
            way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-6)
            found = _about_spots(way, burnt[own], settings)
            about.spot[own] = np.where(found.spot < 0, -1, found.spot + spots)
            about.off_deg[own] = found.off_deg
            spots += int(found.spot.max()) + 1
    return about


def _about_spots(way: Float32, burnt: Bool, settings: Settings) -> _About:
    """About which spots of one picture its directions lie; spots are found in cells of a degree."""
    step = np.rint(way / np.radians(_DIRECTION_DEG)).astype(np.int64)
    span = (2 * _WIDEST + 1,) * 3
    key, of_cell = np.unique(np.ravel_multi_index((step + _WIDEST).T, span), return_inverse=True)
    cells = np.stack(np.unravel_index(key, span), axis=1) - _WIDEST
    seeds = cKDTree(cells[np.unique(of_cell[burnt])])
    reach = 2 * np.sin(np.radians(settings.reach_deg) / 2) / np.radians(_DIRECTION_DEG)
    _, nearest = seeds.query(cells, distance_upper_bound=reach)
    touching = seeds.sparse_distance_matrix(seeds, _TOUCHING_CELLS)
    count, spot = connected_components(touching, directed=False)
    summed = np.stack([np.bincount(spot, axis, count) for axis in seeds.data.T], axis=1)
    middles = summed / np.linalg.norm(summed, axis=1, keepdims=True)
    spot_of = np.append(spot, -1)[nearest][of_cell].astype(np.int32)
    cosine = (way * middles[spot_of].astype(np.float32)).sum(axis=1)
    return _About(spot_of, np.degrees(np.arccos(np.clip(cosine, -1, 1))).astype(np.int16))


@dataclass(frozen=True, slots=True)
class _Shades:
    """How bright each station saw each cell, and what the others saw there.

    Attributes:
        shade: (c,) mean brightness of one station in one cell.
        least: (c,) of all stations with enough points in that cell, the darkest.
        enough: (c,) whether the station has enough points there.
        told: (c,) whether another station has.
    """

    shade: Float64
    least: Float64
    enough: Bool
    told: Bool

    @staticmethod
    def of(cells: Cells, colors: UInt8, settings: Settings) -> _Shades:
        shade = cells.means(colors).mean(1)
        enough = cells.sizes >= settings.cell_points
        firsts = np.flatnonzero(np.diff(cells.cell, prepend=-1))
        stations = np.diff(firsts, append=len(cells.cell))
        least = np.minimum.reduceat(np.where(enough, shade, np.inf), firsts)
        telling = np.add.reduceat(enough.astype(np.int64), firsts)
        told = np.repeat(telling, stations) - enough > 0
        return _Shades(shade, np.repeat(least, stations), enough, told)


def _glared(cloud: PointCloud, burnt: _About, lamps: Bool, settings: Settings) -> tuple[Bool, Bool]:
    """(n,) points too bright for their place, and those that are it unseen by other stations."""
    glared, dazzled = np.zeros((2, len(cloud)), bool)
    near = burnt.spot >= 0
    if not near.any():
        return glared, dazzled
    low = cloud.points[near].min(0) - settings.cell_m
    high = cloud.points[near].max(0) + settings.cell_m
    about = (cloud.station >= 0) & ((cloud.points >= low) & (cloud.points <= high)).all(1)
    count = int(cloud.station.max()) + 1
    cells = cells_of(cloud.points[about], cloud.station[about], count, settings.cell_m)
    seen = _Shades.of(cells, cloud.colors[about], settings)
    suspect = cells.means(near[about][:, None])[:, 0] > 0.5
    first = cells.order[cells.starts]
    where = _About(burnt.spot[about][first], burnt.off_deg[about][first])
    suspect &= where.spot >= 0
    dark = suspect & ~lamps[about][first]
    excess = _excess(seen, where, dark & seen.told & seen.enough, settings)
    excess = np.where(suspect, excess[where.spot, where.off_deg], 0)
    brighter = (seen.shade > seen.least + settings.brighter) & (excess > settings.brighter)
    glared[about] = cells.of_points(suspect & brighter)
    dazzled[about] = cells.of_points(dark & ~seen.told & (excess > settings.dazzled))
    return glared, dazzled


def _excess(seen: _Shades, where: _About, compared: Bool, settings: Settings) -> Float64:
    """(spots, degrees) how much brighter than other stations a spot makes what lies so far off.

    Args:
        seen: c cells of one station each.
        where: (c,) about which spot.
        compared: (c,) those that tell.
        settings: See there.
    """
    rings = int(where.off_deg.max(initial=0)) + 1
    excess = np.zeros((int(where.spot.max(initial=0)) + 1, rings))
    ring = where.spot.astype(np.int64) * rings + where.off_deg
    at = np.flatnonzero(compared)
    for each, count in zip(*np.unique(ring[at], return_counts=True), strict=True):
        if count >= settings.ring_cells:
            of = at[ring[at] == each]
            excess.flat[each] = np.median(seen.shade[of] - seen.least[of])
    # Glare only fades: what is nearer the lamp's middle is dazzled at least as much.
    return np.asarray(np.maximum.accumulate(excess[:, ::-1], axis=1)[:, ::-1])


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
        count = min(_SURROUNDING_POINTS, int(sound.sum()))
        near, _ = Neighbours.of(cloud.points[sound], count).nearest(cloud.points[some], count)
        cloud.colors[some] = np.rint(cloud.colors[sound][near].mean(1)).astype(np.uint8)
