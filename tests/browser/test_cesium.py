"""Another program opens the tilesets: CesiumJS draws what the viewer draws."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser
from published import arrival, tileset
from served import served
from visitor import UPRIGHT_DEG, Picture, Visit, Visitor, psnr_db, visitor

ROOMS = ("chamber1", "stairs", "chamber2")
ALIKE_DB = 30.0
"""Two renderers that filter textures in their own ways agree so far; a misplaced camera, a
texture upside down or a wrong colour space stay below 20 dB."""


@pytest.fixture(scope="module")
def cesium(
    browser: Browser, site: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Visitor]:
    """A page with CesiumJS beside the published tour."""
    folder = tmp_path_factory.mktemp("cesium")
    tests = Path(__file__).parents[1]
    (folder / "index.html").symlink_to(Path(__file__).with_name("cesium.html"))
    (folder / "cesium").symlink_to(tests / "node_modules/cesium/Build/Cesium")
    (folder / "site").symlink_to(site)
    with served(folder) as origin:
        opened = visitor(browser, origin)
        opened.page.goto(f"{origin}/index.html")
        opened.wait("window.ready")
        yield opened
        opened.page.context.close()


def draw(cesium: Visitor, site: Path, room: str, error: float) -> tuple[set[str], Picture]:
    """The tiles that Cesium drew, by name, and its picture."""
    view = arrival(site, room)
    paths = cesium.page.evaluate(
        "(asked) => window.draw(asked)",
        {
            "url": f"/site/rooms/{room}/tileset.json",
            "position": view["position"],
            "lookAt": view["look_at"],
            "uprightDeg": UPRIGHT_DEG,
            "error": error,
        },
    )
    png = cesium.page.screenshot(type="png")
    return {Path(path).name for path in paths}, np.asarray(
        Image.open(io.BytesIO(png)).convert("RGB")
    )


@pytest.mark.parametrize("room", ROOMS)
def test_root_is_drawn(cesium: Visitor, site: Path, room: str) -> None:
    _, root = tileset(site / "rooms" / room / "tileset.json")
    drawn, _ = draw(cesium, site, room, 1e9)
    assert drawn == {root.file.name}
    assert cesium.faults == []


@pytest.mark.parametrize("room", ROOMS)
def test_leaves_are_drawn_as_the_viewer_draws_them(
    cesium: Visitor, visit: Visit, site: Path, room: str
) -> None:
    _, root = tileset(site / "rooms" / room / "tileset.json")
    drawn, theirs = draw(cesium, site, room, 0.0)
    assert drawn
    assert drawn <= {leaf.file.name for leaf in root.leaves()}
    assert cesium.faults == []
    own = visit()
    own.open(f"rooms/{room}/index.html", levels="leaves")
    own.teleport(**arrival(site, room))
    assert psnr_db(own.picture(), theirs) > ALIKE_DB
