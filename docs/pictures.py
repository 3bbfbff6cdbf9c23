"""Screenshots of every room of a published tour and of every way to see, for README and docs.

``python docs/pictures.py SITE [FOLDER]`` opens each room as one who comes through a door, in a
window of a desktop and of a phone, and writes ``ROOM-desktop.webp`` and ``ROOM-phone.webp``; and
``visit-MODE-desktop.webp`` and so on of the room that the tour starts in; and ``kiosk-STATE.webp``
of a kiosk, and ``kiosk-STATE-upright.webp`` of one whose screen stands upright.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from visitor import CHROMIUM, Visitor, visitor

from tourgen.doctor import browser as find_browser
from tourgen.serve import open_server

QUALITY = 72


@dataclass(frozen=True)
class Window:
    """A visitor's device."""

    name: str
    width: int
    height: int
    touch: bool


WINDOWS = (Window("desktop", 1280, 800, touch=False), Window("phone", 390, 780, touch=True))


def main() -> None:
    """Take them all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("site", type=Path)
    parser.add_argument("folder", type=Path, nargs="?", default=Path(__file__).parent / "pictures")
    asked = parser.parse_args()
    program = find_browser()
    if program is None:
        sys.exit("error: chromium: expected on the path, found none\n\nhint: tourgen doctor")
    asked.folder.mkdir(exist_ok=True)
    with open_server(asked.site, port=0) as server, sync_playwright() as playwright:
        Thread(target=server.serve_forever, daemon=True).start()
        chromium = playwright.chromium.launch(executable_path=program, args=list(CHROMIUM))
        for window in WINDOWS:
            for room, picture in pictures(chromium, server.address.rstrip("/"), asked.site, window):
                file = asked.folder / f"{room}-{window.name}.webp"
                picture.save(file, quality=QUALITY, method=6)
                print(f"{file}: {file.stat().st_size / 1000:.0f} kB", flush=True)
            for mode, picture in modes(chromium, server.address.rstrip("/"), window):
                picture.save(
                    asked.folder / f"visit-{mode}-{window.name}.webp", quality=QUALITY, method=6
                )
        for state, picture in kiosks(chromium, server.address.rstrip("/")):
            picture.save(asked.folder / f"kiosk-{state}.webp", quality=QUALITY, method=6)
        chromium.close()
        server.shutdown()


def pictures(
    chromium: Browser, origin: str, site: Path, window: Window
) -> Iterator[tuple[str, Image.Image]]:
    """Each room's name and picture."""
    tour = json.loads((site / "tour.json").read_text(encoding="utf-8"))
    for room in tour["rooms"]:
        context = chromium.new_context(
            viewport={"width": window.width, "height": window.height},
            is_mobile=window.touch,
            has_touch=window.touch,
        )
        here = Visitor(context.new_page(), origin)
        here.open(f"rooms/{room['id']}/index.html")
        here.teleport(**_view(tour, room))
        yield room["id"], _shot(here.page)
        context.close()
        if here.faults:
            sys.exit("\n".join(here.faults))


def _tool(page: Page, name: str) -> None:
    page.locator(".tools button").nth(3).click()
    page.locator(".tool-item", has_text=name).click()


def _measured(page: Page) -> None:
    _tool(page, "Measure")
    page.locator(".tool-bar").wait_for()
    size = page.viewport_size or {"width": 0, "height": 0}
    for x, y in ((0.35, 0.5), (0.65, 0.55)):
        page.mouse.click(x * size["width"], y * size["height"])


MODES: dict[str, Callable[[Page], object]] = {
    "walk": lambda _: None,
    "orbit": lambda page: page.locator(".way").nth(1).click(),
    "dollhouse": lambda page: page.locator(".way").nth(2).click(),
    "plan": lambda page: page.locator(".way").nth(3).click(),
    "guide": lambda page: page.locator(".guide-start").click(),
    "search": lambda page: page.locator(".tools button").nth(0).click(),
    "rooms": lambda page: page.locator(".tools button").nth(2).click(),
    "tools": lambda page: page.locator(".tools button").nth(3).click(),
    "note": lambda page: page.goto(page.url.split("#")[0] + "#note=1"),
    "measure": _measured,
    "section": lambda page: _tool(page, "Cut open"),
    "tint": lambda page: _tool(page, "What was scanned"),
    "share": lambda page: _tool(page, "Share this view"),
    "credits": lambda page: _tool(page, "About this tour"),
}
"""What is done to see in a way, in the tour's first room."""


def modes(chromium: Browser, origin: str, window: Window) -> Iterator[tuple[str, Image.Image]]:
    """Each way to see and tool, and its picture."""
    for mode, act in MODES.items():
        context = chromium.new_context(
            viewport={"width": window.width, "height": window.height},
            is_mobile=window.touch,
            has_touch=window.touch,
            reduced_motion="reduce",
            color_scheme="light",
            locale="en",
        )
        here = Visitor(context.new_page(), origin)
        here.open("index.html")
        here.settle()
        act(here.page)
        here.page.wait_for_timeout(1500)
        if mode != "guide":  # it goes on
            here.settle()
        yield mode, _shot(here.page)
        context.close()
        if here.faults:
            sys.exit("\n".join(here.faults))


def _serviced(page: Page) -> None:
    for _ in range(5):
        page.mouse.click(30, 30)
    for digit in PIN:
        page.locator(".pin-key", has_text=digit).click()


STATES: dict[str, Callable[[Page], object]] = {
    "attract": lambda _: None,
    "visit": lambda page: page.mouse.click(500, 300),
    "warning": lambda page: (page.mouse.click(500, 300), page.clock.fast_forward(61_000)),
    "service": lambda page: (page.mouse.click(500, 300), _serviced(page)),
}
"""What is done to see a kiosk in a state."""

PIN = "1911"
"""The demo's."""


def kiosks(chromium: Browser, origin: str) -> Iterator[tuple[str, Image.Image]]:
    """Each state of a kiosk, lying and upright, and its picture at half its size."""
    for size, name in (((1920, 1080), ""), ((1080, 1920), "-upright")):
        for state, act in STATES.items():
            here = visitor(
                chromium,
                origin,
                size=size,
                reduced_motion="reduce",
                color_scheme="light",
                service_workers="allow",
            )
            here.page.clock.install()
            here.page.goto(f"{origin}/kiosk.html")
            here.wait("window.tourgen?.ready")
            here.page.clock.resume()
            here.page.wait_for_timeout(4000)  # for what is fine to come
            act(here.page)
            here.page.wait_for_timeout(2500)
            yield f"{state}{name}", _shot(here.page).resize((size[0] // 2, size[1] // 2))
            here.page.context.close()
            if here.faults:
                sys.exit("\n".join(here.faults))


def _view(tour: dict[str, Any], room: dict[str, Any]) -> dict[str, Any]:
    """Where one stands who comes in by a door; the entry where no door leads here."""
    doors = (link for other in tour["rooms"] for link in other["links"])
    view: dict[str, Any] = next(
        (d["arrive"] for d in doors if d["to"] == room["id"]), room["entry"]
    )
    return view


def _shot(page: Page) -> Image.Image:
    page.wait_for_timeout(1000)  # for labels and posters to fade
    return Image.open(io.BytesIO(page.screenshot(type="png"))).convert("RGB")


if __name__ == "__main__":
    main()
