"""Register: bring the scans of several stations together.

From the poses given, all pairs at once: each round pairs the points of every station with the
nearest ones of every other station that overlaps it, and moves all stations by one linear least
squares over the distances to the partners' tangent planes (Chen and Medioni 1992, for many views
Neugebauer 1997) and over the differences of brightness along those planes (Park et al. 2017),
which hold what could slide along a round wall. Tukey's biweight on both leaves out what only one
station saw: passers-by, reflections, strays. Partners must look the same way, so that the two
sides of a thin wall never meet. The reach for partners shrinks round by round, from what the
poses may be wrong by to a few times the noise.

What all stations share, nothing here can tell: the room stays where most of them said it is, so
that one station that was moved does not carry the others along (least absolute motion, by
iteratively reweighted least squares). A weak pull toward the poses given holds what no surface
determines. Poses that would move by less than can be told are left as they are given.

Measured by tests/peers/registration.py, between each two stations, against the true poses: the
chambers' poses were off by 2.2 mm and 0.009 degrees in the mean and come out within 0.1 mm and
0.004 degrees, also from 5 cm and 1 degree away, with 15.2 million points within 0.3 mm and 0.008;
the stair's ten, which see little of each other, within 0.5 mm and 0.03 degrees (mean 0.19 mm,
0.013 degrees; given 2.2 mm, 0.014 degrees). The denser the points, the shorter the steps from one
nearest point to the next: twelve rounds a reach left the 15.2 million 1.2 mm and 0.08 degrees off.
Rejected: planes without brightness (the stair: 3.3 mm and 0.19 degrees, it turns about its
newel); voxels of 20 mm and half as many points (the stair: 1.1 mm, 0.05 degrees); the mean of
all stations held, which tilts the room by a third of what one of three was turned by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from tourgen.compiled import compiled
from tourgen.errors import InputError
from tourgen.geometry import Float32, Float64, Int32, PointCloud
from tourgen.neighbours import Neighbours
from tourgen.stages.mesh_arrays import components
from tourgen.stages.tangent import tangent_planes
from tourgen.stages.thin import Settings as Voxel
from tourgen.stages.thin import thin
from tourgen.threads import in_parts

VERSION = 4
_NEIGHBOURS = (12, 32)
_SAMPLES = 25_000
_ROUNDS_A_REACH = 40
_STILL = 5e-4
"""A round that moves less than this share of the reach is the last one at that reach."""
_ALIKE = np.cos(np.radians(30))
_TUKEY = 4.0
_LEAST_NOISE_M = 2e-4
_PROBE_M = 2.0
_HOLDING_ROUNDS = 20
_SHADES = 12
"""Neighbours that a gradient of brightness is fitted to."""
_PART = 1 << 14
_LEAST_SHADE = 0.01


@dataclass(frozen=True, slots=True)
class Settings:
    """How far to look.

    Attributes:
        reach_m: Farthest partner, coarse to fine; the first is what poses may be wrong by.
        voxel_m: Points are thinned to this before they are paired.
        overlap: Least share of a station's surface that another must have seen too.
        trust_m: How far the poses given may be off: a pull toward them, weaker than any surface.
        least_m: Where no station's surroundings would move farther, none is moved. Exact poses of
            a gallery came out 0.05 to 0.15 mm off.
    """

    reach_m: tuple[float, ...] = (0.2, 0.08, 0.03)
    voxel_m: float = 0.012
    overlap: float = 0.1
    trust_m: float = 0.05
    least_m: float = 0.0005


@dataclass(frozen=True, slots=True)
class Registered:
    """Scans brought together.

    Attributes:
        cloud: The points moved.
        stations: (s, 3) metres from the cloud's origin, moved.
        rotations: (s, 3, 3) float64, and
        translations: (s, 3) float64, metres: each station's points p became R p + t.
        moved_mm: (s,) float64, how far each station itself went.
        turned_deg: (s,) float64.
    """

    cloud: PointCloud
    stations: Float64
    rotations: Float64
    translations: Float64
    moved_mm: Float64
    turned_deg: Float64


@dataclass(frozen=True, slots=True)
class _View:
    """What one station saw, thinned, as given.

    Attributes:
        points: (n, 3) float64, metres.
        normals: (n, 3) float64, toward the station.
        shade: (n,) float64, brightness, logarithmic, mean 0.
        slope: (n, 3) float64, gradient of the brightness along the surface, 1/m.
        around: Of the points.
        sample: Indices of those that look for partners, in no order.
    """

    points: Float64
    normals: Float64
    shade: Float64
    slope: Float64
    around: Neighbours
    sample: npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class _Partners:
    """Points of one view beside points of another, where both are now.

    Attributes:
        at: (m, 3) of the one.
        gap: (m, 3) from the partner to it.
        normal: (m, 3) of the partner.
        slope: (m, 3) the partner's.
        contrast: (m,) the one's brightness less the partner's.
        share: Of those that looked for partners.
    """

    at: Float64
    gap: Float64
    normal: Float64
    slope: Float64
    contrast: Float64
    share: float


def register(cloud: PointCloud, stations: Float64, settings: Settings) -> Registered:
    """Move each station's points so that all agree.

    Args:
        cloud: n points.
        stations: (s, 3) metres from the cloud's origin.
        settings: See ``Settings``.

    Returns:
        The cloud as it is unless there are several stations and each point's is known.

    Raises:
        InputError: Some stations overlap none of the others.
    """
    rotations = np.tile(np.eye(3), (len(stations), 1, 1))
    translations = np.zeros((len(stations), 3))
    active = np.unique(cloud.station)
    if len(active) > 1 and active[0] >= 0:
        views = tuple(_view(cloud, stations, number, settings) for number in active)
        places = stations[active]
        names = tuple(_name(int(number), stations[number] + cloud.origin) for number in active)
        turned, shifted = _held(*_aligned(views, names, settings), places)
        if _farthest(turned, shifted, places) > settings.least_m:
            rotations[active], translations[active] = turned, shifted
    moved = np.einsum("sij,sj->si", rotations, stations) + translations
    return Registered(
        _moved(cloud, rotations, translations),
        moved,
        rotations,
        translations,
        np.linalg.norm(moved - stations, axis=1) * 1000,
        np.degrees(Rotation.from_matrix(rotations).magnitude()),
    )


def _name(number: int, place: Float64) -> str:
    """How messages call a station: those that were found have nothing but a place."""
    x, y, z = place
    return f"{number + 1} at [{x:.1f}, {y:.1f}, {z:.1f}]"


def _probes(places: Float64) -> Float64:
    """(s, 6, 3) points around each station, which stand for what it saw."""
    around = np.concatenate([np.eye(3), -np.eye(3)]) * _PROBE_M
    return places[:, None] + around


def _farthest(rotations: Float64, translations: Float64, places: Float64) -> float:
    """How far the surroundings of a station move, the farthest; metres."""
    probes = _probes(places)
    moved = np.einsum("sij,skj->ski", rotations, probes) + translations[:, None]
    return float(np.linalg.norm(moved - probes, axis=2).mean(axis=1).max())


def _held(rotations: Float64, translations: Float64, places: Float64) -> tuple[Float64, Float64]:
    """The same, all moved together so that most stations stay where they were."""
    probes = _probes(places)
    for _ in range(_HOLDING_ROUNDS):
        moved = np.einsum("sij,skj->ski", rotations, probes) + translations[:, None]
        gone = np.linalg.norm(moved - probes, axis=2).mean(axis=1)
        weight = np.repeat(1 / (gone + _LEAST_NOISE_M), probes.shape[1])
        weight /= weight.sum()
        here, there = moved.reshape(-1, 3), probes.reshape(-1, 3)
        middle, aim = weight @ here, weight @ there
        turn = Rotation.align_vectors(there - aim, here - middle, weights=weight)[0].as_matrix()
        rotations = turn @ rotations
        translations = (translations - middle) @ turn.T + aim
    return rotations, translations


def _moved(cloud: PointCloud, rotations: Float64, translations: Float64) -> PointCloud:
    points = cloud.points.copy()
    for number in np.unique(cloud.station[cloud.station >= 0]):
        mine = cloud.station == number
        points[mine] = points[mine] @ rotations[number].T + translations[number]
    return PointCloud(cloud.origin, points, cloud.colors, cloud.station)


def _view(cloud: PointCloud, stations: Float64, number: int, settings: Settings) -> _View:
    mine = thin(cloud.take(cloud.station == number), Voxel(settings.voxel_m))
    normal = tangent_planes(mine.points, *_NEIGHBOURS)
    away = np.einsum("ij,ij->i", normal, stations[number] - mine.points) < 0
    normal[away] *= -1
    light = np.log1p(mine.colors.astype(np.float32).mean(axis=1))
    points = mine.points.astype(np.float64)
    around = Neighbours.of(mine.points, _SHADES)
    rng = np.random.default_rng(int(number))
    return _View(
        points,
        normal.astype(np.float64),
        (light - light.mean()).astype(np.float64),
        _slope(around, mine.points, normal, light),
        around,
        rng.permutation(len(points))[:_SAMPLES],
    )


def _slope(around: Neighbours, points: Float32, normal: Float32, light: Float32) -> Float64:
    """Gradient of the brightness in the tangent plane of each point, by least squares."""
    near = around.nearest(points, min(_SHADES, len(points)))[0]
    slope = np.empty((len(points), 3))

    def fit(first: int, last: int) -> None:
        _fit_slopes(near[first:last], first, points, normal, light, slope)

    in_parts(fit, len(points), _PART)
    return slope


@compiled
def _fit_slopes(
    near: Int32, first: int, points: Float32, normal: Float32, light: Float32, slope: Float64
) -> None:
    """Write the gradients at some points, from the first on."""
    for row in range(len(near)):
        i = first + row
        nx, ny, nz = np.float64(normal[i, 0]), np.float64(normal[i, 1]), np.float64(normal[i, 2])
        xx = xy = xz = yy = yz = zz = x_light = y_light = z_light = 0.0
        for j in near[row]:
            x, y, z = (
                points[j, 0] - points[i, 0],
                points[j, 1] - points[i, 1],
                points[j, 2] - points[i, 2],
            )
            height = x * nx + y * ny + z * nz
            x, y, z = x - height * nx, y - height * ny, z - height * nz
            change = light[j] - light[i]
            xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
            yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
            x_light, y_light, z_light = (
                x_light + x * change,
                y_light + y * change,
                z_light + z * change,
            )
        # The normal's own direction gets the spread of the others: no change along it, and
        # something to divide by.
        spread = xx + yy + zz + 1e-9
        xx, yy, zz = (
            xx + spread * (nx * nx + 1e-3),
            yy + spread * (ny * ny + 1e-3),
            zz + spread * (nz * nz + 1e-3),
        )
        xy, xz, yz = xy + spread * nx * ny, xz + spread * nx * nz, yz + spread * ny * nz
        a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
        d, e, f = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
        size = xx * a + xy * b + xz * c
        slope[i, 0] = (a * x_light + b * y_light + c * z_light) / size
        slope[i, 1] = (b * x_light + d * y_light + e * z_light) / size
        slope[i, 2] = (c * x_light + e * y_light + f * z_light) / size


def _aligned(
    views: tuple[_View, ...], names: tuple[str, ...], settings: Settings
) -> tuple[Float64, Float64]:
    """Rotations and translations of all views."""
    rotations = np.tile(np.eye(3), (len(views), 1, 1))
    translations = np.zeros((len(views), 3))
    middle = np.mean([view.points.mean(axis=0) for view in views], axis=0)
    pairs = [(i, j) for i in range(len(views)) for j in range(len(views)) if i != j]
    for level, reach_m in enumerate(settings.reach_m):
        known = False
        count = _SAMPLES >> (len(settings.reach_m) - 1 - level)
        for _ in range(_ROUNDS_A_REACH):
            met = {
                pair: _partners(views, pair, rotations, translations, reach_m, count)
                for pair in pairs
            }
            if not known:
                pairs = _overlapping(met, names, settings.overlap)
                met, known = {pair: met[pair] for pair in pairs}, True
            step = _step(met, len(views), middle, (rotations, translations), settings)
            turn = Rotation.from_rotvec(step[:, :3]).as_matrix()
            rotations = turn @ rotations
            translations = (
                np.einsum("sij,sj->si", turn, translations - middle) + middle + step[:, 3:]
            )
            if np.abs(step).max() < _STILL * reach_m:
                break
    return rotations, translations


def _partners(
    views: tuple[_View, ...],
    pair: tuple[int, int],
    rotations: Float64,
    translations: Float64,
    reach_m: float,
    count: int,
) -> _Partners:
    one, other = views[pair[0]], views[pair[1]]
    sample = one.sample[:count]
    turn, back = rotations[pair[0]], rotations[pair[1]]
    at = one.points[sample] @ turn.T + translations[pair[0]]
    looked_up = (at - translations[pair[1]]) @ back
    near = other.around.nearest(looked_up, 1, reach_m)[0][:, 0]
    met = np.flatnonzero(near >= 0)
    mine, theirs = sample[met], near[met]
    normal = other.normals[theirs] @ back.T
    alike = np.einsum("ij,ij->i", one.normals[mine] @ turn.T, normal) > _ALIKE
    met, mine, theirs, normal = met[alike], mine[alike], theirs[alike], normal[alike]
    partner = other.points[theirs] @ back.T + translations[pair[1]]
    return _Partners(
        at[met],
        at[met] - partner,
        normal,
        other.slope[theirs] @ back.T,
        one.shade[mine] - other.shade[theirs],
        len(met) / len(at),
    )


def _overlapping(
    met: dict[tuple[int, int], _Partners], names: tuple[str, ...], needed: float
) -> list[tuple[int, int]]:
    """The pairs that overlap.

    Raises:
        InputError: They leave some stations apart from the others.
    """
    share = {pair: max(each.share, met[pair[::-1]].share) for pair, each in met.items()}
    pairs = [pair for pair in met if share[pair] >= needed]
    group = components(np.array(pairs, np.int64).reshape(-1, 2), len(names))
    apart = {pair: part for pair, part in share.items() if group[pair[0]] != group[pair[1]]}
    if apart:
        one, other = max(apart, key=lambda pair: apart[pair])
        raise InputError(
            f"stations {names[one]} and {names[other]}: expected an overlap of {needed:.0%} or "
            f"more, found {apart[one, other]:.0%}",
            "check their `pose`, or give each part a room of its own",
        )
    return pairs


def _step(
    met: dict[tuple[int, int], _Partners],
    count: int,
    middle: Float64,
    pose: tuple[Float64, Float64],
    settings: Settings,
) -> Float64:
    """(count, 6) turn about the middle, and shift, of each view."""
    square = np.zeros((count, 6, count, 6))
    side = np.zeros((count, 6))
    for (i, j), each in met.items():
        distance = np.einsum("ij,ij->i", each.gap, each.normal)
        drift = each.contrast - np.einsum("ij,ij->i", each.slope, each.gap)
        for error, direction, least in (
            (distance, each.normal, _LEAST_NOISE_M),
            (drift - np.median(drift), -each.slope, _LEAST_SHADE),
        ):
            weight = _robust(error, least)
            row = np.concatenate([np.cross(each.at - middle, direction), direction], axis=1)
            part = (row * weight[:, None]).T @ row
            pull = (row * weight[:, None]).T @ error
            square[i, :, i] += part
            square[j, :, j] += part
            square[i, :, j] -= part
            square[j, :, i] -= part
            side[i] -= pull
            side[j] += pull
    rotations, translations = pose
    gone = np.concatenate(
        [
            Rotation.from_matrix(rotations).as_rotvec(),
            np.einsum("sij,j->si", rotations, middle) + translations - middle,
        ],
        axis=1,
    )
    trust = 1 / settings.trust_m**2
    full = square.reshape(6 * count, 6 * count) + trust * np.eye(6 * count)
    step = np.linalg.solve(full, (side - trust * gone).reshape(-1))
    return np.asarray(step.reshape(count, 6))


def _robust(error: Float64, least: float) -> Float64:
    """Tukey's biweight over the errors' own variance."""
    sigma = max(1.4826 * float(np.median(np.abs(error))), least)
    inside = np.maximum(1 - np.square(error / (_TUKEY * sigma)), 0)
    return np.asarray(np.square(inside) / sigma**2)
