"""A visit on foot: all rooms in a round, by mouse, keyboard and touch, the stair step by step."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from published import arrival, rooms_of
from served import served
from visitor import UPRIGHT_DEG, Vector, Visit, Visitor

SIZE = (640, 400)
MIDDLE = (320, 200)
RADIAN_PER_PX = math.radians(UPRIGHT_DEG) / SIZE[1]
DRAG_PX = 250
EYE_M = 1.6
PATIENCE_S = 300.0

CLIMB_M = 6.0
SHAFT_M, NEWEL_M = 1.1, 0.2
"""Radii of the spiral stair; one walks in the middle between them."""
WALKING_LINE_M = 0.66
RISER_M = 0.19


def within(visitor: Visitor, what: str) -> Iterator[None]:
    """Steps of a loop that must come to its end in time."""
    end = time.monotonic() + PATIENCE_S
    frames = visitor.stats["frames"]
    while time.monotonic() < end:
        yield
    pace = (visitor.stats["frames"] - frames) / PATIENCE_S
    pytest.fail(
        f"{what}: still not so after {PATIENCE_S:.0f} s at {pace:.1f} pictures a second; "
        f"the eye is at {visitor.position.round(2)} and looks along {visitor.look.round(2)}"
    )


def off_by(visitor: Visitor, target: Vector) -> float:
    """Angle from where one looks to a place, radians, positive to the left."""
    ahead, look = target - visitor.position, visitor.look
    off = math.atan2(ahead[1], ahead[0]) - math.atan2(look[1], look[0])
    return (off + math.pi) % (2 * math.pi) - math.pi


# ---- keyboard


class Keys:
    """The keys that are held down."""

    def __init__(self, visitor: Visitor) -> None:
        self.visitor = visitor
        self.held: set[str] = set()

    def hold(self, *keys: str) -> None:
        """Hold these and no others."""
        for key in self.held - set(keys):
            self.visitor.page.keyboard.up(key)
        for key in set(keys) - self.held:
            self.visitor.page.keyboard.down(key)
        self.held = set(keys)

    def step_towards(self, target: Vector) -> None:
        """Hold those that lead to a place, for a moment."""
        off = off_by(self.visitor, target)
        keys = ["KeyW"] if abs(off) < 0.6 else []
        if abs(off) > 0.15:
            keys.append("ArrowLeft" if off > 0 else "ArrowRight")
        self.hold(*keys)
        self.visitor.page.wait_for_timeout(25)


# ---- mouse and touch


@contextmanager
def mouse(visitor: Visitor) -> Iterator[Callable[[float, float], None]]:
    """Press in the middle of the picture; what is yielded moves what is pressed."""
    pointer = visitor.page.mouse
    pointer.move(*MIDDLE)
    pointer.down()
    yield lambda dx, dy: pointer.move(MIDDLE[0] + dx, MIDDLE[1] + dy, steps=4)
    pointer.up()


@contextmanager
def finger(visitor: Visitor) -> Iterator[Callable[[float, float], None]]:
    """The same with a finger."""
    session = visitor.page.context.new_cdp_session(visitor.page)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        at = [{"x": x, "y": y} for x, y in points]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})

    def move(dx: float, dy: float) -> None:
        for part in (0.25, 0.5, 0.75, 1.0):
            touch("touchMove", (MIDDLE[0] + part * dx, MIDDLE[1] + part * dy))

    touch("touchStart", MIDDLE)
    yield move
    touch("touchEnd")
    session.detach()


def push_ahead(visitor: Visitor) -> None:
    """Two fingers slide up and rest there for a moment: one walks."""
    session = visitor.page.context.new_cdp_session(visitor.page)
    x, y = MIDDLE
    for kind, rise in (("touchStart", 0), ("touchMove", 50), ("touchMove", 100)):
        at = [{"x": x + side, "y": y - rise, "id": side} for side in (0, 60)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})
    visitor.page.wait_for_timeout(700)
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    session.detach()


def look_at(visitor: Visitor, target: Vector, press: Any) -> None:
    """Drag until a place is in the middle of the picture, sideways."""
    for _ in within(visitor, f"looking at {target}"):
        off = off_by(visitor, target)
        if abs(off) < 0.1:
            return
        with press(visitor) as move:
            move(float(np.clip(off / RADIAN_PER_PX, -DRAG_PX, DRAG_PX)), 0)


# ---- the rooms


def link(site: Path, room: str, to: str) -> dict[str, Any]:
    found: dict[str, Any] = next(each for each in rooms_of(site)[room]["links"] if each["to"] == to)
    return found


def assert_arrived(visitor: Visitor, door: dict[str, Any]) -> None:
    """In the right room, at the right place, facing the right way."""
    visitor.await_room(door["to"])
    assert visitor.page.url.split("?")[0].endswith(f"/rooms/{door['to']}/index.html")
    place, to = (np.array(door["arrive"][key]) for key in ("position", "look_at"))
    assert np.linalg.norm((visitor.position - place)[:2]) < 0.3
    facing = (to - place) / np.linalg.norm(to - place)
    assert facing @ visitor.look > 0.95


def climb(visitor: Visitor) -> list[Vector]:
    """Walk up the spiral until the landing; returns the way."""
    keys = Keys(visitor)
    way = [visitor.position]
    for _ in within(visitor, "climbing the stair"):
        here = visitor.position
        way.append(here)
        if here[2] > CLIMB_M + EYE_M - 0.1:
            keys.hold()
            return way
        turn = math.atan2(here[1], here[0]) + 0.6
        ahead = [WALKING_LINE_M * math.cos(turn), WALKING_LINE_M * math.sin(turn), here[2]]
        keys.step_towards(np.array(ahead))
    raise AssertionError


def test_round_of_all_rooms(site: Path, visit: Visit) -> None:
    here = visit(size=SIZE, has_touch=True)
    here.open("index.html")
    assert here.room == "chamber1"

    door = link(site, "chamber1", "stairs")
    look_at(here, np.array(door["at"]), mouse)
    here.page.locator(".door[data-to=stairs]").click()
    assert_arrived(here, door)

    bottom = here.position[2] - EYE_M
    way = np.array(climb(here))
    assert way[-1][2] - EYE_M - bottom > CLIMB_M - 0.2
    strides = np.diff(way, axis=0)
    assert (np.abs(strides[:, 2]) < 2 * RISER_M + np.hypot(strides[:, 0], strides[:, 1])).all()
    from_axis = np.hypot(way[:, 0], way[:, 1])
    assert from_axis.max() < SHAFT_M
    assert from_axis.min() > NEWEL_M

    door = link(site, "stairs", "chamber2")
    keys = Keys(here)
    for _ in within(here, "passing the upper door"):
        if here.room == "chamber2":
            break
        keys.step_towards(np.array(door["at"]))
    keys.hold()
    assert_arrived(here, door)

    door = link(site, "chamber2", "chamber1")
    for _ in within(here, "reaching the door by touch"):
        if here.room == "chamber1":
            break
        look_at(here, np.array(door["at"]), finger)
        button = here.page.locator(".door[data-to=chamber1]:not(.away)")
        if button.count():
            button.tap()
            break
        push_ahead(here)
    assert_arrived(here, door)


@pytest.mark.parametrize("press", [mouse, finger])
def test_a_drag_that_begins_on_a_sign_turns_and_opens_nothing(
    site: Path, visit: Visit, press: Any
) -> None:
    here = visit(size=SIZE, has_touch=True)
    here.open("rooms/chamber1/index.html")
    here.teleport(here.position, link(site, "chamber1", "chamber2")["at"])
    here.page.locator(".door[data-to=chamber2]:not(.away)").wait_for()
    assert here.page.evaluate(
        "([x, y]) => document.elementFromPoint(x, y).closest('.door') !== null", MIDDLE
    )
    look = here.look
    with press(here) as move:
        move(DRAG_PX / 2, 0)
        here.settle()  # the sign has followed, and lies under what is lifted
    here.settle()
    assert off_by(here, here.position + look) < -0.2
    assert here.room == "chamber1"


def test_a_finger_that_draws_a_sign_aside_a_little_opens_nothing(site: Path, visit: Visit) -> None:
    """So little that the browser still calls it a tap."""
    here = visit(size=SIZE, has_touch=True)
    here.open("rooms/chamber1/index.html")
    here.teleport(here.position, link(site, "chamber1", "chamber2")["at"])
    here.page.locator(".door[data-to=chamber2]:not(.away)").wait_for()
    look = here.look
    with finger(here) as move:
        move(12, 0)
        here.settle()
    here.page.wait_for_timeout(500)
    here.settle()
    assert off_by(here, here.position + look) < -0.01
    assert here.room == "chamber1"


def test_walls_stop(site: Path, visit: Visit) -> None:
    """Whichever way one runs from the middle of a room, one stays inside it."""
    room = rooms_of(site)["chamber2"]
    here = visit(size=SIZE)
    here.open("rooms/chamber2/index.html")
    start = here.position
    keys = Keys(here)
    for _ in range(4):
        keys.hold("ArrowLeft")
        here.page.wait_for_timeout(700)
        keys.hold("KeyW", "ShiftLeft")
        here.page.wait_for_timeout(2500)
        if here.room != "chamber2":
            here.page.go_back()
            here.await_room("chamber2")
        assert (here.position >= room["bounds"]["min"]).all()
        assert (here.position <= room["bounds"]["max"]).all()
        assert abs(here.position[2] - start[2]) < 0.5


def test_a_key_let_go_between_two_pictures_still_turns(visit: Visit) -> None:
    """As a tap on a slow machine is."""
    here = visit()
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    before = here.look
    here.page.evaluate(
        """for (const way of ["keydown", "keyup"]) {
          window.dispatchEvent(new KeyboardEvent(way, { code: "ArrowLeft" }));
        }"""
    )
    here.settle()
    off = here.look - before
    assert np.linalg.norm(off) > math.radians(1), before
    here.page.wait_for_timeout(200)
    np.testing.assert_array_equal(here.look, before + off)


def test_click_on_the_floor_goes_there(site: Path, visit: Visit) -> None:
    here = visit(size=SIZE)
    here.open("rooms/chamber1/index.html")
    here.teleport(**arrival(site, "chamber1"))
    start = here.position
    here.page.mouse.click(MIDDLE[0], SIZE[1] - 76)
    for _ in within(here, "walking to the clicked place"):
        if np.linalg.norm(here.position - start) > 0.3:
            break
    here.settle()
    assert abs(here.position[2] - start[2]) < 0.3


def test_tour_works_under_any_path(site: Path, visit: Visit, tmp_path: Path) -> None:
    """On a plain host, in a folder of any name."""
    (tmp_path / "some where").mkdir()
    (tmp_path / "some where/tour").symlink_to(site)
    with served(tmp_path) as origin:
        here = visit(origin=origin)
        here.open("some%20where/tour/index.html")
        here.settle()
        assert here.stats["triangles"] > 0
