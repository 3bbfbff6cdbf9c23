"""How long a page takes to show a whole picture, and then a sharp one, and what that costs.

Chromium tells each picture that it shows, with its time, and each piece of data that came.
"""

from __future__ import annotations

import base64
import io
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from net import slowed
from PIL import Image
from playwright.sync_api import Browser, CDPSession, Page
from scipy.ndimage import binary_dilation
from visitor import Picture, psnr_db

SIZE = (960, 540)
VOID = (255, 0, 255)
"""What shows where nothing is drawn."""
ALIKE_DB = 24.0
_NEAR_VOID = 60
_SLACK = 1e-4
_RIM_PX = 4
"""A coarse opening's rim lies so far from the fine one's at most: that is no hole."""
_PATIENCE_S = 120
_WATCHED = """
const look = () => {{
  if (!({done})) requestAnimationFrame(look);
  else window.doneAt = (performance.timeOrigin + performance.now()) / 1000;
}};
look();
"""
"""Notes in the page when nothing is missing any more: what it fetches later for others is later."""


@dataclass(frozen=True)
class Loading:
    """Of one page.

    Attributes:
        whole_s: Until a picture stood without a hole, and was like the sharp one.
        whole_bytes: What had come by then.
        sharp_bytes: What had come when nothing was missing any more.
        picture: The sharp one.
    """

    whole_s: float
    whole_bytes: int
    sharp_bytes: int
    picture: Picture


@dataclass
class _Watch:
    """What a page showed, and what came."""

    session: CDPSession
    pictures: list[tuple[float, str]] = field(default_factory=list)
    came: dict[str, list[tuple[float, int]]] = field(default_factory=dict)
    ended: dict[str, tuple[float, int]] = field(default_factory=dict)
    packed: set[str] = field(default_factory=set)
    clock: float | None = None
    """Seconds from Chromium's own clock to that of the day."""

    def __post_init__(self) -> None:
        self.session.on("Network.requestWillBeSent", self._asked)
        self.session.on("Network.responseReceived", self._answered)
        self.session.on("Network.dataReceived", self._came)
        self.session.on("Network.loadingFinished", self._ended)
        self.session.on("Page.screencastFrame", self._shown)

    def stop(self) -> None:
        """No more pictures: one that comes while the page closes could not be answered."""
        self.session.remove_listener("Page.screencastFrame", self._shown)
        self.session.send("Page.stopScreencast")

    def bytes_until(self, at: float) -> int:
        """All that had come at a time of the day; of what is sent compressed, only when whole."""
        total = 0
        for request in self.came.keys() | self.ended.keys():
            ended = self.ended.get(request)
            if ended and ended[0] <= at:
                total += ended[1]
            elif request not in self.packed:
                total += sum(size for when, size in self.came.get(request, ()) if when <= at)
        return total

    def _asked(self, event: dict[str, Any]) -> None:
        if self.clock is None:
            self.clock = event["wallTime"] - event["timestamp"]

    def _answered(self, event: dict[str, Any]) -> None:
        headers = {name.lower() for name in event["response"]["headers"]}
        if "content-encoding" in headers:
            self.packed.add(event["requestId"])

    def _came(self, event: dict[str, Any]) -> None:
        piece = (event["timestamp"] + (self.clock or 0), event["dataLength"])
        self.came.setdefault(event["requestId"], []).append(piece)

    def _ended(self, event: dict[str, Any]) -> None:
        told = (event["timestamp"] + (self.clock or 0), int(event["encodedDataLength"]))
        self.ended[event["requestId"]] = told

    def _shown(self, event: dict[str, Any]) -> None:
        self.pictures.append((event["metadata"]["timestamp"], event["data"]))
        self.session.send("Page.screencastFrameAck", {"sessionId": event["sessionId"]})


def loaded(browser: Browser, url: str, done: str, before: str = "") -> Loading:
    """Open a page once.

    Args:
        browser: Chromium.
        url: Of the page.
        done: A script's expression that is true when nothing is missing.
        before: A script that runs before those of the page.

    Raises:
        SystemExit: It never shows a whole picture.
    """
    page = _page(browser, before + _WATCHED.format(done=done))
    watch = _Watch(slowed(page))
    watch.session.send("Page.startScreencast", {"format": "png"})
    begun = time.time()
    page.goto(url, wait_until="commit")
    _wait(page, "window.doneAt")
    ended = page.evaluate("window.doneAt")
    sharp = _settled(page)
    watch.stop()
    page.context.close()
    for at, data in watch.pictures:
        if at > begun and _is_whole(_decoded(base64.b64decode(data)), sharp):
            whole = (at - begun, watch.bytes_until(at))
            return Loading(*whole, watch.bytes_until(ended), sharp)
    raise SystemExit(f"{url}: expected a whole picture, found {len(watch.pictures)} others")


def sharp_picture(
    browser: Browser, url: str, done: str, before: str = "", then: str = ""
) -> Picture:
    """What a page shows in the end, after a last script if there is one."""
    page = _page(browser, before)
    page.goto(url, wait_until="commit")
    _wait(page, done)
    if then:
        page.evaluate(then)
        _wait(page, done)
    picture = _settled(page)
    page.context.close()
    return picture


def _page(browser: Browser, before: str) -> Page:
    page = browser.new_context(viewport={"width": SIZE[0], "height": SIZE[1]}).new_page()
    page.set_default_timeout(_PATIENCE_S * 1000)
    if before:
        page.add_init_script(before)
    return page


def _wait(page: Page, done: str) -> None:
    end = time.monotonic() + _PATIENCE_S
    while not page.evaluate(f"Boolean({done})"):
        if time.monotonic() > end:
            raise SystemExit(f"{page.url}: {done}: still not so after {_PATIENCE_S} s")
        page.wait_for_timeout(50)


def _settled(page: Page) -> Picture:
    """What a page shows when two pictures are the same."""
    end = time.monotonic() + _PATIENCE_S
    before = _decoded(page.screenshot(type="png"))
    while time.monotonic() < end:
        page.wait_for_timeout(500)
        after = _decoded(page.screenshot(type="png"))
        if np.array_equal(before, after):
            return after
        before = after
    raise SystemExit(f"{page.url}: still moving after {_PATIENCE_S} s")


def _is_whole(picture: Picture, sharp: Picture) -> bool:
    if picture.shape != sharp.shape:
        return False
    openings = binary_dilation(_is_void(sharp), iterations=_RIM_PX)
    holes = _is_void(picture) & ~openings
    return bool(holes.mean() <= _SLACK) and psnr_db(picture, sharp) >= ALIKE_DB


def _is_void(picture: Picture) -> np.ndarray[Any, np.dtype[np.bool_]]:
    away = np.abs(picture.astype(np.int16) - np.array(VOID, np.int16)).max(axis=2)
    found: np.ndarray[Any, np.dtype[np.bool_]] = away <= _NEAR_VOID
    return found


def _decoded(data: bytes) -> Picture:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
