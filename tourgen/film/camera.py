"""Camera: Chromium, which shows the very site and hands out one picture after the other."""

from __future__ import annotations

import base64
import os
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from PIL import Image

from tourgen.doctor import browser
from tourgen.errors import InputError, MissingTool, StageError
from tourgen.film.settings import FilmSettings
from tourgen.serve import open_server

if TYPE_CHECKING:
    from playwright.sync_api import CDPSession, Page

FLAGS: Final = (
    "--no-first-run",
    # Drawn by the processor: the same picture on every machine.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--force-color-profile=srgb",
    "--hide-scrollbars",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)

_SHOWN: Final = "window.tourgen ? ('film' in window.tourgen ? 'film' : 'visit') : ''"
MARK_LINES: Final = 2
"""Lines of the page below the picture that tell which one it is."""

_TRIES: Final = 100
_OPENS_S: Final = 60.0
_LOOKS_EVERY_S: Final = 0.02


@dataclass(frozen=True, slots=True)
class Camera:
    """A page of Chromium that shows the film.

    It is spoken to in a thread of its own: Playwright wants one in which no event loop runs.

    Attributes:
        plan: What the viewer says of the film, see ``FilmPlan`` in diagnostics.ts.
    """

    plan: dict[str, Any]
    _shown: _Shown
    _thread: ThreadPoolExecutor

    def picture(self, second: float) -> Image.Image:
        """The picture of one second of the film, RGB.

        Raises:
            StageError: The viewer could not draw it whole.
        """
        return self._thread.submit(self._shown.picture, second).result()


@dataclass(frozen=True, slots=True)
class _Shown:
    """The page, in its thread."""

    plan: dict[str, Any]
    _page: Page
    _protocol: CDPSession

    def picture(self, second: float) -> Image.Image:
        with _told():
            mark = self._page.evaluate("second => window.tourgen.film.frame(second)", second)
            for _ in range(_TRIES):
                taken = self._taken()
                width, height = taken.size
                if taken.getpixel((width // 2, height - 1)) == _colour(mark):
                    return taken.crop((0, 0, width, height - MARK_LINES))
        raise StageError(f"film: expected the picture of {second:.2f} s, found the one before")

    def _taken(self) -> Image.Image:
        """What stands on the screen: on a busy machine it may yet be the picture before."""
        # Playwright's own screenshots pack pictures three times as long.
        asked = {"format": "png", "optimizeForSpeed": True}
        taken = self._protocol.send("Page.captureScreenshot", asked)
        return Image.open(BytesIO(base64.b64decode(taken["data"]))).convert("RGB")


def _colour(mark: int) -> tuple[int, int, int]:
    return mark >> 16, mark >> 8 & 255, mark & 255


def require_camera() -> Path:
    """The Chromium of this machine.

    Raises:
        MissingTool: The library that drives it is not installed.
        InputError: There is none.
    """
    if find_spec("playwright") is None:
        raise MissingTool(
            "film: expected playwright, found none", 'python3 -m pip install "tourgen[film]"'
        )
    program = browser()
    if program is None:
        raise InputError(
            "film: expected Chromium or Chrome on the path, found none",
            "apt-get install --yes chromium, or install Google Chrome",
        )
    return program


@contextmanager
def open_camera(site: Path, settings: FilmSettings, **wishes: str) -> Iterator[Camera]:
    """Serve a site, and show its film in a page of the size asked for.

    Args:
        site: The site's folder.
        settings: What is asked for.
        wishes: What else the viewer is asked for in the address, see diagnostics.ts.

    Raises:
        MissingTool: The library that drives Chromium is not installed.
        InputError: There is no Chromium, or the site's viewer cannot film.
        StageError: Chromium or the viewer failed.
    """
    program = require_camera()
    with ThreadPoolExecutor(1) as thread, ExitStack() as closing:
        opened = _opened(program, site, settings, wishes)
        shown = thread.submit(opened.__enter__).result()
        closing.push(lambda *fault: thread.submit(opened.__exit__, *fault).result())
        yield Camera(shown.plan, shown, thread)


@contextmanager
def _opened(
    program: Path, site: Path, settings: FilmSettings, wishes: Mapping[str, str]
) -> Iterator[_Shown]:
    from playwright.sync_api import sync_playwright

    asked = {"film": "", "lang": settings.language, **wishes}
    if settings.captions:
        asked["captions"] = ""
    with open_server(site, port=0) as server, sync_playwright() as playwright:
        Thread(target=server.serve_forever, daemon=True).start()
        try:
            with _told():
                chromium = playwright.chromium.launch(executable_path=program, args=_flags())
                page = chromium.new_page(
                    viewport={"width": settings.width, "height": settings.height + MARK_LINES},
                    device_scale_factor=1,
                    color_scheme="dark",
                    locale="en",
                )
                yield _aimed(page, f"{server.address}index.html?{urlencode(asked)}")
                chromium.close()
        finally:
            server.shutdown()


def _flags() -> list[str]:
    # Chromium refuses its sandbox to root, which is what one is in a container.
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    return [*FLAGS, "--no-sandbox"] if root else list(FLAGS)


def _aimed(page: Page, address: str) -> _Shown:
    page.goto(address)
    end = time.monotonic() + _OPENS_S
    # The published headers forbid playwright's own wait, which evaluates strings.
    while (shown := page.evaluate(_SHOWN)) != "film":
        if shown == "visit":
            raise InputError(
                "film: expected a site whose viewer can film, found an older one",
                "build it again with this tourgen",
            )
        if time.monotonic() > end:
            raise StageError(
                f"film: expected the viewer to open, found it waiting {_OPENS_S:.0f} s",
                "run the same line again when the machine has less to do",
            )
        page.wait_for_timeout(_LOOKS_EVERY_S * 1000)
    plan = page.evaluate("window.tourgen.film.plan()")
    return _Shown(plan, page, page.context.new_cdp_session(page))


@contextmanager
def _told() -> Iterator[None]:
    """Say in one line what playwright tells in many."""
    from playwright.sync_api import Error

    try:
        yield
    except Error as error:
        lines = [line.strip() for line in error.message.splitlines() if line.strip()]
        raise StageError(f"film: Chromium: {lines[0] if lines else 'it ended'}") from error
