"""Whatever happens to `tourgen kiosk`, its tour attracts again within ten seconds, and is whole.

One kiosk lives through all of it. It starts on a port that is taken and a disk that is full, from a
site that a killed build has left aside.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from disks import MB, Disk, disk_of
from playwright.sync_api import Error as BrowserError
from playwright.sync_api import Page, Playwright
from screen import ATTRACTS, SCREEN, Kiosk, start_kiosk
from visitor import ALONG

BACK_WITHIN_S = 10.0
ALONG_WITHIN_S = 30.0
SOAK_ACTS = 10_000
DAY_MS = 86_400_000
KILLED_BUILD = Path(__file__).with_name("killed_build.py")

IS_BACK = f"{ATTRACTS} && !document.querySelector('canvas').getContext('webgl2').isContextLost()"
LACKING = """
async (files) => {
    const lacking = [];
    for (const { url, integrity } of files) {
        try {
            const { ok } = await fetch(new URL(url, location.href), { integrity });
            if (!ok) lacking.push(url);
        } catch {
            lacking.push(url);
        }
    }
    return lacking;
}
"""
"""Files of a version that the page does not get as that version's build wrote them."""
CHANGE_CLOCK = """
(ms) => {
    const Real = (window.RealDate ??= Date);
    window.Date = class extends Real {
        static now = () => Real.now() + ms;
        constructor(...of) {
            super(...(of.length > 0 ? of : [Real.now() + ms]));
        }
    };
}
"""
SAVE_VISITS = """
fetch('.kiosk/visits', { method: 'POST', body: 'x'.repeat(1 << 20) }).then((told) => told.status)
"""


# ---- the kiosk that lives through it


@dataclass
class Lasting:
    """The kiosk.

    Attributes:
        kiosk: As it runs now.
        disk: Where it keeps what it keeps.
        tour: The folder of the tour that it shows.
        site: What it shows.
        files: Of that, each with its digest.
        start: Starts it anew.
        is_alone: Whether nothing else runs on the machine.
    """

    kiosk: Kiosk
    disk: Disk
    tour: Path
    site: Path
    files: list[dict[str, str]]
    start: Callable[[], Kiosk]
    is_alone: bool

    @property
    def within_s(self) -> float:
        """How soon it is to be back: ten seconds, beside other work as much longer."""
        busy = os.getloadavg()[0] / (os.cpu_count() or 1)
        return BACK_WITHIN_S * (1 if self.is_alone else max(1, busy))

    def back(self, condition: str = "true") -> Page:
        """Its page, once the tour attracts and a condition holds; it is whole."""
        page = self.kiosk.page(f"{condition} && {IS_BACK}", self.within_s)
        assert page.evaluate(LACKING, self.files) == []
        return page

    def along(self) -> Page:
        """Its page, once the tour is taken along."""
        end = time.monotonic() + ALONG_WITHIN_S
        while not (page := self.back()).evaluate(ALONG):
            assert time.monotonic() < end, f"the tour is not along within {ALONG_WITHIN_S} s"
            page.wait_for_timeout(200)
        return page


@pytest.fixture(scope="module")
def tour(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A built tour to publish anew: two bare rooms, or the one that is to be judged."""
    given = request.config.getoption("--tour") or request.getfixturevalue("box_tour")
    return Path(shutil.copytree(given, tmp_path_factory.mktemp("kiosk") / "tour"))


@pytest.fixture(scope="module")
def disk(tour: Path) -> Iterator[Disk]:
    size = 64 * MB + 3 * sum(file.stat().st_size for file in (tour / "site").rglob("*"))
    with disk_of(size, tour.with_name("disk")) as made:
        yield made


@pytest.fixture(scope="module")
def lasting(
    tour: Path, disk: Disk, screen: str, playwright: Playwright, pytestconfig: pytest.Config
) -> Iterator[Lasting]:
    settings = {
        **os.environ,
        "DISPLAY": screen,
        "XDG_STATE_HOME": str(disk.folder / "state"),
        "TMPDIR": str(disk.folder),
    }
    log = tour.with_name("kiosk.log")

    def start(port: int) -> Kiosk:
        return start_kiosk(tour / "site", log, settings, playwright, port=port, within=disk.within)

    files = files_of(tour / "site")
    (tour / "site").rename(tour / ".site.old")
    shutil.copytree(tour / ".site.old/viewer", tour / ".site.new")
    disk.fill()
    with socket.create_server(("127.0.0.1", 0)) as first:
        kiosk = start(first.getsockname()[1])
        try:
            page = kiosk.page()
            assert page.evaluate(LACKING, files) == []
        except BaseException:
            kiosk.close()
            raise
    disk.free()
    own = urlsplit(page.url).port
    is_alone = pytestconfig.getoption("--acts") >= SOAK_ACTS
    lived = Lasting(kiosk, disk, tour, tour / "site", files, partial(start, own), is_alone)
    kill_browser(lived, page)  # one that began on a full disk keeps nothing until it begins anew
    yield lived
    lived.kiosk.close()
    assert lived.kiosk.family() == []


def files_of(site: Path) -> list[dict[str, str]]:
    """All files that a version has, by its own list."""
    first = (site / "sw.js").read_text("utf-8").partition("\n")[0]
    told: dict[str, Any] = json.loads(first.removeprefix("self.tour=").removesuffix(";"))
    files: list[dict[str, str]] = told["files"]
    return files


# ---- what happens to it


def test_on_a_full_disk_it_starts_and_a_port_that_is_taken_gives_way_to_the_next(
    lasting: Lasting,
) -> None:
    assert "is taken), stop with Ctrl+C" in lasting.kiosk.said


def test_it_fills_the_screen(lasting: Lasting) -> None:
    place = lasting.back().evaluate("[screenX, screenY, innerWidth, innerHeight]")
    assert place == [0, 0, SCREEN[0] + 1, SCREEN[1] + 1]


def test_a_second_kiosk_of_one_folder_is_refused(lasting: Lasting) -> None:
    assert lasting.start().process.wait(60) == 1
    assert "expected no other kiosk, found one that shows it" in lasting.kiosk.said


def kill_renderer(lasting: Lasting, _: Page) -> None:
    for process in lasting.kiosk.family("renderer"):
        os.kill(process, signal.SIGKILL)


def kill_browser(lasting: Lasting, _: Page) -> None:
    for process in lasting.kiosk.family():
        os.kill(process, signal.SIGKILL)


def crash_tab(_: Lasting, page: Page) -> None:
    with pytest.raises(BrowserError):
        page.context.new_cdp_session(page).send("Page.crash")


def kill_graphics(lasting: Lasting, page: Page) -> None:
    page.evaluate(
        "document.querySelector('canvas')"
        ".addEventListener('webglcontextlost', () => { window.before = undefined; })"
    )
    for process in lasting.kiosk.family("gpu-process"):
        os.kill(process, signal.SIGKILL)


def lose_context(_: Lasting, page: Page) -> None:
    page.evaluate(
        "document.querySelector('canvas').getContext('webgl2')"
        ".getExtension('WEBGL_lose_context').loseContext()"
    )


def kill_kiosk(lasting: Lasting, page: Page) -> None:
    """The page goes on without its server; the kiosk starts in its place."""
    lasting.along()
    lasting.kiosk.process.kill()
    lasting.kiosk.process.wait()
    assert page.evaluate(LACKING, lasting.files) == []
    lasting.kiosk = lasting.start()


def stop_kiosk(lasting: Lasting, _: Page) -> None:
    """As a session does that ends."""
    lasting.kiosk.process.terminate()
    assert lasting.kiosk.process.wait(10) == 0
    assert lasting.kiosk.family() == []
    lasting.kiosk = lasting.start()


@pytest.mark.parametrize(
    "happens",
    [kill_renderer, kill_browser, crash_tab, kill_graphics, lose_context, kill_kiosk, stop_kiosk],
)
def test_what_ends_begins_anew(lasting: Lasting, happens: Callable[[Lasting, Page], None]) -> None:
    page = lasting.back()
    address = page.url
    page.evaluate("window.before = true")
    begun = time.monotonic()
    happens(lasting, page)
    fresh = lasting.back("!window.before")
    print(f"{happens.__name__}: attracts again, whole, after {time.monotonic() - begun:.1f} s")
    assert fresh.url == address, "what is kept under it would be lost"
    assert len(lasting.kiosk.windows()) == 1


def test_the_clock_set_a_day_ahead_and_back_changes_nothing(lasting: Lasting) -> None:
    page = lasting.back()
    page.evaluate("window.before = true")
    for ahead_ms in (DAY_MS, -DAY_MS, 0):
        page.evaluate(CHANGE_CLOCK, ahead_ms)
        assert abs(page.evaluate("Date.now()") - 1000 * time.time() - ahead_ms) < 60_000
        page.wait_for_timeout(1000)
        lasting.back("window.before")


@pytest.mark.parametrize("moment", ["write", "swap"])
def test_an_update_that_is_killed_leaves_the_whole_tour(lasting: Lasting, moment: str) -> None:
    page = lasting.along()
    page.evaluate("window.before = true")
    toml = lasting.tour / "tour.toml"
    toml.write_text(toml.read_text("utf-8").replace('en = "', f'en = "{moment} ', 1), "utf-8")
    build = [sys.executable, KILLED_BUILD, lasting.tour, moment]
    assert subprocess.run(build, stderr=subprocess.DEVNULL).returncode == -signal.SIGKILL
    lasting.back("window.before")
    end = time.monotonic() + lasting.within_s
    while not lasting.site.exists():
        assert time.monotonic() < end, "expected the site in its place, found it aside"
        time.sleep(0.1)
    assert files_of(lasting.site) == lasting.files
    kill_renderer(lasting, page)
    lasting.back("!window.before")


def test_on_a_full_disk_it_begins_anew_and_a_visit_goes_on(lasting: Lasting) -> None:
    page = lasting.back()
    page.evaluate("window.before = true")
    lasting.disk.fill()
    kill_renderer(lasting, page)
    fresh = lasting.back("!window.before")
    fresh.locator(".begin").first.click()
    assert fresh.evaluate("document.getElementById('tour').dataset.state") == "visit"
    assert fresh.evaluate(LACKING, lasting.files) == []
    lasting.disk.fill()  # the browser has given up some of what it kept
    assert fresh.evaluate(SAVE_VISITS) == 507
    fresh.get_by_role("button", name="Start over").click()
    lasting.back()
    lasting.disk.free()
    assert fresh.evaluate(SAVE_VISITS) == 200
    assert "Traceback" not in lasting.kiosk.said
