"""A visitor of a published tour: Chromium, and the rule that nothing may go wrong in it."""

from __future__ import annotations

import io
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlencode

import numpy as np
import numpy.typing as npt
from PIL import Image
from playwright.sync_api import Browser, ConsoleMessage, Locator, Page, Request, Response

Vector = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]
Visit = Callable[..., "Visitor"]
"""Makes visitors; a test that asks for one fails when something goes wrong in its page."""

CHROMIUM = (
    "--no-sandbox",
    "--no-first-run",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
"""Draws WebGL 2 without a graphics card, and talks to nobody on its own account."""

UPRIGHT_DEG = 65.0
"""Vertical field of view of the viewer in a wide window."""

ROOMY = (700, 440)
"""Pixels of a window in which every control has its place."""
WAYS = {"Walk": "walk", "Orbit": "orbit", "Dollhouse": "dollhouse", "Plan": "plan"}
"""How the ways to see are called on the page, and by the viewer."""

WAIT_S = 60

ALONG = (
    "navigator.serviceWorker.getRegistration().then((found) =>"
    " found?.active?.state === 'activated' && navigator.serviceWorker.controller !== null)"
)
"""The tour was taken along whole."""

VOID = "ff00ff"
"""A background that nothing in the rooms looks like."""
EXCESS = 60
"""How much a pixel's red and blue exceed its green when a quarter of it is void; nothing in the
rooms comes near."""


@dataclass
class Visitor:
    """One page, and what went wrong in it.

    Attributes:
        page: Playwright's page.
        origin: The only server that it may talk to, or the folder that its page lies in.
        faults: Console errors, exceptions, failed requests, requests elsewhere.
    """

    page: Page
    origin: str
    faults: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.page.set_default_timeout(WAIT_S * 1000)
        self.page.on("console", self._heard)
        self.page.on(
            "pageerror", lambda error: self.faults.append(f"exception: {error.stack or error}")
        )
        self.page.on("request", self._asked)
        self.page.on("requestfailed", self._failed)
        self.page.on("response", self._answered)

    # ---- going there

    def open(self, path: str, **query: str) -> None:
        """Open a page below the origin and wait until its room can be walked."""
        page, mark, place = path.partition("#")
        asked = f"?{urlencode(query)}" if query else ""
        self.page.goto(f"{self.origin}/{page}{asked}{mark}{place}")
        self.wait("window.tourgen?.ready")

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript expression, or what it promises, is true.

        Playwright's own wait evaluates strings in the page, which the published headers forbid.
        """
        end = time.monotonic() + WAIT_S
        while not self.page.evaluate(f"Promise.resolve({condition}).then(Boolean)"):
            assert time.monotonic() < end, f"{condition}: still not so after {WAIT_S} s"
            self.page.wait_for_timeout(20)

    def settle(self) -> None:
        """Wait until everything that the view asks for is drawn."""
        self.wait("window.tourgen.idle")

    def await_room(self, room: str) -> None:
        """Wait until a room is open."""
        self.wait(f"window.tourgen?.room === {room!r} && window.tourgen.ready")

    # ---- where one is

    @property
    def room(self) -> str:
        return str(self.page.evaluate("window.tourgen.room"))

    @property
    def position(self) -> Vector:
        return np.array(self.page.evaluate("window.tourgen.position"), np.float64)

    @property
    def look(self) -> Vector:
        return np.array(self.page.evaluate("window.tourgen.look"), np.float64)

    @property
    def stats(self) -> dict[str, int]:
        return dict(self.page.evaluate("window.tourgen.stats"))

    def teleport(self, position: Sequence[float], look_at: Sequence[float]) -> None:
        """Put the eye somewhere, and wait until all is drawn."""
        self.page.evaluate(
            "([at, to]) => window.tourgen.teleport(at, to)", [list(position), list(look_at)]
        )
        self.settle()

    # ---- what one does

    def see(self, way: str) -> None:
        """Choose a way to see, and wait for it."""
        self.page.get_by_role("button", name=way, exact=True).click()
        self.wait(f"window.tourgen.see === {WAYS[way]!r}")

    def use(self, tool: str) -> None:
        """Choose a tool."""
        self.page.get_by_role("button", name="Tools", exact=True).click()
        self.page.locator(".tool-item", has_text=tool).click()

    # ---- what one sees

    @property
    def panel(self) -> Locator:
        """The panel that is open."""
        return self.page.locator(".panel:not([hidden])")

    def picture(self) -> Picture:
        """The canvas alone, (h, w, 3)."""
        self.page.evaluate(
            "document.querySelectorAll('#tour > :not(canvas)')"
            ".forEach((each) => { each.style.opacity = '0'; each.style.transition = 'none'; })"
        )
        return pixels(self.page.screenshot(type="png", animations="disabled"))

    # ---- what goes wrong

    def forgive(self, *words: str) -> None:
        """Forget the faults that hold any of some words: the test brought them about."""
        self.faults[:] = [each for each in self.faults if not any(word in each for word in words)]

    def _heard(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self.faults.append(f"console: {message.text} ({message.location['url']})")

    def _asked(self, request: Request) -> None:
        # Pages from a disk are of no origin, and so are the blobs that they make.
        blobs = "blob:null/" if self.origin.startswith("file:") else f"blob:{self.origin}/"
        if not request.url.startswith((f"{self.origin}/", "data:", blobs)):
            self.faults.append(f"request elsewhere: {request.url}")

    def _failed(self, request: Request) -> None:
        # What a page gives up itself, by leaving a room before all its tiles came, is no failure.
        if request.failure != "net::ERR_ABORTED":
            self.faults.append(f"request failed: {request.url}: {request.failure}")

    def _answered(self, response: Response) -> None:
        if response.status >= 400:
            self.faults.append(f"answer {response.status}: {response.url}")


def visitor(
    browser: Browser, origin: str, *, size: tuple[int, int] = (640, 400), **context: Any
) -> Visitor:
    """A visitor with a browser profile of its own, who takes a tour along if a test says so."""
    view = {"width": size[0], "height": size[1]}
    settings = {"service_workers": "block", **context}
    return Visitor(browser.new_context(viewport=view, **settings).new_page(), origin)


def rays(
    position: Vector, look_at: Vector, size: tuple[int, int], beyond_px: int = 0
) -> npt.NDArray[np.float32]:
    """(h, w, 6) rays through the pixels of the viewer's picture: origins and directions.

    Args:
        position: The eye, metres.
        look_at: In the middle of the picture.
        size: Width and height, pixels.
        beyond_px: So many more pixels beyond each edge.
    """
    width, height = size
    ahead = (look_at - position) / np.linalg.norm(look_at - position)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    reach = math.tan(math.radians(UPRIGHT_DEG / 2))
    column, row = (np.arange(-beyond_px, count + beyond_px) + 0.5 for count in size)
    x = (column / width * 2 - 1) * reach * width / height
    y = (1 - row / height * 2) * reach
    directions = ahead + x[None, :, None] * right + y[:, None, None] * up
    origins = np.broadcast_to(position, directions.shape)
    return np.concatenate([origins, directions], axis=2).astype(np.float32)


def pixels(screenshot: bytes) -> Picture:
    """(h, w, 3) of an encoded picture."""
    return np.asarray(Image.open(io.BytesIO(screenshot)).convert("RGB"))


def box_of(each: Locator) -> dict[str, float]:
    """Where something stands on the page."""
    box = each.bounding_box()
    assert box
    return dict(box)


def psnr_db(one: Picture, other: Picture) -> float:
    """Peak signal-to-noise ratio of two pictures."""
    error = np.mean((one.astype(np.float64) - other.astype(np.float64)) ** 2)
    return float(10 * np.log10(255**2 / error)) if error else math.inf


def shining(picture: Picture) -> Bools:
    """The pixels through which the void shines."""
    red, green, blue = np.moveaxis(picture.astype(np.int16), 2, 0)
    shines: Bools = np.minimum(red, blue) - green > EXCESS
    return shines
