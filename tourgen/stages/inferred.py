"""Inferred: where no measurement stands behind the surface.

What closes a gap of the scan (the disc under a tripod, what furniture hides) is a guess, and those
who look at the tour, or cite it, shall be able to tell. Each vertex of a tile says so, and the
report gives the share of the area.

A place is measured where some station saw it: where, of that station's beams, the one nearest in
direction ended at the place, nearer than points of that station lie apart there. Each beam thus
speaks for its own piece of the sphere, down to the edge of a shadow, and a surface that a beam
went past, or that lies behind what it met, is a guess however near to points it runs. Points that
do not tell their station speak for what lies around them, as far as they lie apart.

Against the truth (a guess is where no station sees the nearest true place, or this one), in the
demo's chamber1, stairs and chamber2: 13.8, 4.8 and 17.2 % of the area instead of 13.4, 6.1 and
16.7. Place by place, 2.0, 1.4 and 2.2 % are marked and should not be; 1.6, 2.7 and 1.7 % should be
and are not. Of the former five sixths lie over 3 mm off the truth, at the rim of a shadow: guesses
indeed, to which a seen place happens to be the nearest. A reach of 1 gives 14.1, 5.4 and 17.6 %,
one of 1.25 gives 13.4, 4.2 and 16.7, about as true place by place.

Tried and rejected: 30 mm or three median spacings from every point, whoever measured it (11.3, 2.6,
13.5 and 1.0 %: the rim of every shadow counts as measured); the same with 20 mm or one local
spacing (shares as true, but up to a third more of it in other places); several beams around a
direction instead of the nearest (shadows shrink by half a beam's distance); a place whose normal
looks away from the station as a guess (where a surface is guessed, so is its normal), and points
off the place's tangent plane as none of its (no better than their distance).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64, Int32, PointCloud, UInt8
from tourgen.neighbours import Neighbours
from tourgen.stages.spacing import FOURTH, spacing_at

VERSION = 3
INFERRED = 255
"""Of a vertex that is a guess; 0 of one that is not."""
_FEWEST = 5
"""Points whose distance from one another can be told."""
_NEAREST_M = np.float32(1e-6)


@dataclass(frozen=True, slots=True)
class Settings:
    """What counts as measured.

    Attributes:
        detail_m: Finest detail of the surface. A point as near as that stands for a place however
            close to one another points lie: noise and simplification part them so far.
        reach: How near to a place a point must lie, over the distance between points around it.
    """

    detail_m: float
    reach: float = 1.1


def inferred(
    vertices: tuple[Float32, ...], cloud: PointCloud, stations: Float64, settings: Settings
) -> tuple[UInt8, ...]:
    """Tell of each mesh's vertices whether they are inferred.

    Args:
        vertices: (v, 3) of each mesh, metres from the cloud's origin.
        cloud: The cleaned points, unthinned.
        stations: (s, 3) metres from the cloud's origin, that the cloud's ``station`` counts
            through.
        settings: See ``Settings``.

    Returns:
        (v,) for each mesh, 0 or ``INFERRED``.
    """
    guess = ~measured(np.concatenate(vertices), cloud, stations, settings)
    ends = np.cumsum([len(each) for each in vertices])[:-1]
    return tuple(np.split(np.where(guess, INFERRED, 0).astype(np.uint8), ends))


def measured(
    places: Float32, cloud: PointCloud, stations: Float64, settings: Settings
) -> npt.NDArray[np.bool_]:
    """Mask of the (n, 3) places that some point was measured at."""
    found = np.zeros(len(places), np.bool_)
    for number in np.unique(cloud.station):
        points = cloud.points[cloud.station == number]
        if len(points) < _FEWEST:
            continue
        if 0 <= number < len(stations):
            station = stations[number].astype(np.float32)
            nearest = _nearest(_directions(places - station), _directions(points - station))
        else:
            nearest = _nearest(places, points)
        away_m = np.linalg.norm(places - points[nearest], axis=1)
        apart_m = spacing_at(Neighbours.of(points, FOURTH), points[nearest])
        found |= away_m <= np.maximum(settings.reach * apart_m, settings.detail_m)
    return found


def _nearest(places: Float32, points: Float32) -> Int32:
    """(n,) which of (m, 3) points is nearest to each of (n, 3) places."""
    return Neighbours.of(points, 1).nearest(places, 1)[0][:, 0]


def _directions(way: Float32) -> Float32:
    length = np.linalg.norm(way, axis=1, keepdims=True)
    return np.asarray(way / np.maximum(length, _NEAREST_M), np.float32)
