"""`tourgen kiosk` at a real screen: a headed Chromium under Xvfb, hands by xdotool."""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Playwright
from screen import Kiosk, screen_of, start_kiosk

from tourgen.cli import main
from tourgen.kiosk.vigil import COMES_WITHIN_S, GONE_S, HANGS_S, Vigil

OFF_SCREEN = """
(names) => [...document.querySelectorAll(names)]
    .filter((each) => each.checkVisibility())
    .filter((each) => {
        const { left, top, right, bottom } = each.getBoundingClientRect();
        return left < 0 || top < 0 || right > innerWidth || bottom > innerHeight;
    })
    .map((each) => each.className)
"""


@pytest.fixture
def kiosk(
    site: Path, tmp_path: Path, screen: str, playwright: Playwright
) -> Iterator[Callable[..., Kiosk]]:
    started: list[Kiosk] = []

    def start(folder: Path = site, **more: str) -> Kiosk:
        settings = {
            **os.environ,
            "DISPLAY": screen,
            "XDG_STATE_HOME": str(tmp_path / "state"),
            **more,
        }
        log = tmp_path / f"kiosk{len(started)}.log"
        started.append(start_kiosk(folder, log, settings, playwright))
        return started[-1]

    yield start
    for each in started:
        each.close()


@pytest.mark.parametrize("size", [(320, 240), (3840, 1080), (1080, 1920)])
def test_it_fills_an_odd_screen_and_is_begun_by_a_touch(
    size: tuple[int, int], kiosk: Callable[..., Kiosk]
) -> None:
    with screen_of(*size) as screen:
        running = kiosk(DISPLAY=screen)
        page = running.page()
        shown = page.evaluate("[screenX, screenY, innerWidth, innerHeight]")
        assert shown == [0, 0, size[0] + 1, size[1] + 1]
        assert page.evaluate(OFF_SCREEN, ".begin") == []
        box = page.locator(".begin").last.bounding_box()
        assert box
        place = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        running.hand("mousemove", *(str(int(each)) for each in place), "click", "1")
        running.page("document.getElementById('tour').dataset.state === 'visit'", 10)
        assert page.evaluate(OFF_SCREEN, ".top button, .dock button") == []
        running.close()


@pytest.mark.parametrize(
    ("lacking", "told"), [("DISPLAY", "screen: expected one"), ("PATH", "chromium: expected one")]
)
def test_what_lacks_is_one_clear_line(
    site: Path,
    lacking: str,
    told: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("DISPLAY", ":1")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv(lacking, "")
    assert main(["kiosk", str(site)]) in (1, 2)
    said = capsys.readouterr().err
    assert said.startswith(f"error: {told}")
    assert "Traceback" not in said


# ---- many hands


CHORDS = ("ctrl", "alt", "shift", "super", "ctrl+shift", "ctrl+alt", "alt+shift")
KEYS = (
    *"abcdefghijklmnopqrstuvwxyz0123456789",
    *(f"F{number}" for number in range(1, 13)),
    *("Escape", "Tab", "Return", "space", "BackSpace", "Delete", "Home", "End", "Prior", "Next"),
    *("Left", "Right", "Up", "Down", "Menu", "Print", "plus", "minus", "slash", "comma"),
)
QUITS = {"ctrl+alt+BackSpace", *(f"ctrl+alt+F{number}" for number in range(1, 13))}
"""These the X server would take for itself."""


def test_random_keys_clicks_and_drags_lead_nowhere(
    kiosk: Callable[..., Kiosk], pytestconfig: pytest.Config
) -> None:
    running = kiosk()
    page = running.page()
    dice = random.Random(11)
    before = len(running.windows())
    acts = pytestconfig.getoption("--acts")
    for number in range(0, acts, 20):
        for _ in range(20):
            running.hand(*act(dice))
        names = running.windows()
        assert len(names) == before, number
        assert all("Ar Steren" in name for name in names), names
    assert page.url.startswith("http://127.0.0.1:")
    assert "/kiosk.html" in page.url
    assert len(page.context.pages) == 1
    assert "anew" not in running.said
    assert page.evaluate("Boolean(window.tourgen)")


def act(dice: random.Random) -> list[str]:
    """A random key chord, click or drag."""
    place = [str(dice.randrange(1280)), str(dice.randrange(800))]
    chance = dice.random()
    if chance < 0.6:
        key = dice.choice(KEYS)
        chord = f"{dice.choice(CHORDS)}+{key}" if dice.random() < 0.8 else key
        return ["key", "Escape" if chord in QUITS else chord]
    if chance < 0.85:
        return ["mousemove", *place, "click", dice.choice("1111233")]
    goal = [str(dice.randrange(1280)), str(dice.randrange(800))]
    return ["mousemove", *place, "mousedown", "1", "mousemove", *goal, "mouseup", "1"]


# ---- the vigil alone


def test_the_vigil_tells_why() -> None:
    now = 0.0
    vigil = Vigil(lambda: now)
    now = COMES_WITHIN_S - 1
    assert vigil.fault is None
    now = COMES_WITHIN_S + 1
    assert vigil.fault == "the page did not come"
    first = vigil.opened()
    assert vigil.fault is None
    now += HANGS_S + 1
    assert vigil.fault == "the page hangs"
    vigil.alive()
    assert vigil.fault is None
    vigil.closed(first)
    now += GONE_S / 2  # it is opened anew
    assert vigil.fault is None
    vigil.closed(vigil.opened())
    now += 2 * GONE_S
    assert vigil.fault == "the page is gone"
    last = vigil.opened()
    vigil.begin()
    assert vigil.fault is None
    vigil.opened()
    vigil.closed(last)  # a dead page's line is found to be broken when the next is there
    now += 2 * GONE_S
    assert vigil.fault is None
