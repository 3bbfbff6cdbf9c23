"""Free space: how deep a place lies in what beams went through."""

from __future__ import annotations

import numpy as np
import pytest
from scanned import EYES, ROOM, beams, cloud_of, inside, ranges, solid

from tourgen.geometry import Float32
from tourgen.stages.free_space import FreeSpace, free_space

STEP_DEG = 0.2
BOARD = ([-0.6, 1.0, 0.5], [0.3, 1.025, 2.0])
"""Upright, before a wall."""


def seen(*eyes: int) -> FreeSpace:
    """What some of the eyes see of a room with a board."""
    way = beams(STEP_DEG).reshape(-1, 3)
    parts = [
        EYES[eye] + way * ranges(EYES[eye], way, inside(*ROOM), solid(*BOARD))[:, None]
        for eye in eyes
    ]
    return free_space(cloud_of(parts), EYES[list(eyes)], 0.75, -58, 0.006)


def beside(beyond_m: float) -> Float32:
    """Places past the board's end, as deep as it is."""
    z = np.linspace(0.8, 1.8, 200)
    return np.stack([np.full_like(z, 0.3 + beyond_m), np.full_like(z, 1.005), z], axis=-1).astype(
        np.float32
    )


def facing(places: Float32, normal: list[float]) -> Float32:
    return np.tile(np.float32(normal), (len(places), 1))


@pytest.mark.parametrize("beyond_m", [0.025, 0.035, 0.05])
def test_what_lies_past_a_boards_end_is_free(beyond_m: float) -> None:
    places = beside(beyond_m)
    depth_m = seen(0, 1).depth_m(places, facing(places, [0, -1, 0]))
    assert (depth_m > 0).mean() > 0.98
    assert depth_m.max() < beyond_m


@pytest.mark.parametrize("lean_deg", [0.0, 17.0, 40.0, 90.0])
def test_a_rim_is_straight_between_coarse_beams(lean_deg: float) -> None:
    """Told by the nearest beam alone it was as ragged as these lie apart, 24 mm here."""
    eye, step_deg, depth_m = np.array([0.3, 0.2, 1.4]), 0.66, 2.2
    lean = np.radians(lean_deg)
    along, out = np.array([np.cos(lean), np.sin(lean)]), np.array([-np.sin(lean), np.cos(lean)])
    way = beams(step_deg, heading_deg=0.17).reshape(-1, 3)
    reach = ranges(eye, way, inside(np.array([-9, -9, -1.0]), np.array([9, 9, 9.0])))
    with np.errstate(divide="ignore", invalid="ignore"):
        board = depth_m / way[:, 0]
        on = (board > 0) & ((board[:, None] * way[:, 1:]) @ out < 0)
    reach[on] = board[on]
    free = free_space(cloud_of([eye + way * reach[:, None]]), eye[None], 2.5, -60, 0.006)
    rim = np.linspace(-0.6, 0.6, 300)
    offset = np.linspace(-0.03, 0.03, 61)
    sideways = rim[:, None, None] * along + offset[:, None] * out
    places = np.concatenate([np.full((*sideways.shape[:2], 1), depth_m), sideways], axis=2) + eye
    asked = places.reshape(-1, 3).astype(np.float32)
    told = free.depth_m(asked, facing(asked, [-1, 0, 0])).reshape(len(rim), -1) > 0
    ends_m = offset[np.argmax(told, axis=1)]
    assert told.any(axis=1).all()
    assert ends_m.std() < 0.004
    assert np.abs(ends_m).max() < 0.013


def test_the_board_itself_is_not() -> None:
    places = beside(-0.005)
    assert seen(0, 1).depth_m(places, facing(places, [0, -1, 0])).max() < 0


@pytest.mark.parametrize("eye", [0, 1])
def test_beams_that_met_a_floor_farther_on_went_past_nothing(eye: int) -> None:
    far = np.random.default_rng(0).uniform(ROOM[0], ROOM[1], (5000, 3)).astype(np.float32)
    far[:, 2] = -0.002
    assert seen(eye).depth_m(far, facing(far, [0, 0, 1])).max() < 0


def test_where_no_beam_returned_nothing_is_known() -> None:
    way = beams(STEP_DEG).reshape(-1, 3)
    reach = ranges(EYES[0], way, inside(*ROOM), solid(*BOARD))
    points = EYES[0] + way * reach[:, None]
    window = (points[:, 1] > 1.99) & (np.abs(points[:, 0]) < 0.5) & (points[:, 2] > 1.5)
    free = free_space(cloud_of([points[~window]]), EYES[:1], 0.75, -58, 0.006)
    pane = np.float32([[0, 1.97, 1.9], [0.2, 1.97, 2.2], [-0.3, 1.97, 1.8]])
    assert np.isneginf(free.depth_m(pane, facing(pane, [0, -1, 0]))).all()
