"""`tourgen kiosk` at a real screen: a headed Chromium under Xvfb, hands by xdotool."""

from __future__ import annotations

import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Error as BrowserError
from playwright.sync_api import Page, Playwright

from tourgen.cli import main
from tourgen.kiosk.vigil import COMES_WITHIN_S, GONE_S, HANGS_S, Vigil

BACK_WITHIN_S = 10.0
SOAK_ACTS = 10_000
PATIENCE_S = 90.0
WATCHED = Path(__file__).with_name("kiosk_watched.py")
ATTRACTS = (
    "Boolean(window.tourgen?.ready) && document.getElementById('tour').dataset.state === 'attract'"
)


@pytest.fixture(scope="module")
def screen() -> Iterator[str]:
    """A screen without a window manager, as kiosks often have."""
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x800x24"]
    with subprocess.Popen(
        [*command, "-nolisten", "tcp"], pass_fds=[writing], stderr=subprocess.DEVNULL
    ) as server:
        os.close(writing)
        with os.fdopen(reading) as told:
            yield f":{told.readline().strip()}"
        server.terminate()


@dataclass
class Kiosk:
    """A kiosk that runs.

    Attributes:
        process: `tourgen kiosk`.
        log: What it says.
        door: Where its browser can be looked into.
        settings: Its environment.
    """

    process: subprocess.Popen[bytes]
    log: Path
    door: int
    settings: Mapping[str, str]
    driver: Playwright

    def page(self, condition: str = ATTRACTS, within_s: float = PATIENCE_S) -> Page:
        """Its page, once a condition holds in it."""
        end = time.monotonic() + within_s
        while time.monotonic() < end:
            assert self.process.poll() is None, self.log.read_text("utf-8")
            try:
                browser = self.driver.chromium.connect_over_cdp(f"http://127.0.0.1:{self.door}")
                for page in browser.contexts[0].pages:
                    if page.evaluate(condition):
                        return page
            except BrowserError:
                pass
            time.sleep(0.1)
        raise AssertionError(f"{condition}: not so within {within_s} s; {self.log.read_text()}")

    def family(self, kind: str) -> list[int]:
        """Its browser's processes of a kind."""
        profile = self.settings["XDG_STATE_HOME"]
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                words = (folder / "cmdline").read_bytes().decode(errors="replace")
            except OSError:
                continue
            if profile in words and f"--type={kind}" in words:
                found.append(int(folder.name))
        return found

    def hand(self, *words: str) -> None:
        """One act of xdotool."""
        subprocess.run(["xdotool", *words], env=self.settings, check=False, capture_output=True)

    def windows(self) -> list[str]:
        """Names of what can be seen on the screen."""
        listed = ["xdotool", "search", "--onlyvisible", "--name", ".+"]
        found = subprocess.run(listed, env=self.settings, capture_output=True, text=True)
        return [
            subprocess.run(
                ["xdotool", "getwindowname", each],
                env=self.settings,
                capture_output=True,
                text=True,
            ).stdout.strip()
            for each in found.stdout.split()
        ]


@pytest.fixture
def kiosk(
    site: Path, tmp_path: Path, screen: str, playwright: Playwright
) -> Iterator[Callable[..., Kiosk]]:
    started: list[Kiosk] = []

    def start(folder: Path = site, **more: str) -> Kiosk:
        state = tmp_path / "state"
        settings = {**os.environ, "DISPLAY": screen, "XDG_STATE_HOME": str(state), **more}
        door, port = free_port(), free_port()
        log = tmp_path / f"kiosk{len(started)}.log"
        with log.open("wb") as stream:
            process = subprocess.Popen(
                [sys.executable, WATCHED, folder, str(port), str(door)],
                env=settings,
                stdout=stream,
                stderr=stream,
            )
        started.append(Kiosk(process, log, door, settings, playwright))
        return started[-1]

    yield start
    for each in started:
        each.process.send_signal(signal.SIGINT)
        assert each.process.wait(15) == 0 or each.log.read_text("utf-8").startswith("error:")


def free_port() -> int:
    with socket.socket() as asked:
        asked.bind(("127.0.0.1", 0))
        return int(asked.getsockname()[1])


# ---- what dies comes back


def test_whatever_dies_the_tour_attracts_again(
    kiosk: Callable[..., Kiosk], pytestconfig: pytest.Config
) -> None:
    """How soon is a matter of the machine: ``make soak`` asks for ten seconds, alone on it."""
    soak = pytestconfig.getoption("--acts") >= SOAK_ACTS
    running = kiosk()
    running.page()
    for kind in ("renderer", "gpu-process"):
        begun = time.monotonic()
        for process in running.family(kind):
            os.kill(process, signal.SIGKILL)
        time.sleep(0.5)
        running.page()
        back_s = time.monotonic() - begun
        print(f"{kind} killed: attracts again after {back_s:.1f} s")
        assert not soak or back_s < BACK_WITHIN_S
        time.sleep(1)
    assert "the page is gone" in running.log.read_text("utf-8")


def test_it_fills_the_screen(kiosk: Callable[..., Kiosk]) -> None:
    page = kiosk().page()
    assert page.evaluate("[screenX, screenY, innerWidth, innerHeight]") == [0, 0, 1281, 801]


def test_a_second_kiosk_of_one_folder_is_refused(kiosk: Callable[..., Kiosk]) -> None:
    kiosk().page()
    second = kiosk()
    second.process.wait(30)
    assert "expected no other kiosk, found one that shows it" in second.log.read_text("utf-8")


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


# ---- an update


def test_an_update_that_was_killed_leaves_a_whole_tour(
    site: Path, tmp_path: Path, kiosk: Callable[..., Kiosk]
) -> None:
    """A build killed between its two renames has put the site aside: see ``site.swap``."""
    folder = tmp_path / "tour"
    shutil.copytree(site, folder / ".site.old")
    shutil.copytree(site / "viewer", folder / ".site.new")
    running = kiosk(folder / "site")
    running.page()
    assert (folder / "site/tour.json").exists()


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
    assert "anew" not in running.log.read_text("utf-8")
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
    vigil.opened()
    assert vigil.fault is None
    now += HANGS_S + 1
    assert vigil.fault == "the page hangs"
    vigil.alive()
    assert vigil.fault is None
    vigil.closed()
    now += GONE_S / 2  # it is opened anew
    assert vigil.fault is None
    vigil.opened()
    vigil.closed()
    now += 2 * GONE_S
    assert vigil.fault == "the page is gone"
    vigil.begin()
    assert vigil.fault is None
