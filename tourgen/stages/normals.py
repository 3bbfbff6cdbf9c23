"""Normals: a robust plane of each neighbourhood, turned toward the free space of the room.

Orientation, best evidence first:

1. The station that measured the point is known: the normal looks at it, but for beams that grazed
   the surface: they follow what was met more squarely around them.
2. Stations are known or found, but not which one measured which point: the normal looks at the
   station that sees the point most squarely. Where stations see both sides of much of what they
   see (15 % of a narrow stair, 0.7 % of two chambers), they look through surfaces too sparse to
   hide anything, and are not believed.
3. No station, none that is believed, or a point that none sees: free space is one, and what
   surfaces see of each other across it, they see from their free sides (``free_side``).

Right normals without given stations, by tests/peers/orientation.py: 99.5 to 99.7 % in three
rooms. Before: a minimum spanning tree over the tangent planes (Hoppe et al. 1992) took 93 s for
0.9 million points, and one wrong edge turns all that hangs on it; points that no station sees
followed the nearest that one sees, so that the underside of a table looked up. Before beams that
grazed followed others: a reveal in whose plane a station stood by chance had a row of normals that
looked into the wall, and a lump there (chamber2 at full size: walls' normals 6.4 degrees off).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64, OrientedCloud, PointCloud
from tourgen.neighbours import Neighbours
from tourgen.stages.free_side import PATCH_M, face_free_space, follow
from tourgen.stages.sight import depth_buffer
from tourgen.stages.spacing import FOURTH, spacing_at
from tourgen.stages.tangent import tangent_planes
from tourgen.voxels import voxel_groups

VERSION = 4
_GRAZING, _SQUARE = 0.15, 0.25
"""Cosines: a point seen at less is not seen; one seen at more from both sides contradicts."""
_ALONG = 0.1
"""Cosine of a beam to a normal below which their noise may decide which side it met."""
_SPACING_SAMPLE = 5_000
_COARSER = 4
"""Times that the cells of a depth buffer are doubled for what is near."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How wide to look.

    Attributes:
        first_neighbours: Points of the small first fit of a tangent plane.
        neighbours: Points that the wide, robust fit chooses from.
        sight_cell_deg: Cell of the depth buffers that decide which station sees a point.
        contradicted: Share of points whose two sides are both seen, from which on the stations
            are believed to look through surfaces that are sparse for their distance.
    """

    first_neighbours: int = 12
    neighbours: int = 48
    sight_cell_deg: float = 0.5
    contradicted: float = 0.03


def normals(cloud: PointCloud, stations: Float64, settings: Settings) -> OrientedCloud:
    """Estimate and orient.

    Args:
        cloud: n points, evenly thinned.
        stations: (s, 3) metres from the cloud's origin; may be empty.
        settings: See ``Settings``.

    Returns:
        The same points with unit normals toward the free space.
    """
    normal = tangent_planes(cloud.points, settings.first_neighbours, settings.neighbours)
    if len(stations) and np.all(cloud.station >= 0):
        _look_at(normal, cloud.points, stations[cloud.station])
    else:
        seen, contradicted = _look_at_seeing(
            normal, cloud.points, stations, settings.sight_cell_deg
        )
        if contradicted > settings.contradicted:
            seen[:] = False
        face_free_space(cloud.points, normal, seen)
    return OrientedCloud(cloud, normal, stations)


def _look_at(normal: Float32, points: Float32, target: Float64) -> None:
    """Turn each normal to the station that met its point; what was grazed, as others around it."""
    beam = target.astype(np.float32) - points
    beam /= np.maximum(np.linalg.norm(beam, axis=1, keepdims=True), 1e-6)
    cosine = np.einsum("ij,ij->i", normal, beam)
    normal[cosine < 0] *= -1
    grazed = np.abs(cosine) < _ALONG
    if grazed.any() and not grazed.all():
        square = np.flatnonzero(~grazed)
        order, starts = voxel_groups(points[square], PATCH_M)
        patches = square[order[starts]]
        follow(points, normal, grazed, points[patches], normal[patches])


def _look_at_seeing(
    normal: Float32, points: Float32, stations: Float64, cell_deg: float
) -> tuple[npt.NDArray[np.bool_], float]:
    """Turn each normal to the station that sees its point most squarely.

    Returns:
        Mask of the points seen, and the share of them whose two sides are both seen: a true
        surface has one free side, so that is how much the stations contradict each other.
    """
    front, back = np.zeros((2, len(points)), np.float32)
    spacing_m = _spacing(points)
    for station in stations:
        ray = station.astype(np.float32) - points
        cosine = np.einsum("ij,ij->i", normal, ray) / np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
        np.clip(cosine, -1, 1, out=cosine)
        cosine[~_seen(points, cosine, station, cell_deg, spacing_m)] = 0
        np.maximum(front, cosine, out=front)
        np.maximum(back, -cosine, out=back)
    normal[back > front] *= -1
    seen = np.maximum(front, back) > _GRAZING
    both = np.minimum(front, back) > _SQUARE
    return seen, float(both.sum() / max(seen.sum(), 1))


def _spacing(points: Float32) -> float:
    """Median distance between neighbouring points, metres."""
    chosen = np.random.default_rng(0).permutation(len(points))[:_SPACING_SAMPLE]
    return float(np.median(spacing_at(Neighbours.of(points, FOURTH), points[chosen])))


def _seen(
    points: Float32, cosine: Float32, station: Float64, cell_deg: float, spacing_m: float
) -> npt.NDArray[np.bool_]:
    """Mask of the points in sight of a station.

    A buffer whose cells are finer than the points lie apart looks through between them: in a
    narrow stair the nearest surfaces are half a metre away. What is near is drawn once more, on
    cells twice, four times as wide, until each holds two points across.
    """
    away = np.linalg.norm(points - station.astype(np.float32), axis=1)
    seen = depth_buffer(points, station, cell_deg).sees(points, cosine)
    for doubling in range(_COARSER):
        near = points[away < 2 * spacing_m / np.radians(cell_deg * 2**doubling)]
        if len(near):
            wider = depth_buffer(near, station, cell_deg * 2 ** (doubling + 1))
            seen &= wider.sees(points, cosine)
    return np.asarray(seen)
