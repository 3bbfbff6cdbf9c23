"""What a visit takes: ``python tests/peers/viewer.py DEMO [--room ID ...] [--write FILE]``.

Each budget in Chromium, drawing in software, over a slow network; and the same rooms shown by other
viewers as one file. Alone on the machine: times are those of everything that runs.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from budgets import CHANGES, Figure, heap_growth, room_figures
from compared import ALIKE_DB, OURS, TIMES, Row, compared
from hosting import hosted
from lighthouse import judged
from net import TOLD
from playwright.sync_api import Browser, sync_playwright
from published import rooms_of
from sections import rewrite
from visitor import CHROMIUM

from tourgen.doctor import browser as find_browser
from tourgen.headers import SECURITY_HEADERS

HEADING = "The visit"
JUDGEMENTS = 5
PERFORMANCE = 90
GROWTH = 0.05
UNCOMPILED = "--js-flags=--no-opt --no-maglev --no-sparkplug"
"""What the browser compiles on the way is not what the viewer holds."""
HALF = 0.5
PREAMBLE = f"""Made by `make bench-viewer`, in Chromium without a graphics card, text compressed as
hosts do, over {TOLD}. Bytes are those that the host sent, headers included. `script`:
until the room stands open, decoder's wrapper included; `sharp`: tileset and tiles until nothing is
missing, in the first view, and in eight directions from there; texture memory: width times height
times four bytes of all textures, and a third more for smaller copies, at its most. Heap: the last
tenth of the changes over the first, garbage collected, compiled code left out. Lighthouse: of its
mobile profile, which ends before a phone begins the room; the median, and all runs.
"""
COMPARISON = f"""Beside it the same room, every face and texel of its finest level, in one file:
packed by gltf-transform (Draco) and gltfpack (meshopt), both with WebP of the least quality whose
picture is as near as tourgen's to that of the uncompressed room in the same viewer (`PSNR`).
`whole`: until the room shows without a hole and {ALIKE_DB:.0f} dB like its own sharp picture; what
tourgen's poster shows does not count. `sharp`: until nothing is missing in the first view. Medians
of {TIMES}, loaded in turn, from the same place in the room; KB of all that came by then, scripts
too. Asked: half the time and half the bytes of each other until whole, and fewer bytes when sharp.
"""


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("demo", type=Path, help="a built tour")
    parser.add_argument("--room", action="append", help="only this one; repeatable")
    parser.add_argument("--scratch", type=Path, default=Path("build/viewer"))
    parser.add_argument("--write", type=Path, help="write the section of this Markdown file")
    given = parser.parse_args()
    site = given.demo.resolve() / "site"
    rooms = given.room or list(rooms_of(site))
    text = [PREAMBLE]
    for part in _parts(given.demo.resolve(), rooms, given.scratch.resolve()):
        print(part, flush=True)
        text.append(part)
    if given.write:
        rewrite(given.write, HEADING, "\n".join(text))
    return 0


def _parts(tour: Path, rooms: Sequence[str], scratch: Path) -> Iterator[str]:
    """The section, piece by piece as it is found."""
    yield _budgets(tour / "site", rooms)
    yield COMPARISON
    with _chromium() as browser:
        for room in rooms:
            yield _table(room, compared(browser, tour, room, scratch))


@contextmanager
def _chromium(*more: str) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        program, flags = find_browser(), [*CHROMIUM, *more]
        yield playwright.chromium.launch(executable_path=program, args=flags)


def _budgets(site: Path, rooms: Sequence[str]) -> str:
    """One row a budget, one column a room."""
    found: dict[str, list[Figure]] = {}
    with hosted(site, SECURITY_HEADERS) as host:
        with _chromium() as browser:
            for room in rooms:
                for figure in room_figures(browser, host, site, room):
                    found.setdefault(figure.name, []).append(figure)
        with _chromium(UNCOMPILED) as browser:
            growth = heap_growth(browser, host, list(rooms_of(site)))
        first = f"{host.origin}/rooms/{rooms[0]}/index.html"
        runs = [judged(first, ["performance"]).scores["performance"] for _ in range(JUDGEMENTS)]
    lines = [f"| | asked | {' | '.join(rooms)} |", "|---|---|" + "---|" * len(rooms)]
    for name, figures in found.items():
        cells = " | ".join(_shown(each) for each in figures)
        lines.append(f"| {name} | {_allowed(figures[0])} | {cells} |")
    mark = _mark(abs(growth) <= GROWTH)
    lines.append(
        f"| heap after {CHANGES} room changes | ±{GROWTH:.0%} | {mark} {growth:+.1%} |"
        + " |" * (len(rooms) - 1)
    )
    score = statistics.median(runs)
    told = f"{_mark(score >= PERFORMANCE)} {score:.0f} ({', '.join(map(str, sorted(runs)))})"
    lines.append(f"| Lighthouse performance | ≥ {PERFORMANCE} | {told} |" + " |" * (len(rooms) - 1))
    return "\n".join([*lines, ""])


def _table(room: str, rows: Sequence[Row]) -> str:
    """One row a viewer and file."""
    ours, *others = rows
    whole_s = ours.whole_s <= HALF * min(each.whole_s for each in others)
    whole = ours.whole_bytes <= HALF * min(each.whole_bytes for each in others)
    sharp = ours.sharp_bytes < min(each.sharp_bytes for each in others)
    lines = [f"| {room} | file | whole, s | whole, KB | sharp, KB | PSNR, dB |", "|---" * 6 + "|"]
    for each in rows:
        mine = each.viewer == OURS
        cells = (
            f"{_mark(whole_s) if mine else ''} {each.whole_s:.2f}",
            f"{_mark(whole) if mine else ''} {_number(each.whole_bytes / 1e3)}",
            f"{_mark(sharp) if mine else ''} {_number(each.sharp_bytes / 1e3)}",
            f"{each.psnr_db:.1f}",
        )
        told = " | ".join(cell.strip() for cell in cells)
        lines.append(f"| {each.viewer} | {each.file} | {told} |")
    return "\n".join([*lines, ""])


def _allowed(figure: Figure) -> str:
    if math.isinf(figure.most):
        return ""
    return f"≤ {_number(figure.most / figure.scale)} {figure.unit}".strip()


def _shown(figure: Figure) -> str:
    mark = "" if math.isinf(figure.most) else _mark(figure.found <= figure.most)
    return f"{mark} {_number(figure.found / figure.scale)}".strip()


def _number(value: float) -> str:
    if value >= 10:
        return f"{value:,.0f}"
    return f"{value:.4f}".rstrip("0").rstrip(".") if value < 1 else f"{value:.2f}"


def _mark(holds: bool) -> str:
    return "✓" if holds else "✗"


if __name__ == "__main__":
    sys.exit(main())
