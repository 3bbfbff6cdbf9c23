"""What a visitor gets first is small, and looks like what comes after."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from threading import Event
from urllib.parse import urlparse

import numpy as np
from playwright.sync_api import Route
from published import arrival, rooms_of, surface, tileset
from visitor import VOID, Visit, Visitor, psnr_db, shining

FIRST_VIEW_BYTES = 200_000
FIRST_VIEW_FACES = 8_000
FIRST_VIEW_DB = 22.0
SCRIPT_BYTES = 250_000
LANGUAGES_FETCHED = 8
"""All that the viewer speaks but English; a visitor waits for the words of one."""
HOLE = 0.005
"""Of the picture; a coarse opening's rim lies elsewhere than the fine one's."""
SHARP = """
const look = () => {
  if (!window.tourgen?.idle) return requestAnimationFrame(look);
  const names = performance.getEntriesByType('resource').map(({ name }) => name);
  window.sharp = names.filter((name) => name.endsWith('.glb'));
};
look();
"""
"""Notes in the page which tiles had come when nothing was missing in the first view."""


def test_the_first_view_is_small_and_full(site: Path) -> None:
    room = rooms_of(site)["chamber1"]
    file = site / room["tileset"]
    _, root = tileset(file)
    assert file.stat().st_size + root.file.stat().st_size <= FIRST_VIEW_BYTES
    assert len(surface(root.file.read_bytes()).faces) >= FIRST_VIEW_FACES


def test_the_first_view_looks_like_the_finest(site: Path, visit: Visit) -> None:
    pictures = []
    for levels in ("root", "leaves"):
        here = visit()
        here.open("rooms/chamber1/index.html", levels=levels)
        here.teleport(**arrival(site, "chamber1"))
        pictures.append(here.picture())
    assert psnr_db(*pictures) >= FIRST_VIEW_DB


def test_what_lies_around_comes_after_the_first_view(visit: Visit) -> None:
    here = visit()
    first = tiles_of_the_first_view(here)
    sharp = here.picture()
    here.wait(
        f"performance.getEntriesByType('resource').filter(({{ name }}) => name.endsWith('.glb'))"
        f".length > {len(first)}"
    )
    here.settle()
    assert np.array_equal(here.picture(), sharp)


def test_who_turns_before_it_came_sees_no_hole(visit: Visit) -> None:
    first = tiles_of_the_first_view(visit())
    here = visit(reduced_motion="reduce")
    held: list[Route] = []
    released = Event()

    def answer(route: Route) -> None:
        if released.is_set() or urlparse(route.request.url).path in first:
            route.continue_()
        else:
            held.append(route)

    here.page.route("**/*.glb", answer)
    tiles_of_the_first_view(here)
    eye, ahead = here.position, here.look
    here.page.evaluate(
        "([at, to]) => window.tourgen.teleport(at, to)",
        [eye.tolist(), (eye - ahead * (1, 1, 0)).tolist()],
    )
    while not held:
        here.page.wait_for_timeout(100)
    here.page.wait_for_timeout(500)
    while_missing = here.picture()
    released.set()
    for route in held:
        route.continue_()
    here.settle()
    assert shining(while_missing).mean() <= shining(here.picture()).mean() + HOLE


def tiles_of_the_first_view(here: Visitor) -> set[str]:
    """Open a room, and tell the paths of the tiles that its first view takes."""
    here.page.add_init_script(SHARP)
    here.open("rooms/chamber1/index.html", background=VOID)
    here.wait("window.sharp")
    return {urlparse(url).path for url in here.page.evaluate("window.sharp")}


def test_the_script_is_small(site: Path) -> None:
    """What comes before the first tile, but the Draco decoder, as a host would send it."""
    viewer = site / "viewer"
    names = json.loads((viewer / "manifest.json").read_text("utf-8"))
    scripts = {names["script"], *names["soon"]}
    assert len(scripts) > 2
    words = {path.name for path in viewer.glob("??-*.js")}
    assert len(words) == LANGUAGES_FETCHED
    assert not words & scripts
    assert _sent(viewer, scripts) + max(_sent(viewer, {each}) for each in words) <= SCRIPT_BYTES


def _sent(viewer: Path, names: set[str]) -> int:
    return sum(len(gzip.compress((viewer / name).read_bytes())) for name in names)


def test_the_report_tells_the_first_view(site: Path) -> None:
    first = []
    for room in rooms_of(site).values():
        _, root = tileset(site / room["tileset"])
        first.append((site / room["tileset"]).stat().st_size + root.file.stat().st_size)
    report = json.loads((site / "report.json").read_text(encoding="utf-8"))
    assert report["first_view_bytes"] == max(first)
