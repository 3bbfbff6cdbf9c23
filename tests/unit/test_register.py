"""Scans of several stations brought together."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tourgen.errors import InputError
from tourgen.geometry import PointCloud
from tourgen.stages import register

STATIONS = np.array([[-1.0, -0.8, 1.5], [1.0, 0.6, 1.5], [0.8, -0.9, 1.5]])
HALF_M = np.array([2.0, 1.6, 1.3])
SETTINGS = register.Settings(voxel_m=0.03)
MIDDLE = np.array([0, 0, 1.3])


def pattern(points: np.ndarray) -> np.ndarray:
    """Brightness that varies all over."""
    x, y, z = points.T
    wave = np.sin(5 * x + 2) + np.sin(6 * y + 1) + np.sin(4 * z) + np.sin(3 * (x + y + z))
    return np.clip(128 + 25 * wave, 0, 255)


Motion = tuple[np.ndarray, np.ndarray]
"""Turn and shift."""
Scan = Callable[[np.ndarray, int, int], np.ndarray]


def box_scan(eye: np.ndarray, count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    reach = ((np.where(way > 0, HALF_M, -HALF_M) + MIDDLE - eye) / way).min(axis=1)
    return eye + way * (reach + rng.normal(0, 0.002, count))[:, None]


def drum_scan(eye: np.ndarray, count: int, seed: int) -> np.ndarray:
    """A round room of 2 m, 2.6 m high, in which only colours tell one direction from another."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    flat = np.square(way[:, :2]).sum(axis=1)
    along = (way[:, :2] * eye[:2]).sum(axis=1)
    wall = (-along + np.sqrt(along**2 - flat * (eye[:2] @ eye[:2] - 4))) / flat
    level = (np.where(way[:, 2] > 0, 2.6, 0) - eye[2]) / way[:, 2]
    reach = np.minimum(wall, level)
    return eye + way * (reach + rng.normal(0, 0.002, count))[:, None]


def scanned(scan: Scan, stations: np.ndarray, moves: list[Motion]) -> tuple[PointCloud, np.ndarray]:
    """What stations saw, each moved by (R, t) afterwards."""
    parts = [scan(eye, 25_000, k) for k, eye in enumerate(stations)]
    light = np.concatenate([pattern(part) * (1 + 0.05 * k) for k, part in enumerate(parts)])
    colors = np.repeat(np.clip(light, 0, 255).astype(np.uint8)[:, None], 3, axis=1)
    points = np.concatenate(
        [part @ turn.T + shift for part, (turn, shift) in zip(parts, moves, strict=True)]
    )
    station = np.repeat(np.arange(len(parts), dtype=np.int16), [len(part) for part in parts])
    places = np.array(
        [turn @ eye + shift for eye, (turn, shift) in zip(stations, moves, strict=True)]
    )
    return PointCloud(np.zeros(3), np.float32(points), colors, station), places


def motion(about: np.ndarray, turn_deg: list[float], shift_m: list[float]) -> Motion:
    turn = Rotation.from_rotvec(np.radians(turn_deg)).as_matrix()
    return turn, about - turn @ about + np.array(shift_m)


STILL = (np.eye(3), np.zeros(3))


def left_over(registered: register.Registered, moves: list[Motion]) -> tuple[float, float]:
    """How far apart the room's middle comes out of each two stations, mm; and their turn, deg."""
    turns = [registered.rotations[k] @ turn for k, (turn, _) in enumerate(moves)]
    middles = [
        registered.rotations[k] @ (turn @ MIDDLE + shift) + registered.translations[k]
        for k, (turn, shift) in enumerate(moves)
    ]
    gap = max(float(np.linalg.norm(a - b)) for a in middles for b in middles)
    twist = max(Rotation.from_matrix(a @ b.T).magnitude() for a in turns for b in turns)
    return gap * 1000, float(np.degrees(twist))


@pytest.mark.parametrize("scan", [box_scan, drum_scan])
def test_stations_moved_apart_come_back(scan: Scan) -> None:
    moves = [STILL, motion(STATIONS[1], [0.5, -0.5, 0.7], [0.03, -0.03, 0.026]), STILL]
    given, places = scanned(scan, STATIONS, moves)
    registered = register.register(given, places, SETTINGS)
    gap_mm, twist_deg = left_over(registered, moves)
    assert gap_mm < 1.0
    assert twist_deg < 0.03
    assert registered.moved_mm.argmax() == 1
    assert registered.moved_mm[1] == pytest.approx(50, abs=2)
    assert registered.turned_deg[1] == pytest.approx(1, abs=0.05)
    assert registered.moved_mm[[0, 2]].max() < 2, "those that agree stay"
    assert np.linalg.norm(registered.stations - STATIONS, axis=1).max() < 0.002
    mine = given.station == 1
    there = given.points[mine] @ registered.rotations[1].T + registered.translations[1]
    assert np.allclose(registered.cloud.points[mine], there, atol=1e-5)


def test_who_passed_by_moves_nothing() -> None:
    moves = [STILL, motion(STATIONS[1], [0, 0, 0.3], [0.02, 0.01, 0]), STILL]
    given, places = scanned(box_scan, STATIONS, moves)
    rng = np.random.default_rng(9)
    wide, high = rng.random((2, 3000))
    person = np.stack([0.4 * wide - 0.2, np.full(3000, -0.4), 1.8 * high], axis=1)
    points = np.concatenate([given.points, np.float32(person)])
    colors = np.concatenate([given.colors, np.full((3000, 3), 40, np.uint8)])
    station = np.concatenate([given.station, np.zeros(3000, np.int16)])
    both = PointCloud(given.origin, points, colors, station)
    gap_mm, twist_deg = left_over(register.register(both, places, SETTINGS), moves)
    assert gap_mm < 1.0
    assert twist_deg < 0.03


def test_good_poses_are_left_alone() -> None:
    given, places = scanned(box_scan, STATIONS, [STILL] * 3)
    registered = register.register(given, places, SETTINGS)
    assert np.array_equal(registered.cloud.points, given.points)
    assert np.array_equal(registered.stations, places)
    assert not registered.moved_mm.any()


def test_stations_without_overlap_are_told() -> None:
    away = (np.eye(3), np.array([9.0, 0, 0]))
    given, places = scanned(box_scan, STATIONS, [STILL, STILL, away])
    with pytest.raises(
        InputError,
        match=r"stations \d at \[.*\] and 3 at .*: expected an overlap of 10% or more, found 0%",
    ):
        register.register(given, places, SETTINGS)


@pytest.mark.parametrize("owner", [-1, 0], ids=["unknown stations", "one station"])
def test_what_cannot_be_registered_stays(owner: int) -> None:
    points = np.float32(box_scan(STATIONS[0], 2000, 0))
    colors = np.full((2000, 3), 100, np.uint8)
    given = PointCloud(np.zeros(3), points, colors, np.full(2000, owner, np.int16))
    registered = register.register(given, STATIONS[:1], SETTINGS)
    assert np.array_equal(registered.cloud.points, points)
    assert registered.moved_mm.tolist() == [0]
