"""A small tour that is really scanned and really built, once a session, for all who look at it."""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path

import pytest
from box_tour import write_box_tour

from tourgen.cli import main
from tourgen.simulate import MODELS, Size, simulate_room

DEMO = Path(__file__).parents[1] / "sites/lighthouse"
MINIATURE = Size(points=250_000, texture=1024, e57=False)
COARSE = "[room.surface]\ndetail_mm = 20\n[room.texture]\ntexel_mm = 12\n\n"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--tour", type=Path, help="judge this built tour, not a miniature of the demo")


@pytest.fixture(scope="session")
def tour_folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demo's three rooms with a fifth of their points and coarse detail, built."""
    given: Path | None = request.config.getoption("--tour")
    return given.resolve() if given else _made_once(tmp_path_factory, "miniature", _miniature)


@pytest.fixture(scope="session")
def site(tour_folder: Path) -> Path:
    """What was published of it."""
    return tour_folder / "site"


@pytest.fixture(scope="session")
def box_tour(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A built tour of two bare rooms; not to be changed, see `box_copy`."""
    return _made_once(tmp_path_factory, "box", _boxes)


@pytest.fixture
def box_copy(box_tour: Path, tmp_path: Path) -> Path:
    """A copy of it, cache included, that a test may spoil."""
    return Path(shutil.copytree(box_tour, tmp_path / "tour"))


def _miniature(folder: Path) -> None:
    shutil.copytree(DEMO / "texts", folder / "texts")
    head, *rooms = (DEMO / "tour.toml").read_text(encoding="utf-8").split("[[room]]")
    coarse = (room.replace("[[room.link]]", f"{COARSE}[[room.link]]", 1) for room in rooms)
    (folder / "tour.toml").write_text("[[room]]".join([head, *coarse]), encoding="utf-8")
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        list(pool.map(_scan, MODELS, [folder] * len(MODELS)))
    assert main(["build", str(folder)]) == 0


def _scan(room: str, folder: Path) -> None:
    simulate_room(MODELS[room](), folder, MINIATURE)


def _boxes(folder: Path) -> None:
    write_box_tour(folder)
    assert main(["build", str(folder)]) == 0


def _made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], None]) -> Path:
    """A folder that the first of the test processes makes and the others wait for."""
    shared = factory.getbasetemp()
    if shared.name.startswith("popen-"):  # a worker of pytest-xdist has a folder below the run's
        shared = shared.parent
    folder = shared / name
    with _alone(shared / f"{name}.lock"):
        if not (folder / "made").exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            make(folder)
            (folder / "made").touch()
    return folder


@contextmanager
def _alone(lock: Path) -> Iterator[None]:
    with lock.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
