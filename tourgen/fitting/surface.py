"""Fitting the surface: each of its stages with lengths that follow from the scan's spacing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from tourgen.errors import InputError
from tourgen.fitting.lengths import Corner, corners, detail_m, support_m
from tourgen.geometry import Float64, Mesh, OrientedCloud
from tourgen.remote import local
from tourgen.scans import Frame, read_mesh
from tourgen.stages import inferred, levels, measure, register, trim
from tourgen.stages.mesh_arrays import vertex_normals
from tourgen.stages.sift import Sifted
from tourgen.stages.spacing import Spacing
from tourgen.stages.surface import auto, ball_pivoting, crust, poisson, signed_distance
from tourgen.threads import threads
from tourgen.tour import Room
from tourgen.tour import Surface as Asked

VERSION = sum(method.VERSION for method in (auto, ball_pivoting, crust, poisson, signed_distance))
_NEAR_M = 0.2
_SAMPLE = 10_000


@dataclass(frozen=True, slots=True)
class Drawing:
    """What [room.surface] asks for, as pairs."""

    keys: tuple[tuple[str, object], ...]


@dataclass(frozen=True, slots=True)
class Drawn:
    """A surface, and how it came to be.

    Attributes:
        mesh: The surface.
        told: Which method drew it and why, for the report.
    """

    mesh: Mesh
    told: str


@dataclass(frozen=True, slots=True)
class Detail:
    """The finest detail asked for, millimetres; None follows from the scan."""

    detail_mm: float | None


@dataclass(frozen=True, slots=True)
class Trimming:
    """Boxes in which a surface stays whatever the scanner saw through it.

    None where the surface closes nothing that it should not: all of it stays.
    """

    closed: tuple[tuple[Corner, Corner], ...] | None


@dataclass(frozen=True, slots=True)
class Mended:
    """A mesh made elsewhere."""

    file: str
    unit: str
    up: str


def drawing(asked: Asked) -> Drawing:
    """What of [room.surface] bears on the surface."""
    return Drawing(tuple(asked.model_dump().items()))


def drawn(asked: Asked, oriented: OrientedCloud, spacing: Spacing, _: Drawing) -> Drawn:
    """Draw the surface by the method asked for; the settings are the same, for the key."""
    detail = detail_m(spacing, asked.detail_mm)
    found = _METHODS[asked.method](oriented, spacing, asked, detail)
    return replace(found, mesh=_moved(found.mesh, asked.offset_mm / 1000))


def _by_auto(o: OrientedCloud, spacing: Spacing, asked: Asked, detail: float) -> Drawn:
    chosen = auto.auto(
        o,
        auto.Settings(
            _distance(spacing, asked, detail),
            poisson.Settings(detail),
        ),
    )
    apart = f"points lie {1000 * spacing.median_m:.0f} mm apart in the middle"
    if chosen.dense_share == 0:
        return Drawn(chosen.mesh, f"poisson: {apart}, too far for tangent planes to meet")
    return Drawn(
        chosen.mesh,
        f"signed-distance on {chosen.dense_share:.1%} of the area, where the scan is dense "
        f"({apart}); the winding number on the rest, across its gaps",
    )


def _by_poisson(o: OrientedCloud, _: Spacing, asked: Asked, detail: float) -> Drawn:
    settings = poisson.Settings(
        detail,
        asked.depth or 0,
        asked.full_depth,
        asked.samples_per_node,
        asked.point_weight,
        asked.linear_fit,
    )
    return Drawn(poisson.poisson(o, settings), "poisson: as asked for")


def _by_balls(o: OrientedCloud, spacing: Spacing, asked: Asked, _: float) -> Drawn:
    radii_m = (
        tuple(radius / 1000 for radius in asked.radii_mm)
        if asked.radii_mm
        else ball_pivoting.radii(spacing.median_m)
    )
    settings = ball_pivoting.Settings(radii_m, asked.agree_deg)
    return Drawn(ball_pivoting.ball_pivoting(o, settings), "ball-pivoting: as asked for")


def _by_distance(o: OrientedCloud, spacing: Spacing, asked: Asked, detail: float) -> Drawn:
    mesh = signed_distance.signed_distance(o, _distance(spacing, asked, detail))
    return Drawn(mesh, "signed-distance: as asked for")


def _by_crust(o: OrientedCloud, spacing: Spacing, asked: Asked, _: float) -> Drawn:
    settings = crust.Settings(spacing.median_m, asked.filter_deg)
    return Drawn(crust.crust(o, settings), "crust: as asked for")


_METHODS = {
    "auto": _by_auto,
    "poisson": _by_poisson,
    "ball-pivoting": _by_balls,
    "signed-distance": _by_distance,
    "crust": _by_crust,
}
_CLOSING = ("auto", "poisson")
"""The methods that close every gap, openings too."""


def _distance(spacing: Spacing, asked: Asked, detail: float) -> signed_distance.Settings:
    return signed_distance.Settings(
        detail,
        spacing.median_m,
        neighbours=asked.neighbours,
        crease_deg=asked.crease_deg,
        reach=asked.reach,
    )


def _moved(mesh: Mesh, offset_m: float) -> Mesh:
    """The mesh moved along its normals."""
    if not offset_m:
        return mesh
    return replace(mesh, vertices=mesh.vertices + np.float32(offset_m) * vertex_normals(mesh))


def trimming(room: Room) -> Trimming:
    """What is to be opened in a room's surface, if anything."""
    closing = room.mesh is None and room.surface.method in _CLOSING
    return Trimming(tuple(corners(box) for box in room.closed) if closing else None)


def trimmed(
    found: Drawn, oriented: OrientedCloud, kept: Sifted, spacing: Spacing, asked: Trimming
) -> Mesh:
    """Open the openings."""
    mesh = found.mesh
    if asked.closed is None:
        return mesh
    closed = tuple(
        (_from_origin(low, mesh.origin), _from_origin(high, mesh.origin))
        for low, high in asked.closed
    )
    return trim.trim(mesh, oriented, kept.cloud, trim.Settings(support_m(spacing), closed=closed))


def _from_origin(corner: Corner, origin: Float64) -> Corner:
    x, y, z = (float(value) for value in np.subtract(corner, origin))
    return x, y, z


def mended(room: Room, folder: Path, kept: Sifted, asked: Mended) -> Drawn:
    """Take a surface made elsewhere; the settings are those of the room, for the key.

    Raises:
        InputError: It is no mesh, or lies elsewhere than the scan.
    """
    frame, cloud = Frame.of(room.unit_m, room.up), kept.cloud
    mesh = read_mesh(local(folder, asked.file), asked.file, frame, cloud.origin)
    sample = cloud.points[:: max(1, len(cloud) // _SAMPLE)]
    away, _ = cKDTree(mesh.vertices[mesh.faces].mean(axis=1)).query(sample, workers=threads())
    off_m = float(np.median(away))
    if off_m > max(_NEAR_M, 0.1 * float(np.ptp(sample, axis=0).max())):
        raise InputError(
            f"`{asked.file}`: expected the surface where the scan is, found it {off_m:.2g} m off",
            f"export it in the coordinates of `{room.scans[0].file}`; .glb is y-up",
        )
    return Drawn(mesh, f"made elsewhere: `{asked.file}`")


def levelled(mesh: Mesh, spacing: Spacing, asked: Detail) -> levels.Levels:
    """Simplify to the finest and the coarsest level."""
    return levels.levels(mesh, levels.Settings(detail_m(spacing, asked.detail_mm)))


def measured(
    simplified: levels.Levels,
    kept: Sifted,
    joined: register.Registered,
    spacing: Spacing,
    asked: Detail,
) -> measure.Quality:
    """Compare the finest mesh with the scan."""
    settings = inferred.Settings(detail_m(spacing, asked.detail_mm))
    return measure.measure(simplified.finest, kept.cloud, joined.stations, settings)
