"""Marching cubes: closed, one way round, and open only where the value is unknown."""

from __future__ import annotations

import numpy as np
import pytest
from sampled import euler_characteristic, faces_per_edge, runs_one_way, volume_m3

from tourgen.geometry import Float32, Mesh
from tourgen.stages.surface.marching_cubes import corner_of, key_of, marching_cubes

SIDE = 24


def grid() -> np.ndarray:
    axis = np.arange(SIDE)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)


def meshed(value: np.ndarray, corners: np.ndarray | None = None, steepest: float = np.inf) -> Mesh:
    key = key_of(grid() if corners is None else corners)
    low = np.zeros(3, np.float32)
    as_float: Float32 = value.astype(np.float32)
    return marching_cubes(key, as_float, low, 1.0, np.zeros(3), steepest=steepest)


def ball(radius: float = 8.3) -> np.ndarray:
    return np.asarray(np.linalg.norm(grid() - (SIDE - 1) / 2, axis=1) - radius)


def test_keys_are_sorted_like_their_corners_and_come_back() -> None:
    key = key_of(grid())
    assert np.all(np.diff(key) > 0)
    assert np.array_equal(corner_of(key), grid())


def test_a_ball_is_closed_and_seen_from_where_the_value_is_positive() -> None:
    mesh = meshed(ball())
    assert np.all(faces_per_edge(mesh) == 2)
    assert runs_one_way(mesh)
    assert euler_characteristic(mesh) == 2
    assert volume_m3(mesh) == pytest.approx(4 / 3 * np.pi * 8.3**3, rel=0.01)
    away = np.linalg.norm(mesh.vertices - (SIDE - 1) / 2, axis=1)
    assert np.abs(away - 8.3).max() < 0.02


def test_noise_of_every_case_is_closed_and_manifold() -> None:
    corners = grid()
    rim = np.any((corners == 0) | (corners == SIDE - 1), axis=1)
    value = np.where(rim, 1.0, np.random.default_rng(0).normal(size=len(corners)))
    cases = set()
    cube = value.reshape(SIDE, SIDE, SIDE) > 0
    for bit in range(8):
        x, y, z = bit & 1, bit >> 1 & 1, bit >> 2
        part = cube[x : SIDE - 1 + x, y : SIDE - 1 + y, z : SIDE - 1 + z]
        cases = part.astype(int) << bit if bit == 0 else cases + (part.astype(int) << bit)
    assert len(np.unique(cases)) == 256
    mesh = meshed(value)
    assert np.all(faces_per_edge(mesh) == 2)
    assert runs_one_way(mesh)


def test_cells_with_an_unknown_corner_stay_open() -> None:
    value = ball()
    value[grid()[:, 2] > 15] = np.nan
    mesh = meshed(value)
    assert mesh.vertices[:, 2].max() <= 15
    per_edge = faces_per_edge(mesh)
    assert per_edge.max() == 2
    assert 0 < (per_edge == 1).sum() < 100
    assert np.isfinite(mesh.vertices).all()


def test_missing_corners_are_as_unknown_ones() -> None:
    value, there = ball(), grid()[:, 2] <= 15
    unknown = np.where(there, value, np.nan)
    some, all_ = meshed(value[there], grid()[there]), meshed(unknown)
    assert np.array_equal(some.faces, all_.faces)
    assert np.array_equal(some.vertices, all_.vertices)


def test_a_jump_is_no_surface() -> None:
    corners = grid()
    jumps = np.where(corners[:, 0] < 10, 4.0, -4.0)
    assert len(meshed(jumps).faces)
    assert not len(meshed(jumps, steepest=1.2).faces)
    assert len(meshed(ball(), steepest=1.2).faces) == len(meshed(ball()).faces)


def test_nothing_crosses_nothing() -> None:
    assert not len(meshed(np.ones(SIDE**3)).faces)
    assert not len(meshed(np.full(SIDE**3, np.nan)).faces)


def test_a_value_of_nought_at_corners_makes_no_face_without_area() -> None:
    corners = grid()
    mesh = meshed((corners[:, 2] - 12).astype(float))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0.9
    diagonal = meshed((corners.sum(axis=1) - 30).astype(float))
    a, b, c = (diagonal.vertices[diagonal.faces[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0
