"""Pictures of a published room as Chromium draws them."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

from drawing import SIZE, Camera

from tourgen.doctor import browser as find_browser
from tourgen.geometry import UInt8
from tourgen.serve import open_server

sys.path.insert(0, str(Path(__file__).parents[1]))
from visitor import CHROMIUM, Visitor, visitor


@contextmanager
def published(site: Path) -> Iterator[Visitor]:
    """A visitor of a site, in a window of the bench's size."""
    from playwright.sync_api import sync_playwright

    program = find_browser()
    if program is None:
        sys.exit("error: chromium: expected on the path, found none\n\nhint: tourgen doctor")
    with open_server(site, port=0) as server, sync_playwright() as playwright:
        Thread(target=server.serve_forever, daemon=True).start()
        chromium = playwright.chromium.launch(executable_path=program, args=list(CHROMIUM))
        here = visitor(chromium, server.address.rstrip("/"), size=SIZE)
        yield here
        chromium.close()
        server.shutdown()
    if here.faults:
        raise RuntimeError("\n".join(here.faults))


def photographed(here: Visitor, room: str, cameras: Sequence[Camera]) -> list[UInt8]:
    """(h, w, 3) what each camera sees of a room."""
    here.open(f"rooms/{room}/index.html")
    pictures = []
    for camera in cameras:
        here.teleport(camera.position.tolist(), camera.look_at.tolist())
        pictures.append(here.picture())
    return pictures
