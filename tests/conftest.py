"""A small tour that is really scanned and really built, once a session, for all who look at it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from box_tour import write_box_tour
from miniature import write_miniature
from playwright.sync_api import Playwright, sync_playwright
from turns import alone, shared_folder

from tourgen.cli import main


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--wander", type=float, default=20, help="seconds of wandering about (make soak: 1800)"
    )
    parser.addoption("--tour", type=Path, help="judge this built tour, not a miniature of the demo")
    parser.addoption(
        "--acts", type=int, default=100, help="random acts at the kiosk (make soak: 10000)"
    )
    parser.addoption(
        "--kiosk-visits", type=int, default=2, help="visits at the kiosk (make soak: 160)"
    )
    parser.addoption(
        "--kiosk-seconds", type=float, default=10, help="of a kiosk as it goes (make soak: 3600)"
    )
    parser.addoption("--kills", type=int, default=2, help="builds that are killed (make soak: 30)")


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    """What drives Chromium; a process has one at a time."""
    with sync_playwright() as driver:
        yield driver


@pytest.fixture(scope="session")
def tour_folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demo's three rooms with a fifth of their points and coarse detail, built."""
    given: Path | None = request.config.getoption("--tour")
    return given.resolve() if given else _made_once(tmp_path_factory, "miniature", write_miniature)


@pytest.fixture(scope="session")
def site(tour_folder: Path) -> Path:
    """What was published of it."""
    return tour_folder / "site"


@pytest.fixture(scope="session")
def box_tour(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A built tour of two bare rooms; not to be changed, see `box_copy`."""
    return _made_once(tmp_path_factory, "box", write_box_tour)


@pytest.fixture
def box_copy(box_tour: Path, tmp_path: Path) -> Path:
    """A copy of it, cache included, that a test may spoil."""
    return Path(shutil.copytree(box_tour, tmp_path / "tour"))


def _made_once(factory: pytest.TempPathFactory, name: str, write: Callable[[Path], object]) -> Path:
    """A tour that the first of the test processes builds while the others wait for it."""
    folder = shared_folder(factory) / name
    with alone(folder.with_suffix(".lock")):
        if not (folder / "made").exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            write(folder)
            assert main(["build", str(folder)]) == 0
            (folder / "made").touch()
    return folder
