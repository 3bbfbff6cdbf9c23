"""The kiosk for hours: nothing goes wrong, nothing stays behind, nothing grows."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from statistics import median
from typing import Any

import pytest
from playwright.sync_api import Browser, Playwright
from visitor import CHROMIUM, Visitor, visitor

from tourgen.doctor import browser as find_browser

SIZE = (960, 600)
IDLE_S, WARNING_S = 60.0, 15.0
LED_S = 1600.0
"""Whoever is led is led for twenty minutes without a touch, at most."""
ROUND_S = 180.0
"""Of the kiosk's clock, a visit and what attracts after it: 160 of them are eight hours."""
ENOUGH = 50
"""From so many visits on the first and the last tenth are compared."""
GROWTH = 1.05
Pass = Callable[[float], None]


@pytest.fixture
def alone(playwright: Playwright) -> Iterator[Browser]:
    """A browser of its own, so that its processes are of this kiosk alone."""
    program = find_browser()
    assert program
    chromium = playwright.chromium.launch(executable_path=program, args=list(CHROMIUM))
    yield chromium
    chromium.close()


def test_hours_of_visits_under_a_fast_clock(
    alone: Browser, origin: str, pytestconfig: pytest.Config
) -> None:
    here = visitor(alone, origin, size=SIZE)
    here.page.clock.install(time=datetime(2026, 7, 6, 9))
    opened(here)

    def passes(seconds: float) -> None:
        # In steps: what moves is drawn at each, and no more.
        for _ in range(int(seconds // 4)):
            here.page.clock.fast_forward(4000)
        here.page.clock.fast_forward(int(1000 * (seconds % 4)))

    lived(here, pytestconfig.getoption("--kiosk-visits"), passes)


def test_an_hour_as_it_goes(alone: Browser, origin: str, pytestconfig: pytest.Config) -> None:
    seconds = pytestconfig.getoption("--kiosk-seconds")
    here = visitor(alone, origin, size=SIZE)
    opened(here)
    end = time.monotonic() + seconds
    rounds = max(1, int(seconds // (IDLE_S + WARNING_S + 15)))
    if rounds > 1:
        lived(here, rounds, lambda wait_s: here.page.wait_for_timeout(1000 * wait_s), end)
    while time.monotonic() < end:
        here.page.wait_for_timeout(1000)
        assert state(here) == "attract"
    assert not here.faults


def opened(here: Visitor) -> None:
    here.page.goto(f"{here.origin}/kiosk.html")
    here.wait("window.tourgen?.ready")


def lived(here: Visitor, visits: int, passes: Pass, end: float | None = None) -> None:
    """So many visits of random touches; every one leaves the kiosk as it was, and as large."""
    dice = random.Random(visits)
    fresh, sizes = None, list[dict[str, float]]()
    for number in range(visits):
        if end is not None and time.monotonic() > end:
            break
        begun = here.page.evaluate("performance.now()")
        here.page.locator(".begin").first.click()
        here.wait("window.tourgen.ready")
        fresh = fresh or seen(here)
        assert seen(here) == fresh, number
        for _ in range(dice.randint(3, 12)):
            touch(here, dice)
            passes(dice.uniform(0.2, 3))
        passes(IDLE_S + 1)
        if state(here) == "warning":
            passes(WARNING_S + 1)
        while state(here) != "attract":  # whoever is led, or listens, is not asked
            passes(30)
            assert here.page.evaluate("performance.now()") - begun < 1000 * LED_S, number
        here.wait("window.tourgen.ready")
        passes(max(0.0, ROUND_S - (here.page.evaluate("performance.now()") - begun) / 1000))
        sizes.append(measured(here))
    assert not here.faults, here.faults
    compared(sizes)


def touch(here: Visitor, dice: random.Random) -> None:
    """Somewhere, once, or with a stroke."""
    x, y = dice.uniform(0, SIZE[0]), dice.uniform(0, SIZE[1])
    here.page.mouse.move(x, y)
    here.page.mouse.down()
    if dice.random() < 0.4:
        here.page.mouse.move(x + dice.uniform(-200, 200), y + dice.uniform(-90, 90), steps=3)
    here.page.mouse.up()


def state(here: Visitor) -> str:
    return str(here.page.evaluate("document.getElementById('tour').dataset.state"))


def seen(here: Visitor) -> dict[str, Any]:
    """What a visitor may have changed."""
    return {
        "room": here.room,
        "position": [round(float(value), 2) for value in here.position],
        "look": [round(float(value), 2) for value in here.look],
        "see": here.page.evaluate("window.tourgen.see"),
        "language": here.page.evaluate("document.documentElement.lang"),
        "over": here.page.locator(".panel, .notice, .tool-bar, .guide").evaluate_all(
            "found => found.filter((each) => each.checkVisibility()).length"
        ),
    }


def measured(here: Visitor) -> dict[str, float]:
    """Megabytes: of the script, of the renderer, of the graphics process."""
    devtools = here.page.context.new_cdp_session(here.page)
    devtools.send("HeapProfiler.collectGarbage")
    heap = devtools.send("Runtime.getHeapUsage")["usedSize"]
    devtools.detach()
    system = here.page.context.browser
    assert system
    processes = system.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    found = {"script": heap / 2**20}
    for kind in ("renderer", "GPU"):
        ids = [int(each["id"]) for each in processes if each["type"] == kind]
        found[kind] = sum(map(proportional_mb, ids))
    return found


def proportional_mb(process: int) -> float:
    told = Path(f"/proc/{process}/smaps_rollup").read_text("ascii")
    return next(int(line.split()[1]) for line in told.splitlines() if line[:4] == "Pss:") / 1024


def compared(sizes: Sequence[dict[str, float]]) -> None:
    """The last tenth is no larger than the first."""
    tenth = max(1, len(sizes) // 10)
    for kind in sizes[0]:
        first, last = (
            median(each[kind] for each in part) for part in (sizes[:tenth], sizes[-tenth:])
        )
        print(f"{len(sizes)} visits: {kind}: {first:.1f} MB at first, {last:.1f} MB at last")
        assert len(sizes) < ENOUGH or last < GROWTH * first, kind
