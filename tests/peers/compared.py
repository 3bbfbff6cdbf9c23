"""A published room beside the same room in one file, shown by other viewers, over one network."""

from __future__ import annotations

import shutil
import statistics
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from first_picture import ALIKE_DB, Loading, loaded, sharp_picture
from hosting import hosted_apart
from lossless import leaves_of, lossless_site, write_lossless
from one_file import PACKERS, packed
from other_viewers import DONE, VIEWERS, Eye, page_of, staged
from playwright.sync_api import Browser
from published import rooms_of
from visitor import Picture, psnr_db

from tourgen.headers import SECURITY_HEADERS

__all__ = ["ALIKE_DB", "OURS", "TIMES", "Row", "compared"]

TIMES = 7
QUALITIES = (5, 10, 20, 30, 40, 50, 60, 70, 80, 85, 90, 95, 100)
"""Of WebP: the least is taken that comes as near to the lossless picture as ours."""
OURS = "tourgen"
SETTLED = "window.tourgen?.idle"
BARE = """
const sheet = new CSSStyleSheet();
sheet.replaceSync(`
  #tour > img, .cover { opacity: 0.004 !important }
  #tour > :not(canvas, img, .cover), #tour > :not(canvas, img, .cover) * {
    visibility: hidden !important;
  }
`);
document.adoptedStyleSheets = [sheet];
"""
"""The room itself is judged, not its poster, which is far sooner there, nor what lies before it.

The poster is there nonetheless, since the room waits for it. The page draws the room no sooner than
with all of it shown.
"""


@dataclass(frozen=True)
class Row:
    """One viewer with one file.

    Attributes:
        viewer: Its name.
        file: What was packed how.
        whole_s: Median until the first whole picture.
        whole_bytes: Median of what had come by then.
        sharp_bytes: Median of what had come when sharp.
        psnr_db: Of the sharp picture to that of the lossless room in the same viewer.
    """

    viewer: str
    file: str
    whole_s: float
    whole_bytes: float
    sharp_bytes: float
    psnr_db: float


@dataclass(frozen=True)
class _Contestant:
    """A page that shows the room: where, when it is done, what runs before it; see ``Row``."""

    viewer: str
    file: str
    url: str
    done: str
    before: str
    psnr_db: float


def compared(browser: Browser, tour: Path, room: str, scratch: Path) -> list[Row]:
    """Ours first, then every viewer with the file of every packer.

    They load in turn: what else the machine does meets all of them.
    """
    site, folder = tour / "site", scratch / room
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    whole = folder / "whole.glb"
    write_lossless(leaves_of(tour, room), whole)
    entry = rooms_of(site)[room]["entry"]
    eye = Eye(entry["position"], entry["look_at"])
    page = f"rooms/{room}/index.html?background=ff00ff"
    lossless_site(site, room, whole, folder / "lossless")
    near_db = _nearness(browser, site, folder / "lossless", page, eye)
    staged(folder / "pages")
    with hosted_apart(site, SECURITY_HEADERS) as own, hosted_apart(folder / "pages", {}) as host:
        contestants = [
            _Contestant(OURS, "tileset", f"{own}/{page}", SETTLED, BARE, near_db),
            *_others(browser, host, whole, eye, near_db),
        ]
        turns = [
            [loaded(browser, each.url, each.done, each.before) for each in contestants]
            for _ in range(TIMES)
        ]
    return [_row(each, [turn[k] for turn in turns]) for k, each in enumerate(contestants)]


def _nearness(browser: Browser, site: Path, lossless: Path, page: str, eye: Eye) -> float:
    """PSNR of what our viewer shows in the end to what it shows of the lossless room."""
    # To the millimetre: one stands on what one sees, and the floors of the two are not the same.
    there = f"window.tourgen.teleport({list(eye.position)}, {list(eye.look_at)})"
    pictures = []
    for folder in (lossless, site):
        with hosted_apart(folder, SECURITY_HEADERS) as host:
            url = f"{host}/{page}"
            pictures.append(sharp_picture(browser, url, SETTLED, BARE, there))
    return psnr_db(*pictures)


def _others(
    browser: Browser, host: str, whole: Path, eye: Eye, asked_db: float
) -> Iterator[_Contestant]:
    for viewer in VIEWERS:
        show = _shower(browser, host, viewer, eye)
        lossless = show(whole)
        for packer in PACKERS:
            quality, near_db = _equal(show, lossless, asked_db, whole, packer)
            url = _address(host, viewer, packed(whole, packer, quality), eye)
            yield _Contestant(viewer, f"{packer}, WebP {quality}", url, DONE, "", near_db)


def _row(contestant: _Contestant, runs: list[Loading]) -> Row:
    return Row(
        contestant.viewer,
        contestant.file,
        statistics.median(run.whole_s for run in runs),
        statistics.median(run.whole_bytes for run in runs),
        statistics.median(run.sharp_bytes for run in runs),
        contestant.psnr_db,
    )


def _shower(browser: Browser, host: str, viewer: str, eye: Eye) -> Callable[[Path], Picture]:
    """What a viewer shows of a file in the end."""
    return lambda file: sharp_picture(browser, _address(host, viewer, file, eye), DONE)


def _address(host: str, viewer: str, file: Path, eye: Eye) -> str:
    shutil.copy(file, file.parent / "pages/models")
    return f"{host}/{page_of(viewer, file.name, eye)}"


def _equal(
    show: Callable[[Path], Picture], lossless: Picture, asked_db: float, whole: Path, packer: str
) -> tuple[int, float]:
    """The least quality whose picture is as good as ours, or the best there is; and how good."""
    low, high = 0, len(QUALITIES) - 1
    found: dict[int, float] = {}
    while low < high:
        middle = (low + high) // 2
        found[middle] = psnr_db(show(packed(whole, packer, QUALITIES[middle])), lossless)
        low, high = (low, middle) if found[middle] >= asked_db else (middle + 1, high)
    if low not in found:
        found[low] = psnr_db(show(packed(whole, packer, QUALITIES[low])), lossless)
    return QUALITIES[low], found[low]
