"""A headset, feigned by IWER: what it shows, where its hands lead, and what stays of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from published import rooms_of
from visitor import ROOMY, Vector, Visit, Visitor

NODE_MODULES = Path(__file__).parents[1] / "node_modules"
EYE_M = 1.6
HAND_M = (0.0, 1.3, -0.2)
"""Where the right hand is held: to the right, up and back of the feet."""

HALTED = """
const soon = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = (act) => {
  const isHeadset = String(act).includes("deviceFrameHandle");
  const then = (now) => (!isHeadset && window.tourgen?.isImmersed ? soon(then) : act(now));
  return soon(then);
};
"""
"""The window draws nothing while a headset does, as in one that stands alone."""


def wearing(visit: Visit) -> Visitor:
    """A visitor with a headset at hand."""
    here: Visitor = visit(size=ROOMY, reduced_motion="reduce")
    here.page.add_init_script(path=NODE_MODULES / "iwer/build/iwer.min.js")
    here.page.add_init_script(
        "window.headset = new IWER.XRDevice(IWER.metaQuest3);"
        "headset.installRuntime({ forceInstall: true });"
    )
    return here


def immerse(here: Visitor) -> None:
    """Put the headset on, and wait until it shows the room and holds its hands."""
    here.use("Virtual reality")
    here.wait("window.tourgen.isImmersed")
    drawn = here.stats["frames"]
    here.wait(f"window.tourgen.stats.frames > {drawn + 3}")


def emerge(here: Visitor) -> None:
    """Take it off."""
    here.page.evaluate("headset.controllers.right.updateButtonValue('squeeze', 1)")
    here.wait("!window.tourgen.isImmersed")
    here.page.evaluate("headset.controllers.right.updateButtonValue('squeeze', 0)")
    here.settle()


def point(here: Visitor, target: Sequence[float]) -> None:
    """Press the trigger of the right hand pointing at a place, hold it for a moment, let go."""
    eye, look = here.position, here.look
    yaw = math.atan2(look[1], look[0])
    ahead = np.array([math.cos(yaw), math.sin(yaw), 0.0])
    right = np.array([math.sin(yaw), -math.cos(yaw), 0.0])
    hand = eye - [0, 0, EYE_M] + right * HAND_M[0] - ahead * HAND_M[2] + [0, 0, HAND_M[1]]
    way = np.array(target) - hand
    way /= np.linalg.norm(way)
    turn, rise = math.atan2(-(way @ right), way @ ahead) / 2, math.asin(way[2]) / 2
    x, y = math.cos(turn) * math.sin(rise), math.sin(turn) * math.cos(rise)
    z, w = -math.sin(turn) * math.sin(rise), math.cos(turn) * math.cos(rise)
    here.page.evaluate(
        "([at, to]) => {"
        "  headset.controllers.right.position.set(...at);"
        "  headset.controllers.right.quaternion.set(...to);"
        "  headset.controllers.right.updateButtonValue('trigger', 1);"
        "}",
        [list(HAND_M), [x, y, z, w]],
    )
    here.page.wait_for_timeout(400)
    here.page.evaluate("headset.controllers.right.updateButtonValue('trigger', 0)")
    here.page.wait_for_timeout(400)


def angle_between(one: Vector, other: Vector) -> float:
    cosine = one @ other / np.linalg.norm(one) / np.linalg.norm(other)
    return float(np.arccos(np.clip(cosine, -1, 1)))


def test_a_headset_shows_the_room_and_one_leaves_it_at_will(visit: Visit) -> None:
    here = wearing(visit)
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    before = here.position
    immerse(here)
    here.wait("window.tourgen.stats.frames > 5")
    assert abs(here.position[2] - before[2]) < 0.5
    heading = here.look
    here.page.evaluate("headset.controllers.right.updateAxes('thumbstick', 1, 0)")
    for _ in range(40):
        here.page.wait_for_timeout(50)
        if here.look @ heading < 0.95:
            break
    turned = np.degrees(angle_between(here.look[:2], heading[:2]))
    assert turned == pytest.approx(30, abs=3), "one step, however long the stick is held"
    here.page.evaluate("headset.controllers.right.updateAxes('thumbstick', 0, 0)")
    here.page.evaluate(
        "headset.controllers.right.position.set(0.2, 1.3, -0.2);"
        "headset.controllers.right.quaternion.set(-0.38, 0, 0, 0.92);"
        "headset.controllers.right.updateButtonValue('trigger', 1)"
    )
    here.page.wait_for_timeout(400)
    stood = here.position
    here.page.evaluate("headset.controllers.right.updateButtonValue('trigger', 0)")
    for _ in range(40):
        here.page.wait_for_timeout(50)
        if np.linalg.norm(here.position - stood) > 0.4:
            break
    assert np.linalg.norm(here.position - stood) > 0.4, "to where one pointed"
    emerge(here)
    assert abs(here.position[2] - before[2]) < 0.3


def test_pointing_leads_on_on_a_floor_high_up(site: Path, visit: Visit) -> None:
    """On the landing of the stair."""
    here = wearing(visit)
    here.open("rooms/stairs/index.html", levels="root")
    here.settle()
    landing = rooms_of(site)["stairs"]["notes"][0]["view"]
    here.teleport(landing["position"], landing["look_at"])
    immerse(here)
    stood = here.position
    assert stood[2] > 7
    point(here, stood + 0.35 * here.look - [0, 0, EYE_M])
    assert 0.1 < np.linalg.norm((here.position - stood)[:2]) < 1
    assert abs(here.position[2] - stood[2]) < 0.3
    emerge(here)
    assert abs(here.position[2] - stood[2]) < 0.3


def test_a_headset_that_halts_the_window_shows_the_next_room(site: Path, visit: Visit) -> None:
    here = wearing(visit)
    here.page.add_init_script(HALTED)
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    immerse(here)
    doors = rooms_of(site)["chamber1"]["links"]
    point(here, next(door["at"] for door in doors if door["to"] == "stairs"))
    here.await_room("stairs")
    assert here.page.evaluate("window.tourgen.isImmersed")
    emerge(here)
    assert here.room == "stairs"


def test_of_a_session_that_is_over_nothing_stays(site: Path, visit: Visit) -> None:
    here = wearing(visit)
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    left = []
    for _ in range(2):
        immerse(here)
        emerge(here)
        left.append([here.stats[kind] for kind in ("textures", "geometries")])
    assert left[0] == left[1]
    gone = next(
        door["at"] for door in rooms_of(site)["chamber1"]["links"] if door["to"] == "chamber2"
    )
    here.page.locator(".door[data-to=stairs]").dispatch_event("click")
    here.await_room("stairs")
    immerse(here)
    point(here, gone)
    assert here.room == "stairs", "no door hangs there in this room"
    emerge(here)


def test_a_session_that_cannot_begin_leaves_the_room_as_it_was(visit: Visit) -> None:
    here = wearing(visit)
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    before = here.position
    here.page.evaluate(
        "window.spaceOf = XRSession.prototype.requestReferenceSpace;"
        "XRSession.prototype.requestReferenceSpace = () => Promise.reject(new Error('no floor'));"
        "null"
    )
    here.use("Virtual reality")
    here.page.locator(".notice:not([hidden])").wait_for()
    assert not here.page.evaluate("Boolean(headset.activeSession)")
    here.settle()
    assert np.allclose(here.position, before, atol=0.01)
    heading = here.look
    here.page.keyboard.press("ArrowLeft", delay=300)
    here.settle()
    assert here.look @ heading < 0.99
    here.page.evaluate("XRSession.prototype.requestReferenceSpace = window.spaceOf; null")
    immerse(here)
    emerge(here)
