"""Fitting the surface: each of its stages with lengths that follow from the scan's spacing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tourgen.fitting.lengths import Corner, detail_m, support_m
from tourgen.geometry import Float64, Mesh, OrientedCloud, PointCloud
from tourgen.stages import levels, measure, trim
from tourgen.stages.spacing import Spacing
from tourgen.stages.surface import poisson


@dataclass(frozen=True, slots=True)
class Detail:
    """The finest detail asked for, millimetres; None follows from the scan."""

    detail_mm: float | None


@dataclass(frozen=True, slots=True)
class Solving:
    """The octree asked for; a depth of None follows from the room's size and the detail."""

    detail_mm: float | None
    depth: int | None


@dataclass(frozen=True, slots=True)
class Trimming:
    """Boxes in which a surface stays whatever the scanner saw through it."""

    closed: tuple[tuple[Corner, Corner], ...]


def solved(oriented: OrientedCloud, spacing: Spacing, asked: Solving) -> Mesh:
    """Solve for the surface, cells as wide as the detail."""
    settings = poisson.Settings(detail_m(spacing, asked.detail_mm), asked.depth or 0)
    return poisson.poisson(oriented, settings)


def trimmed(
    mesh: Mesh, oriented: OrientedCloud, cloud: PointCloud, spacing: Spacing, asked: Trimming
) -> Mesh:
    """Open the openings."""
    closed = tuple(
        (_from_origin(low, mesh.origin), _from_origin(high, mesh.origin))
        for low, high in asked.closed
    )
    return trim.trim(mesh, oriented, cloud, trim.Settings(support_m(spacing), closed=closed))


def _from_origin(corner: Corner, origin: Float64) -> Corner:
    x, y, z = (float(value) for value in np.subtract(corner, origin))
    return x, y, z


def levelled(mesh: Mesh, spacing: Spacing, asked: Detail) -> levels.Levels:
    """Simplify to the finest and the coarsest level."""
    return levels.levels(mesh, levels.Settings(detail_m(spacing, asked.detail_mm)))


def measured(simplified: levels.Levels, cloud: PointCloud, spacing: Spacing) -> measure.Quality:
    """Compare the finest mesh with the scan."""
    return measure.measure(simplified.finest, cloud, measure.Settings(support_m(spacing)))
