"""Normals: calm on walls, sharp at creases, and on the free side also where no station is known."""

from __future__ import annotations

import numpy as np
import pytest

from tourgen.geometry import PointCloud
from tourgen.stages import normals
from tourgen.stages.tangent import tangent_planes

NOISE_M = 0.002
SPACING_M = 0.012


def wall(
    low: list[float], u: list[float], v: list[float], seed: int, spacing_m: float = SPACING_M
) -> np.ndarray:
    """Points spread evenly over a parallelogram, with noise across it."""
    rng = np.random.default_rng(seed)
    u_m, v_m = np.array(u), np.array(v)
    across = np.cross(u_m, v_m)
    area = np.linalg.norm(across)
    a, b = rng.random((2, int(area / spacing_m**2), 1))
    noise = rng.normal(0, NOISE_M, (len(a), 1))
    return np.array(low) + a * u_m + b * v_m + noise * across / area


def cloud(points: np.ndarray, station: int = -1) -> PointCloud:
    return PointCloud(
        np.zeros(3),
        np.asarray(points, np.float32),
        np.full((len(points), 3), 128, np.uint8),
        np.full(len(points), station, np.int16),
    )


def angle_deg(normal: np.ndarray, axis: list[float]) -> np.ndarray:
    return np.degrees(np.arccos(np.clip(np.abs(normal @ np.array(axis)), 0, 1)))


def test_calm_on_walls_and_sharp_along_creases() -> None:
    floor = wall([0, 0, 0], [0.8, 0, 0], [0, 0.8, 0], 0)
    side = wall([0, 0, 0], [0, 0.8, 0], [0, 0, 0.8], 1)
    normal = tangent_planes(np.float32(np.concatenate([floor, side])), 12, 48)[: len(floor)]
    error = angle_deg(normal, [0, 0, 1])
    inner = (floor[:, :2] > 0.1).all(axis=1) & (floor[:, :2] < 0.7).all(axis=1)
    assert np.sqrt((error[inner] ** 2).mean()) < 2.0
    along = (floor[:, 0] > 0.010) & (floor[:, 0] < 0.025) & (np.abs(floor[:, 1] - 0.4) < 0.3)
    assert np.median(error[along]) < 3.0
    assert np.quantile(error[along], 0.9) < 12.0


@pytest.mark.parametrize(
    "points",
    [
        pytest.param(np.zeros((1000, 3)), id="duplicates"),
        pytest.param(np.linspace(0, 1, 500)[:, None] * [1.0, 2.0, 3.0], id="a line"),
        pytest.param(np.random.default_rng(0).random((20, 3)), id="fewer than neighbours"),
    ],
)
def test_odd_clouds_get_unit_normals(points: np.ndarray) -> None:
    normal = tangent_planes(np.float32(points), 12, 48)
    assert np.allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-4)


def furnished() -> tuple[np.ndarray, np.ndarray]:
    """A room of 2 x 2 x 2 m with a table's slab of 120 mm, an alcove, a window; free sides."""
    sheets = [
        ([0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 1]),
        ([0, 0, 2], [2, 0, 0], [0, 2, 0], [0, 0, -1]),
        ([0, 0, 0], [2, 0, 0], [0, 0, 2], [0, 1, 0]),
        ([0, 2, 0], [2, 0, 0], [0, 0, 2], [0, -1, 0]),
        ([0, 0, 0], [0, 2, 0], [0, 0, 2], [1, 0, 0]),
        ([2, 0, 0], [0, 0.6, 0], [0, 0, 2], [-1, 0, 0]),  # from 0.6 to 1.4 an alcove opens
        ([2, 1.4, 0], [0, 0.6, 0], [0, 0, 2], [-1, 0, 0]),
        ([2, 0.6, 0], [0.5, 0, 0], [0, 0, 2], [0, 1, 0]),
        ([2, 1.4, 0], [0.5, 0, 0], [0, 0, 2], [0, -1, 0]),
        ([2.5, 0.6, 0], [0, 0.8, 0], [0, 0, 2], [-1, 0, 0]),
        ([0.5, 0.5, 0.7], [1, 0, 0], [0, 0.8, 0], [0, 0, 1]),
        ([0.5, 0.5, 0.58], [1, 0, 0], [0, 0.8, 0], [0, 0, -1]),
        ([0.5, 0.5, 0.58], [1, 0, 0], [0, 0, 0.12], [0, -1, 0]),
        ([0.5, 1.3, 0.58], [1, 0, 0], [0, 0, 0.12], [0, 1, 0]),
        ([0.5, 0.5, 0.58], [0, 0.8, 0], [0, 0, 0.12], [-1, 0, 0]),
        ([1.5, 0.5, 0.58], [0, 0.8, 0], [0, 0, 0.12], [1, 0, 0]),
    ]
    points = [wall(low, u, v, seed, 0.02) for seed, (low, u, v, _) in enumerate(sheets)]
    free = np.repeat([sheet[3] for sheet in sheets], [len(part) for part in points], axis=0)
    every = np.concatenate(points)
    window = (every[:, 1] < 0.01) & (np.abs(every[:, ::2] - [1.0, 1.3]) < 0.3).all(axis=1)
    return every[~window], free[~window]


@pytest.mark.parametrize(
    "given",
    [
        pytest.param([], id="no station"),
        pytest.param([[1.0, 1.5, 1.4]], id="one station, which sees one side of the table"),
    ],
)
def test_normals_look_into_the_free_space(given: list[list[float]]) -> None:
    points, free = furnished()
    known = np.array(given).reshape(-1, 3)
    oriented = normals.normals(cloud(points), known, normals.Settings())
    right = np.einsum("ij,ij->i", oriented.normals, free) > 0
    assert right.mean() > 0.985


def test_stations_that_see_through_a_sparse_surface_are_not_believed() -> None:
    """Two stations, one on either side of a sheet as sparse as the far walls, see both its sides.

    That cannot be of a single sheet with one free side; here it is thick, and both are right.
    """
    rng = np.random.default_rng(0)
    points = rng.random((3000, 3)) * [4, 0, 2.6] + [-2, 0, 0]
    points[:, 1] = rng.choice([-0.05, 0.05], 3000)
    stations = np.array([[0, -1.0, 1.3], [0, 1.0, 1.3]])
    free = np.sign(points[:, 1:2]) * [0, 1, 0]
    sides = np.float32(free)
    seen, contradicted = normals._look_at_seeing(
        sides.copy(), np.float32(points), stations, cell_deg=0.5
    )
    assert seen.mean() > 0.95
    assert contradicted > normals.Settings().contradicted


def test_a_station_in_the_plane_of_a_wall_does_not_tell_its_side() -> None:
    """Its beams ran along the wall: what they met looks where what others met around it does."""
    rows = wall([0, 0, 0], [2, 0, 0], [0, 0, 2], 0)
    strip = wall([0.9, 0, 0], [0.01, 0, 0], [0, 0, 2], 1, 0.01) * [1, 0.1, 1]
    both = cloud(np.concatenate([rows, strip]))
    both.station[: len(rows)] = 0
    both.station[len(rows) :] = 1
    stations = np.array([[1.0, 2.0, 1.0], [-1.5, 0.0005, 1.0]])
    oriented = normals.normals(both, stations, normals.Settings())
    assert np.all(oriented.normals[:, 1] > 0)
