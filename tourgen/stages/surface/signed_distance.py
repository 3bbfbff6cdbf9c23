"""Signed distance: how far in front of the nearest tangent plane a place lies (Hoppe et al. 1992).

The planes come from ``tangent_planes``; the shapes that many of them agree on tell them better
(``profiles``, ``flats``, ``meetings``), and rails stand beside the surface as tubes (``rods``).
Between planes the distances to the nearest few are blended, with weights that end at the last of
these, so that the blend has no steps (Shen, O'Brien and Shewchuk 2004; Kolluri 2005). Where the few
look two ways they are the two sides of a crease, each with a distance of its own: at an edge the
larger counts, in a corner the smaller (Fleishman, Cohen-Or and Silva 2005). The distance is unknown
where the foot of a place on its nearest plane lies farther from that plane's point than the
sampling density and the noise together: there the surface ends, and windows stay open.

Distances are taken only at the corners of cells that the surface enters (``growing``).

Tried on a sixth of the demo's first chamber (195,000 points 12 mm apart) with cells of 8 mm,
against the truth; Poisson at 14 mm has 0.81 mm in the median, 3.0 mm at the 95th percentile and
normals 6.8° off, and 86 % of what is seen has it within 2 mm, 99.0 % within 10 mm.

- Hoppe's single plane steps at every change of the nearest point: normals 3.1° off, a tenth of the
  surface more than 10 mm off.
- What keeps false sheets down: a distance cannot change by more than the way, so a larger jump is
  the middle between two walls, no wall (95th percentile 4.5 to 3.7 mm); the reach of a lone point
  ends at twice the room's spacing (3.0 mm); planes that their neighbours contradict go (2.8 mm).
- Two sides of a crease: 2.4 to 2.1 mm, the 99th percentile 7.2 to 5.3 mm. A second weighting of
  planes at each place by their likeness (Öztireli, Guennebaud and Gross 2009) let false sheets
  grow: 15 mm.
- A narrower crease (25° to 12°) and less wanted support (0.3 to 0.1): 1.9 mm, 0.76 mm in the
  median, normals 1.3° off; 92 % within 2 mm and 99.0 % within 10 mm.
- Cells as wide as the spacing, 12.3 mm: 2.1 instead of 2.0 mm, 97.1 instead of 97.5 % within
  5 mm, in three fifths of the time and with two fifths of the faces.
- Not worth their cost: cells of 6 mm (2.04 instead of 2.12 mm, 1.8 times the faces), 24 neighbours
  (smoother, 1.0°, but 98.5 instead of 98.7 % within 10 mm), a longer reach (the 99th percentile 7.0
  instead of 4.8 mm, still 99.1 % within 10 mm).

The whole chamber, 1.07 million points after sifting and registration, cells of 8.2 mm: 0.50 mm in
the median, 1.9 mm at the 95th percentile, normals 1.2° off, 98.7 % within 10 mm (of the rest seven
eighths have no point within 10 mm), F-score at 5 mm 0.978; 53 s of the processor and 0.9 GB.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tourgen.errors import StageError
from tourgen.extent import extent
from tourgen.geometry import Float32, Float64, Mesh, OrientedCloud
from tourgen.stages.free_space import FreeSpace
from tourgen.stages.sift.strays import clusters
from tourgen.stages.surface.blocks import drawn_by_blocks
from tourgen.stages.surface.field import Beyond, Field
from tourgen.stages.surface.growing import grown
from tourgen.stages.surface.marching_cubes import (
    Keys,
    beside,
    marching_cubes,
    most_cells,
)
from tourgen.stages.surface.meetings import met
from tourgen.stages.surface.onto_flats import flattened
from tourgen.stages.surface.profiles import along_profiles
from tourgen.stages.surface.rods import rods
from tourgen.stages.surface.samples import distinct_samples, require_range
from tourgen.stages.surface.tangent_planes import (
    Smoothing,
    TangentPlanes,
    noise_of,
    tangent_planes,
)
from tourgen.stages.surface.tubes import Rod, with_tubes

VERSION = 20
_APART = 3.0
"""Spacings between points that stand apart."""
_HANDFUL = 12
"""Fewer points that stand apart from all others are strays."""
_TUBE = 2.0
"""Length of the faces of a rod's tube, in cells."""
_FACES_A_CELL = 2.0
_STEEPEST = 1.8
"""Most change of the distance over the way: 1, and more for the blend and for what was hardly seen.
At 1.2 edges gape of which one side was (chamber1: 98.97 instead of 99.24 % of what is seen within
10 mm); the 95th percentile is 2.5 instead of 3.1 mm."""
_STEEPEST_ACROSS = 6.0
"""The same where another surface carries it on, so that no edge gapes: twice the reach of a lone
point. There is an end, since the side of a surface that is open itself changes beyond its rim."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The grid and the surface.

    Attributes:
        cell_m: Edge of the grid's cells, 0.5 mm to 1 m; as wide as the spacing does, two
            thirds of it draw edges a little sharper.
        spacing_m: Distance between neighbouring points in the middle of the room, 0.1 mm to 1 m.
        noise_m: Standard deviation of the points about the surface, 0 to 0.1 m; None measures it.
        neighbours: Points that speak for a tangent plane, 4 to 64.
        crease_deg: Spread of the normals on one side of a crease, 3° to 45°; twice as much makes
            one. Less keeps creases sharper and walls rougher.
        blend: Planes that speak for a place, 1 (as Hoppe had it) to 32.
        reach: How far the surface goes on past a point, in spacings, 0.5 to 5; the noise is added.
        support: Share of a plane's neighbours that must lie on it, 0 to 0.9.

    Raises:
        InputError: One lies outside its range.
    """

    cell_m: float
    spacing_m: float
    noise_m: float | None = None
    neighbours: int = 16
    crease_deg: float = 12.0
    blend: int = 6
    reach: float = 1.5
    support: float = 0.1

    def __post_init__(self) -> None:
        require_range("cell_m", self.cell_m, 0.0005, 1)
        require_range("spacing_m", self.spacing_m, 0.0001, 1)
        if self.noise_m is not None:
            require_range("noise_m", self.noise_m, 0, 0.1)
        require_range("neighbours", self.neighbours, 4, 64)
        require_range("crease_deg", self.crease_deg, 3, 45)
        require_range("blend", self.blend, 1, 32)
        require_range("reach", self.reach, 0.5, 5)
        require_range("support", self.support, 0, 0.9)


def signed_distance(oriented: OrientedCloud, settings: Settings) -> Mesh:
    """Find where the distance is zero.

    Args:
        oriented: n points with normals toward the free space.
        settings: See ``Settings``.

    Returns:
        A mesh that is open where points are missing, faces counter-clockwise seen from the free
        space.

    Raises:
        InputError: The room has more than two million cells from end to end.
        StageError: There is no surface.
    """
    found = shapes(oriented, settings)
    mesh = distances(found.planes, settings).zero_set(oriented.cloud.origin)
    mesh = found.with_rods(mesh, settings)
    if not len(mesh.faces):
        raise StageError(
            "surface: expected a surface, found none",
            "lower `surface.detail_mm` toward the spacing of the points, or take poisson",
        )
    return mesh


@dataclass(frozen=True, slots=True)
class Shapes:
    """What the points say of the surface.

    Attributes:
        planes: That touch it, those of rods left out.
        rods: Too thin for planes.
    """

    planes: TangentPlanes
    rods: tuple[Rod, ...]

    def with_rods(self, mesh: Mesh, settings: Settings) -> Mesh:
        """A mesh of the planes, and the rods beside it."""
        return with_tubes(mesh, self.rods, _TUBE * settings.cell_m)


def shapes(oriented: OrientedCloud, settings: Settings) -> Shapes:
    """The planes that their neighbours do not contradict, flat where many agree, and the rods.

    Raises:
        InputError: The room has more than two million cells from end to end.
        StageError: There are none.
    """
    oriented = distinct_samples(oriented)
    low, high = extent(oriented.cloud.points)
    extent_m = float((high - low).max())
    require_range("cell_m", settings.cell_m, extent_m / most_cells(), 1)
    noise_m = noise_of(oriented) if settings.noise_m is None else settings.noise_m
    noise_m = max(noise_m, settings.spacing_m / 100)
    smoothing = Smoothing(settings.neighbours, settings.crease_deg, noise_m)
    planes = tangent_planes(oriented, smoothing)
    supported = np.flatnonzero(planes.support >= settings.support)
    planes = planes.take(supported)
    many = ~_few(planes.points, settings.spacing_m)
    planes, raw = planes.take(many), oriented.cloud.points[supported[many]]
    if not len(planes.points):
        raise StageError(
            "surface: expected points that agree on a surface, found none",
            "check the normals, or thin the scan less",
        )
    _, flats = flattened(planes, settings.spacing_m)
    planes = along_profiles(planes, raw, ~flats.broad, smoothing)
    planes, flats = flattened(planes, settings.spacing_m)
    found, theirs = rods(planes, raw, ~flats.broad, settings.spacing_m)
    flats = replace(flats, of=flats.of[~theirs])
    return Shapes(met(planes.take(~theirs), flats, settings.spacing_m), found)


def _few(points: Float32, spacing_m: float) -> npt.NDArray[np.bool_]:
    """Mask of the points that stand apart in a handful: strays, which would draw a lump in the air.

    None where all do: a scan so sparse has no strays that could be told.
    """
    if not len(points):
        return np.zeros(0, bool)
    cluster = clusters(points, _APART * spacing_m)
    few = np.bincount(cluster)[cluster] < _HANDFUL
    return few & (not few.all())


@dataclass(frozen=True, slots=True)
class Distances:
    """The distance at the corners of all cells that the surface enters.

    Attributes:
        field: What tells it.
        key: (n,) of the corners, sorted; see ``marching_cubes``.
        value: (n,) metres, NaN where it is unknown.
        steepest: Most change of the distance over the way; where it changes by more there is no
            surface.
    """

    field: Field
    key: Keys
    value: Float32
    steepest: float

    def zero_set(self, origin: Float64, *, sharp: bool = True) -> Mesh:
        """Where the distance is zero, creases sharp or cut off; no faces where it nowhere is."""
        low, cell_m = self.field.low, float(self.field.cell_m)
        return marching_cubes(
            self.key,
            self.value,
            low,
            cell_m,
            origin,
            steepest=self.steepest,
            normals=self.field.normal if sharp else None,
        )

    def carried_on(self, beyond: Beyond) -> Distances:
        """The same, fading into the distance to another surface where it becomes unknown."""
        field = self.field

        def told(key: Keys) -> Float32:
            return field.carried_on(key, beyond)

        rim = np.flatnonzero(beside(self.key, np.isnan(self.value)))
        value = self.value.copy()
        value[rim] = told(self.key[rim])
        return _grown(field, told, self.key, value, _STEEPEST_ACROSS)


def distances(
    planes: TangentPlanes, settings: Settings, free: FreeSpace | None = None
) -> Distances:
    """The distance to tangent planes, from the cells with points on, what is free cut out."""
    field = _field(planes, settings, free)
    nothing = np.empty(0, np.int64), np.empty(0, np.float32)
    return _grown(field, field.distance, *nothing, _STEEPEST)


def zero_set_by_blocks(
    planes: TangentPlanes,
    settings: Settings,
    free: FreeSpace | None,
    origin: Float64,
    most_faces: float,
    beyond: Beyond | None = None,
) -> Mesh:
    """Where the distance is zero, of a room of so many cells that they are not held at once.

    Args:
        planes: See ``distances``.
        settings: See ``Settings``.
        free: See ``distances``.
        origin: Of the mesh.
        most_faces: About so many are left.
        beyond: Another surface that it fades into where it becomes unknown; creases are drawn sharp
            then.
    """
    field = _field(planes, settings, free)
    steepest = _STEEPEST_ACROSS if beyond else _STEEPEST

    def told(key: Keys) -> Float32:
        return field.carried_on(key, beyond) if beyond else field.distance(key)

    def draw(key: Keys, value: Float32) -> Mesh:
        return Distances(field, key, value, steepest).zero_set(origin, sharp=beyond is not None)

    expected = _FACES_A_CELL * cells_expected(planes, settings.cell_m)
    share = min(most_faces / expected, 1.0)
    return drawn_by_blocks(told, draw, field.seeds, _most_m(field, steepest), share)


def cells_expected(planes: TangentPlanes, cell_m: float) -> float:
    """About how many cells the surface enters."""
    return float(np.square(planes.spacing_m, dtype=np.float64).sum()) / cell_m**2


def _field(planes: TangentPlanes, settings: Settings, free: FreeSpace | None) -> Field:
    return Field(
        planes,
        settings.cell_m,
        settings.spacing_m,
        settings.reach,
        settings.crease_deg,
        settings.blend,
        free,
    )


def _most_m(field: Field, steepest: float) -> float:
    """How much the distance may change along a face of a cell."""
    return float(np.sqrt(2) * steepest * field.cell_m)


def _grown(
    field: Field,
    told: Callable[[Keys], Float32],
    key: Keys,
    value: Float32,
    steepest: float,
) -> Distances:
    found = grown(told, field.seeds, key, value, _most_m(field, steepest))
    return Distances(field, found.key, found.value, steepest)
