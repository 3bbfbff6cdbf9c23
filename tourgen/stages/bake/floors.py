"""Floors: their picture goes on under tripods and furniture, where nobody saw it.

Each floor on which a scanner stood is drawn as a picture seen from above. What the scan does not
show of it is continued from the rest, and becomes points to be baked like those of the scan.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64, Mesh, OrientedCloud, PointCloud
from tourgen.neighbours import Neighbours
from tourgen.rays import ray_scene, rays_of
from tourgen.stages.bake.exemplars import continued
from tourgen.stages.bake.points import Settings, color_index, of_points
from tourgen.stages.bake.texels import Texels, to_bytes
from tourgen.stages.floor import LAID
from tourgen.stages.spacing import FOURTH, spacing_at

Bool = npt.NDArray[np.bool_]

_STOREY_M = 0.02  # discs that lie lower or higher than this are other floors
_OFF_M = 0.015  # points farther from the plane are no floor
_NEAR_M = 0.04  # the surface is the floor where it lies so near to the plane
_PIXEL_OF_SPACING = 0.75
_WIDEST_PX = 1024
_SAMPLES = 500


def continued_floors(
    cloud: PointCloud, oriented: OrientedCloud, surface: Mesh, settings: Settings
) -> PointCloud:
    """The points that floors lack.

    Args:
        cloud: Every point kept by cleaning.
        oriented: Points with normals, among them those laid where scanners stood.
        surface: The room.
        settings: Where the texel of a floor has no support, it is continued.

    Returns:
        Points of station ``LAID``, on the planes of the floors.
    """
    laid = oriented.cloud.points[oriented.cloud.station == LAID]
    laid = laid[np.argsort(laid[:, 2], kind="stable")]
    storeys = np.split(laid, np.flatnonzero(np.diff(laid[:, 2]) > _STOREY_M) + 1)
    floors = [_continued(each, cloud, oriented, surface, settings) for each in storeys if len(each)]
    points = [np.empty((0, 3), np.float32), *(points for points, _ in floors)]
    colors = [np.empty((0, 3), np.uint8), *(to_bytes(colors) for _, colors in floors)]
    count = sum(map(len, points))
    return PointCloud(
        cloud.origin,
        np.concatenate(points),
        np.concatenate(colors),
        np.full(count, LAID, np.int16),
    )


def _continued(
    laid: Float32, cloud: PointCloud, oriented: OrientedCloud, surface: Mesh, settings: Settings
) -> tuple[Float32, Float32]:
    """Points and colours that the floor through some laid points lacks."""
    plane, *_ = np.linalg.lstsq(_with_one(laid), laid[:, 2].astype(np.float64), rcond=None)
    near = cloud.take(np.abs(cloud.points[:, 2] - _with_one(cloud.points) @ plane) < _OFF_M)
    if not len(near):
        return np.empty((0, 3), np.float32), np.empty((0, 3), np.float32)
    around = Neighbours.of(near.points, FOURTH)
    rng = np.random.default_rng(0)
    sample = near.points[rng.choice(len(near), min(_SAMPLES, len(near)), replace=False)]
    low = near.points[:, :2].min(0)
    extent_m = near.points[:, :2].max(0) - low
    pixel_m = max(
        _PIXEL_OF_SPACING * float(np.median(spacing_at(around, sample))),
        float(extent_m.max()) / _WIDEST_PX,
    )
    columns, rows = (int(np.ceil(side / pixel_m)) for side in extent_m)
    row, column = (each.ravel() for each in np.mgrid[:rows, :columns])
    at = low + (np.stack([column, row], axis=1) + 0.5) * pixel_m
    places = np.column_stack([at, _with_one(at) @ plane]).astype(np.float32)
    own = _is_floor(places, surface, plane)
    told = around.nearest(places, 1, settings.reach_m)[0][:, 0] >= 0
    shown = np.flatnonzero(told)
    picture = np.zeros((rows * columns, 3), np.float32)
    index = color_index(near, oriented, pixel_m)
    texels = _texels(row[shown], column[shown], places[shown])
    alone = np.zeros(len(shown), np.float32)
    picture[shown] = of_points(texels, index, pixel_m, settings, alone).colors
    whole, filled = continued(
        picture.reshape(rows, columns, 3),
        told.reshape(rows, columns),
        (own & ~told).reshape(rows, columns),
    )
    new = filled.ravel()
    return places[new], whole.reshape(-1, 3)[new]


def _with_one(points: npt.NDArray[np.floating]) -> Float64:
    """(n, 3) x, y and 1."""
    return np.column_stack([points[:, :2], np.ones(len(points))]).astype(np.float64)


def _is_floor(places: Float32, surface: Mesh, plane: npt.NDArray[np.floating]) -> Bool:
    """(n,) where the surface lies at a place of the plane."""
    down = np.array([0, 0, -1], np.float32)
    above = places + _NEAR_M * np.array([0, 0, 1], np.float32)
    height_m = (surface.vertices[:, 2] - _with_one(surface.vertices) @ plane)[surface.faces]
    near = (height_m.min(axis=1) < 2 * _NEAR_M) & (height_m.max(axis=1) > -2 * _NEAR_M)
    if not near.any():
        return np.zeros(len(places), np.bool_)
    scene = ray_scene(surface.vertices, surface.faces[near])
    hit = scene.cast_rays(rays_of(above, np.broadcast_to(down, above.shape)))["t_hit"].numpy()
    return np.asarray(hit < 2 * _NEAR_M)


def _texels(row: npt.NDArray[np.int64], column: npt.NDArray[np.int64], places: Float32) -> Texels:
    """The pixels of a picture seen from above, in blocks of up to 2 x 2."""
    key = (row // 2) * (int(column.max(initial=0)) // 2 + 1) + column // 2
    _, block, sizes = np.unique(key, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(block, axis, len(sizes)) for axis in places.T], axis=1)
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), sums.shape)
    return Texels(row, column, block, places, sums / sizes[:, None], up)
