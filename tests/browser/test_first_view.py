"""What a visitor gets first is small, and looks like what comes after."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

from published import arrival, rooms_of, surface, tileset
from visitor import Visit, psnr_db

FIRST_VIEW_BYTES = 200_000
FIRST_VIEW_FACES = 8_000
FIRST_VIEW_DB = 22.0
SCRIPT_BYTES = 250_000
LANGUAGES_FETCHED = 8
"""All that the viewer speaks but English; a visitor waits for the words of one."""


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
