"""A published tour, a server for it, and Chromium to walk in it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from playwright.sync_api import Browser, Playwright
from visitor import CHROMIUM, Visit, Visitor, visitor

from tourgen.doctor import browser as find_browser
from tourgen.serve import open_server


@pytest.fixture(scope="session")
def browser(playwright: Playwright) -> Iterator[Browser]:
    """Chromium, drawing in software."""
    program = find_browser()
    assert program, "chromium: expected on the path, found none; `make test` installs it"
    chromium = playwright.chromium.launch(executable_path=program, args=list(CHROMIUM))
    yield chromium
    chromium.close()


@pytest.fixture(scope="session")
def origin(site: Path) -> Iterator[str]:
    """Where the miniature tour is served, with the published headers."""
    with open_server(site, port=0) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield server.address.rstrip("/")
        server.shutdown()


@pytest.fixture
def visit(browser: Browser, origin: str) -> Iterator[Visit]:
    """Makes visitors of the miniature tour; what went wrong for any of them fails the test."""
    made: list[Visitor] = []

    def make(origin: str = origin, **settings: Any) -> Visitor:
        made.append(visitor(browser, origin, **settings))
        return made[-1]

    yield make
    faults = [fault for each in made for fault in each.faults]
    for each in made:
        each.page.context.close()
    assert not faults, "\n".join(faults)
