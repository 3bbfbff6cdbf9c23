"""A terrestrial laser scanner with its faults, standing in a modelled room.

The faults are those of real scans: range noise, pixels mixed across depth edges, strays through
glass, ghosts behind mirrors, a burnt-out lamp, a passer-by, uneven exposure, registration error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64, UInt8
from tourgen.rays import ray_scene, rays_of
from tourgen.simulation.atlas import encode, sample
from tourgen.simulation.charts import Bools
from tourgen.simulation.model import RoomModel, TrueRoom, join

SURFACE, MIXED, STRAY, GHOST, PASSER_BY = range(5)
LABELS = ("surface", "mixed", "stray", "ghost", "passer_by")

NOISE_M, NOISE_PER_M = 0.0015, 0.0002
MIXED_SHARE = 1 / 3
EDGE_M = 0.03
STRAY_SHARE = 0.015
STRAY_RANGE_M = (6.0, 40.0)
DUST_SHARE = 0.05
GAIN, WHITE_BALANCE = 0.08, 0.03
SHIFT_M = (0.001, 0.002)
TURN_DEG = 0.01
LOWEST_DEG = -60.0
GLARE_DEG = 4.0
BLOCK = 600_000
SPARE = 1.015


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a scanner stands: world = rotation @ local + position.

    Attributes:
        rotation: (3, 3) float64.
        position: (3,) float64, metres.
    """

    rotation: Float64
    position: Float64


@dataclass(frozen=True, slots=True)
class Station:
    """A scanner's place and its own faults.

    Attributes:
        true: Where it stands.
        believed: Where the registration puts it.
        gain: (3,) factor on its colours.
    """

    true: Pose
    believed: Pose
    gain: Float64


@dataclass(frozen=True, slots=True)
class Grid:
    """Regular azimuth and elevation; row 0 is the lowest.

    Attributes:
        rows, columns: Their numbers.
        lowest, step: Elevation of row 0 and between rows, radians.
    """

    rows: int
    columns: int
    lowest: float
    step: float

    @classmethod
    def of_step(cls, step_deg: float) -> Grid:
        """Beams ``step_deg`` apart from -60 degrees up to the zenith."""
        rows = int((90 - LOWEST_DEG) / step_deg)
        return cls(
            rows,
            round(360 / step_deg),
            float(np.radians(LOWEST_DEG + step_deg / 2)),
            float(np.radians(step_deg)),
        )

    def directions(self, first: int, last: int) -> Float64:
        """(n, 3) local unit vectors of some rows, row by row."""
        elevation = self.lowest + self.step * np.arange(first, last)
        azimuth = 2 * np.pi * np.arange(self.columns) / self.columns
        flat = np.cos(elevation)[:, None]
        z = np.broadcast_to(np.sin(elevation)[:, None], (last - first, self.columns))
        return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=-1).reshape(-1, 3)


@dataclass(frozen=True, slots=True)
class Returns:
    """What came back, n points.

    Attributes:
        local: (n, 3) float32, metres in the scanner's own frame.
        colors: (n, 3) uint8, sRGB.
        label: (n,) uint8, index into ``LABELS``.
        row, column: (n,) uint16, place in the grid.
    """

    local: Float32
    colors: UInt8
    label: UInt8
    row: npt.NDArray[np.uint16]
    column: npt.NDArray[np.uint16]

    def __len__(self) -> int:
        return len(self.local)

    def take(self, index: npt.NDArray[np.generic]) -> Returns:
        """Some of them."""
        return Returns(
            self.local[index],
            self.colors[index],
            self.label[index],
            self.row[index],
            self.column[index],
        )

    @classmethod
    def joined(cls, parts: list[Returns]) -> Returns:
        """All of them in one."""
        return cls(
            np.concatenate([p.local for p in parts]),
            np.concatenate([p.colors for p in parts]),
            np.concatenate([p.label for p in parts]),
            np.concatenate([p.row for p in parts]),
            np.concatenate([p.column for p in parts]),
        )


@dataclass(frozen=True, slots=True)
class Beams:
    """Noiseless answers to n beams.

    Attributes:
        reach: (n,) float64, metres, infinite where nothing came back.
        colors: (n, 3) uint8, sRGB, before the station's gain.
        label: (n,) uint8.
        slope: (n,) float64, tangent of the incidence.
    """

    reach: Float64
    colors: UInt8
    label: UInt8
    slope: Float64


class Scenery:
    """The ray casting scenes of one room: its surfaces, and the person who passes by."""

    def __init__(self, model: RoomModel, truth: TrueRoom) -> None:
        """Build the scenes."""
        self._truth = truth
        self._openings = model.openings
        self._lamps = np.array([lamp.position for lamp in model.lamps]).reshape(-1, 3)
        self._room = ray_scene(truth.mesh.vertices, truth.mesh.faces)
        mirrors = np.array([part.material.mirror for part in model.charts])
        self._mirror_face = mirrors[truth.mesh.face_chart]
        body = join(model.passer_by)
        self._body = body
        self._person = ray_scene(body.vertices, body.faces)
        albedo = np.concatenate(
            [
                p.material.paint(p.paint.reshape(-1, 2).astype(np.float32), (1.0, 1.0))
                for p in model.passer_by
            ]
        )
        lit = 0.75 + 0.35 * body.normals[:, 2:] + 0.15 * body.normals[:, :1]
        self._body_colors = encode((albedo * lit).astype(np.float32))

    def look(
        self, origin: Float64, directions: Float64, *, passer_by: bool, rng: np.random.Generator
    ) -> Beams:
        """Send beams from one place; ``passer_by`` says whether the person is there."""
        origins = np.broadcast_to(origin, directions.shape)
        reach, colors, slope, on_mirror = self._cast(origins, directions)
        label = np.full(len(directions), SURFACE, dtype=np.uint8)
        thrown = np.nonzero(on_mirror & (rng.random(len(directions)) > DUST_SHARE))[0]
        if len(thrown):
            self._reflect(origins, directions, thrown, reach, colors, label, slope)
        if passer_by:
            self._meet(origins, directions, reach, colors, label, slope)
        self._glare(origin, directions, colors)
        return Beams(reach, colors, label, slope)

    def _cast(self, origins: Float64, directions: Float64) -> tuple[Float64, UInt8, Float64, Bools]:
        answer = self._room.cast_rays(rays_of(origins, directions))
        reach = answer["t_hit"].numpy().astype(np.float64)
        found = np.isfinite(reach)
        face = np.where(found, answer["primitive_ids"].numpy(), 0).astype(np.int64)
        corner = self._truth.mesh.faces[face]
        b = answer["primitive_uvs"].numpy()
        uv = self._truth.uv
        at = (
            uv[corner[:, 0]] * (1 - b.sum(axis=1))[:, None]
            + uv[corner[:, 1]] * b[:, :1]
            + uv[corner[:, 2]] * b[:, 1:]
        )
        colors = sample(self._truth.texture, at)
        slope = _slope(directions, answer["primitive_normals"].numpy())
        return reach, colors, slope, found & self._mirror_face[face]

    def _reflect(
        self,
        origins: Float64,
        directions: Float64,
        index: Any,
        reach: Float64,
        colors: UInt8,
        label: UInt8,
        slope: Float64,
    ) -> None:
        """Follow beams that a mirror throws back; in place."""
        answer = self._room.cast_rays(rays_of(origins[index], directions[index]))
        normal = answer["primitive_normals"].numpy().astype(np.float64)
        inward = directions[index]
        thrown = inward - 2 * (inward * normal).sum(axis=1, keepdims=True) * normal
        start = origins[index] + reach[index, None] * inward + 1e-4 * normal
        further, seen, lean, _ = self._cast(start, thrown)
        reach[index] += further
        colors[index] = (seen * 0.88).astype(np.uint8)
        label[index] = GHOST
        slope[index] = lean

    def _meet(
        self,
        origins: Float64,
        directions: Float64,
        reach: Float64,
        colors: UInt8,
        label: UInt8,
        slope: Float64,
    ) -> None:
        """Let the person stand in the way; in place."""
        answer = self._person.cast_rays(rays_of(origins, directions))
        near = answer["t_hit"].numpy()
        index = np.nonzero(near < reach)[0]
        corner = self._body.faces[answer["primitive_ids"].numpy()[index].astype(np.int64)]
        reach[index] = near[index]
        colors[index] = self._body_colors[corner[:, 0]]
        label[index] = PASSER_BY
        slope[index] = _slope(directions[index], answer["primitive_normals"].numpy()[index])

    def _glare(self, origin: Float64, directions: Float64, colors: UInt8) -> None:
        """Burn out what lies near a lamp in the camera's picture; in place."""
        for lamp in self._lamps:
            way = (lamp - origin) / np.linalg.norm(lamp - origin)
            angle = np.degrees(np.arccos(np.clip((directions * way).sum(axis=1), -1, 1)))
            near = np.nonzero(angle < 3 * GLARE_DEG)[0]
            burn = 340 * np.exp(-((angle[near] / GLARE_DEG) ** 2))
            colors[near] = np.minimum(colors[near] + burn[:, None], 255).astype(np.uint8)

    def strays(
        self, origin: Float64, directions: Float64, lost: Bools, rng: np.random.Generator
    ) -> Bools:
        """Which lost beams pass a pane and come back from outside all the same."""
        through = np.zeros(len(directions), dtype=np.bool_)
        index = np.nonzero(lost & (rng.random(len(directions)) < STRAY_SHARE))[0]
        for place in self._openings:
            if place.opening.glazed:
                through[index] |= place.leaves(
                    np.broadcast_to(origin, (len(index), 3)), directions[index]
                )
        return through


def _slope(directions: Float64, normals: Float32) -> Float64:
    facing = np.clip(np.abs((directions * normals).sum(axis=1)), 0.02, 1.0)
    slope: Float64 = np.sqrt(1 - facing**2) / facing
    return slope


def stations_of(model: RoomModel, rng: np.random.Generator) -> list[Station]:
    """Stations with headings, registration errors and exposures drawn at random."""
    found: list[Station] = []
    for position in model.stations:
        heading = rng.uniform(0, 2 * np.pi)
        true = Pose(_turn(np.array([0.0, 0.0, 1.0]), heading), np.asarray(position, float))
        axis = _unit(rng)
        shift = _unit(rng) * rng.uniform(*SHIFT_M)
        error = _turn(axis, np.radians(TURN_DEG))
        believed = Pose(error @ true.rotation, true.position + shift)
        gain = rng.uniform(1 - GAIN, 1 + GAIN) * rng.uniform(
            1 - WHITE_BALANCE, 1 + WHITE_BALANCE, 3
        )
        found.append(Station(true, believed, gain))
    return found


def _unit(rng: np.random.Generator) -> Float64:
    v = rng.normal(size=3)
    unit: Float64 = v / np.linalg.norm(v)
    return unit


def _turn(axis: Float64, angle: float) -> Float64:
    """Rodrigues' rotation matrix."""
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned: Float64 = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)
    return turned


def rotated(vectors: Float64, rotation: Float64) -> Float64:
    """(n, 3) vectors turned by a matrix, always summed in the same order."""
    return np.stack([(vectors * rotation[k]).sum(axis=1) for k in range(3)], axis=1)


def share_of_returns(scenery: Scenery, stations: list[Station]) -> float:
    """Returns per square degree of grid, all stations together, from a coarse look round."""
    grid = Grid.of_step(1.0)
    local = grid.directions(0, grid.rows)
    total = 0
    for station in stations:
        beams = scenery.look(
            station.true.position,
            rotated(local, station.true.rotation),
            passer_by=False,
            rng=np.random.default_rng(0),
        )
        total += int(np.isfinite(beams.reach).sum())
    return float(total)


def scan(
    scenery: Scenery, station: Station, grid: Grid, *, passer_by: bool, rng: np.random.Generator
) -> Returns:
    """All that one station measures."""
    parts = [
        _block(scenery, station, grid, rows, passer_by=passer_by, rng=rng) for rows in _blocks(grid)
    ]
    return Returns.joined(parts)


def _blocks(grid: Grid) -> Iterator[tuple[int, int]]:
    height = max(1, BLOCK // grid.columns)
    for first in range(0, grid.rows, height):
        yield first, min(first + height, grid.rows)


def _block(
    scenery: Scenery,
    station: Station,
    grid: Grid,
    rows: tuple[int, int],
    *,
    passer_by: bool,
    rng: np.random.Generator,
) -> Returns:
    first, last = rows
    above = min(last + 1, grid.rows)  # one more row, to see the depth edges of the last one
    local = grid.directions(first, above)
    world = rotated(local, station.true.rotation)
    beams = scenery.look(station.true.position, world, passer_by=passer_by, rng=rng)
    reach, colors, label = _mixed(beams, grid, rng)
    keep = (last - first) * grid.columns
    reach, colors, label = reach[:keep], colors[:keep], label[:keep]
    local, world = local[:keep], world[:keep]
    stray = scenery.strays(station.true.position, world, ~np.isfinite(reach), rng)
    reach[stray] = rng.uniform(*STRAY_RANGE_M, int(stray.sum()))
    sky = (
        150
        + 70 * np.clip(local[stray, 2:] + 0.4, 0, 1)
        + rng.normal(scale=12, size=(int(stray.sum()), 1))
    )
    colors[stray] = np.clip(sky + np.array([-14, 0, 12]), 0, 255).astype(np.uint8)
    label[stray] = STRAY
    noise = rng.normal(size=keep)
    found = np.nonzero(np.isfinite(reach))[0]
    far = reach[found] + noise[found] * (NOISE_M + NOISE_PER_M * reach[found])
    return Returns(
        local=(local[found] * far[:, None]).astype(np.float32),
        colors=exposed(colors[found], station.gain),
        label=label[found],
        row=(first + found // grid.columns).astype(np.uint16),
        column=(found % grid.columns).astype(np.uint16),
    )


def exposed(colors: UInt8, gain: Float64) -> UInt8:
    """Colours as the station's camera shows them."""
    return np.clip(np.round(colors * gain), 0, 255).astype(np.uint8)


def _mixed(beams: Beams, grid: Grid, rng: np.random.Generator) -> tuple[Float64, UInt8, UInt8]:
    """Ranges, colours and labels with a third of the depth edges blended across."""
    rows = len(beams.reach) // grid.columns
    reach = beams.reach.reshape(rows, grid.columns)
    slope = beams.slope.reshape(rows, grid.columns)
    upward = np.arange(rows * grid.columns).reshape(rows, grid.columns)
    out_reach, out_colors, out_label = beams.reach.copy(), beams.colors.copy(), beams.label.copy()
    for neighbour in (np.roll(upward, -1, axis=1), np.vstack([upward[1:], upward[-1:]])):
        other, lean = beams.reach[neighbour], beams.slope[neighbour]
        with np.errstate(invalid="ignore"):
            jump = np.abs(other - reach)
            expected = np.minimum(reach, other) * grid.step * np.maximum(slope, lean)
            edge = np.isfinite(jump) & (jump > EDGE_M + 3 * expected)
        edge &= rng.random(edge.shape) < MIXED_SHARE
        here, there = upward[edge], neighbour[edge]
        share = rng.uniform(0.1, 0.9, len(here))
        out_reach[here] = share * beams.reach[here] + (1 - share) * beams.reach[there]
        blend = share[:, None] * beams.colors[here] + (1 - share)[:, None] * beams.colors[there]
        out_colors[here] = blend.astype(np.uint8)
        out_label[here] = MIXED
    return out_reach, out_colors, out_label


def panorama(scenery: Scenery, station: Station, height: int, *, passer_by: bool) -> UInt8:
    """(h, 2h, 3) the station's picture; azimuth falls from +180 to -180 degrees to the right."""
    width = 2 * height
    azimuth = np.pi - 2 * np.pi * (np.arange(width) + 0.5) / width
    elevation = np.pi / 2 - np.pi * (np.arange(height) + 0.5) / height
    flat = np.cos(elevation)[:, None]
    z = np.broadcast_to(np.sin(elevation)[:, None], (height, width))
    local = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=-1).reshape(-1, 3)
    beams = scenery.look(
        station.true.position,
        rotated(local, station.true.rotation),
        passer_by=passer_by,
        rng=np.random.default_rng(0),
    )
    sky = np.clip(190 + 60 * local[:, 2:], 0, 255) + np.array([-10, 0, 5])
    colors = np.where(np.isfinite(beams.reach)[:, None], beams.colors, np.clip(sky, 0, 255)).astype(
        np.uint8
    )
    shown = exposed(colors, station.gain).reshape(height, width, 3)
    shown[elevation < np.radians(LOWEST_DEG)] = 0
    return shown
