"""A visitor who wanders about at random: never outside of the room, never stuck, no error."""

from __future__ import annotations

import random
import time
from pathlib import Path

import numpy as np
import pytest
from published import rooms_of
from visitor import Visit

ROOMS = ("chamber1", "stairs", "chamber2")
STUCK_STEPS, STUCK_M = 12, 0.02
"""So many walks in a row, each after a turn, that lead nowhere."""
SLACK_M = 0.02


@pytest.mark.parametrize("room", ROOMS)
def test_wandering(site: Path, visit: Visit, room: str, pytestconfig: pytest.Config) -> None:
    """Of the seconds that ``--wander`` says, each room gets its part."""
    seconds = pytestconfig.getoption("--wander") / len(ROOMS)
    dice = random.Random(room)
    here = visit(size=(480, 320))
    here.open(f"rooms/{room}/index.html", levels="root")
    keyboard = here.page.keyboard
    lost_steps = 0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        turn = dice.choice(["ArrowLeft", "ArrowRight"])
        keyboard.down(turn)
        here.page.wait_for_timeout(dice.uniform(100, 700))
        keyboard.up(turn)
        before = here.position
        walk = dice.choice(["KeyW", "KeyW", "KeyW", "KeyS", "KeyA", "KeyD"])
        keys = [walk, "ShiftLeft"] if dice.random() < 0.3 else [walk]
        for key in keys:
            keyboard.down(key)
        here.page.wait_for_timeout(dice.uniform(200, 1200))
        for key in keys:
            keyboard.up(key)
        if here.room != room:
            here.page.go_back()
            here.await_room(room)
            lost_steps = 0
            continue
        bounds = rooms_of(site)[room]["bounds"]
        assert (here.position > np.array(bounds["min"]) - SLACK_M).all(), here.page.url
        assert (here.position < np.array(bounds["max"]) + SLACK_M).all(), here.page.url
        stays = np.linalg.norm(here.position - before) < STUCK_M
        lost_steps = lost_steps + 1 if stays else 0
        assert lost_steps < STUCK_STEPS, f"stuck at {here.page.url}"
