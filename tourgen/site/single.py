"""Single: a tour, and each of its rooms, as one HTML file that carries all it shows.

Browsers let a page from a disk fetch nothing. So each file of the site is in it as the text of an
element that is not run, a ``data:`` address that the viewer decodes when it asks for the file.
"""

from __future__ import annotations

import hashlib
import json
import re
from base64 import b64encode
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tourgen.errors import Faults, InputError
from tourgen.headers import carried_policy
from tourgen.site.carried import Carrying, data_address

LARGEST_BYTES: Final = 1_000_000_000
"""A page stays in memory whole: one of this size takes Chromium 1.2 GB and 11 s to open. Browsers
give a page up to 4 GB, and less on a phone."""

_AT_MOST: Final = f"a single file of at most {LARGEST_BYTES // 10**6} MB"

_START: Final = "index.html"
"""The tour's own page."""

_FOR_HOSTS: Final = frozenset({"index.html", "preview.jpg"})
"""What a room's folder holds that the viewer never asks for."""

_MAIN: Final = re.compile(r"<main\b[^>]*>(.*?)</main>", re.DOTALL)
_PAGE: Final = re.compile(r"(.*?<head\b[^>]*>)(.*)(</body>.*)", re.DOTALL)

Json = dict[str, Any]


def write_singles(site: Path, script: str, out: Path) -> Json:
    """Write the single files of a published site.

    Args:
        site: The site's folder, which holds all else already.
        script: The viewer in one script.
        out: Their folder.

    Returns:
        What the report says of them: ``bytes`` of each by its path beside that folder, and
        ``warnings``. The whole tour's is left out where browsers would not open it: its rooms' are
        smaller.

    Raises:
        Faults: The file of a room would be larger than browsers open.
        InputError: A publisher's own template makes pages without head or body.
    """
    told: Json = json.loads((site / "tour.json").read_bytes())
    rooms = [
        Single(out / f"rooms/{room['id']}.html", f"rooms/{room['id']}/index.html", alone)
        for room in told["rooms"]
        for alone in [_alone(told, room)]
    ]
    _require_small(site, rooms)
    whole = Single(out / "tour.html", _START, told)
    size = whole.expected_bytes(site)
    warnings = [f"tour: expected {_AT_MOST}, found {_mb(size)}: left out, its rooms have theirs"]
    is_small = size <= LARGEST_BYTES
    asked = [whole, *rooms] if is_small else rooms
    return {
        "bytes": {
            each.file.relative_to(out.parent).as_posix(): each.write(site, script) for each in asked
        },
        "warnings": [] if is_small else warnings,
    }


@dataclass(frozen=True, slots=True)
class Single:
    """A single file.

    Attributes:
        file: Where it lies.
        page: The published page that it is made of.
        told: What its tour.json says.
    """

    file: Path
    page: str
    told: Json

    @property
    def rooms(self) -> list[str]:
        """Ids of the rooms in it."""
        return [room["id"] for room in self.told["rooms"]]

    def files(self, site: Path) -> list[str]:
        """Paths of the site's files that the viewer may ask for, beside tour.json."""
        folders = [*(site / "viewer").glob("draco-*"), *(site / "rooms" / id for id in self.rooms)]
        found = [file for folder in folders for file in sorted(folder.rglob("*"))]
        logo = [site / self.told["logo"]] if self.told["logo"] else []
        return [
            file.relative_to(site).as_posix()
            for file in [*logo, *found]
            if file.is_file() and file.name not in _FOR_HOSTS
        ]

    def expected_bytes(self, site: Path) -> int:
        """What the files in it take, which is nearly all."""
        return sum((site / path).stat().st_size for path in self.files(site)) * 4 // 3

    def write(self, site: Path, script: str) -> int:
        """Write it; of what it carries, one file at a time is in memory. Returns its bytes."""
        poster = f"rooms/{self.told['start']}/poster.webp"
        page = Carrying(site, self.page, self.rooms, poster)
        policy = carried_policy([_digest(script)], [_digest(style) for style in page.styles])
        text = self._with_rooms(site, page.text) if self.page == _START else page.text
        start, content, end = _parted(text)
        self.file.parent.mkdir(parents=True, exist_ok=True)
        with self.file.open("w", encoding="utf-8", newline="\n") as out:
            out.write(start)
            # No host tells how it is written, nor what it may do.
            out.write('\n<meta charset="utf-8">\n')
            out.write(f'<meta http-equiv="Content-Security-Policy" content="{policy}">')
            out.write(f'{content}<script type="module">{script}</script>\n')
            out.write(_carrier("tour.json", json.dumps(self.told, ensure_ascii=False).encode()))
            for path in self.files(site):
                if path != page.poster:
                    out.write(_carrier(path, (site / path).read_bytes()))
            out.write(end)
        return self.file.stat().st_size

    def _with_rooms(self, site: Path, text: str) -> str:
        """The tour's page, followed by what those of its rooms say, where its links lead."""
        told = []
        for room in self.rooms:
            page = Carrying(site, f"rooms/{room}/index.html", self.rooms)
            if match := _MAIN.search(page.text):
                told.append(f'<article id="room={room}">{match[1]}</article>\n')
        before, end, after = text.rpartition("</main>")
        return f"{before}{''.join(told)}{end}{after}" if end else text


def _alone(told: Json, room: Json) -> Json:
    """A tour of one room: without doors, which would lead nowhere, but not without a guide."""
    stops = [stop for stop in told["stops"] if stop["room"] == room["id"]]
    entry = {"room": room["id"], **room["entry"], "text": room["title"], "seconds": None}
    return {
        **told,
        "start": room["id"],
        "rooms": [{**room, "links": []}],
        "stops": stops or [entry],
    }


def _require_small(site: Path, singles: Iterable[Single]) -> None:
    faults = tuple(
        InputError(
            f"room `{single.rooms[0]}`: expected {_AT_MOST}, found {_mb(size)}",
            "browsers keep a page in memory whole, and open no larger one; raise "
            "`texture.texel_mm` or `surface.detail_mm`, or build without `--single-file`",
        )
        for single in singles
        if (size := single.expected_bytes(site)) > LARGEST_BYTES
    )
    if faults:
        raise Faults(faults)


def _mb(size: int) -> str:
    return f"{size // 10**6} MB"


def _parted(page: str) -> tuple[str, str, str]:
    """A page up to the content of its head, up to the end of its body, and what follows."""
    match = _PAGE.fullmatch(page)
    if match is None:
        raise InputError(
            "`templates/room.html`: expected a page with `<head>` and `</body>`, found none",
            "compare it with tourgen's own, or remove it",
        )
    return match[1], match[2], match[3]


def _carrier(path: str, content: bytes) -> str:
    """An element that no browser runs, with a file as its text."""
    data = data_address(path, content)
    return f'<script type="text/plain" data-file="{path}">{data}</script>\n'


def _digest(text: str) -> str:
    return b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
