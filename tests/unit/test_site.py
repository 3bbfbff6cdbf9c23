"""The published folder: what is in it, and that it is swapped in whole or not at all."""

from __future__ import annotations

import errno
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

import tourgen.site.swap as swap
from tourgen.errors import InputError
from tourgen.geometry import View
from tourgen.site import BuiltRoom, Made, is_site, restore_site, write_site
from tourgen.stages.plan import Plan, Storey
from tourgen.tour import Tour, load_tour

ORIGIN = np.array([100_000.0, 50_000.0, 12.0])
REPORT: dict[str, Any] = {
    "tourgen": "0.1",
    "seconds": 12.3,
    "first_view_bytes": 181_000,
    "total_bytes": 2_400_000,
    "cached_stages": 0,
    "ran_stages": 12,
    "rooms": {
        "hall": {
            "points_read": 1_302_317,
            "points_used": 1_200_000,
            "tiles": [1, 8],
            "faces": [12_000, 250_000],
            "bytes": [180_000, 2_200_000],
            "seconds": {"surface": 31.5, "bake": 9.1},
            "peak_rss_mb": {"surface": 1900.0, "bake": 700.0},
            "cloud_to_mesh_mm": {"p50": 1.31, "p95": 4.92},
            "inferred_area_ratio": 0.031,
            "ran": ["surface", "bake"],
            "warnings": ["scan `a<b>.ply` has no colour"],
        },
    },
}


SQUARE = np.array([[-3, -3], [3, -3], [3, 3], [-3, 3]], np.float32)


class Links(HTMLParser):
    """Every address that a page names."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.inline: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.found += [value for key in ("href", "src") if (value := values.get(key))]
        if values.get("property") == "og:image":
            self.found.append(values["content"] or "")
        is_data = values.get("type") == "application/ld+json"
        if (
            (tag == "script" and "src" not in values and not is_data)
            or tag == "style"
            or "style" in values
        ):
            self.inline.append(tag)


def view(x: float) -> View:
    return View(np.array([x, 0.0, 1.6]), np.array([x + 1, 0.0, 1.5]))


def picture() -> bytes:
    file = io.BytesIO()
    Image.new("RGB", (8, 8), (90, 120, 110)).save(file, "WEBP")
    return file.getvalue()


def built(room: str, arrivals: int, mark: bytes = b"glTF") -> BuiltRoom:
    tileset = {"root": {"content": {"uri": "tiles/r.glb"}}}
    return BuiltRoom(
        id=room,
        origin=ORIGIN,
        bounds=np.array([[-3.0, -3, 0], [3.0, 3, 2.5]]),
        entry=view(0),
        arrivals=tuple(view(i + 1) for i in range(arrivals)),
        viewpoints=tuple(view(i + 4) for i in range(arrivals)),
        plan=Plan(
            (Storey(0.0, (SQUARE,), (SQUARE[:3],), ()),),
            np.zeros(arrivals),
            np.tile([[0.0, 1.0]], (arrivals, 1)),
        ),
        files={
            "tileset.json": json.dumps(tileset).encode(),
            "tiles/r.glb": mark,
            "poster.webp": picture(),
            "preview.jpg": picture(),
            "around.webp": picture(),
        },
        made=Made(1_302_317, 3, 250_000, (1.31, 4.92), 0.031),
    )


@pytest.fixture
def tour(tmp_path: Path) -> Tour:
    folder = tmp_path / "tour"
    folder.mkdir()
    (folder / "hall.ply").write_bytes(b"ply")
    (folder / "desk.jpg").write_bytes(b"\xff\xd8picture")
    (folder / "hall.en.md").write_text(
        "The **hall** & its <script>alert(1)</script> door.\n\n[more](javascript:alert(1))\n",
        "utf-8",
    )
    (folder / "tour.toml").write_text(
        """
        [tour]
        title = { en = "Light & sea", fr = "Phare" }
        languages = ["en", "fr"]
        start = "hall"
        [[room]]
        id = "hall"
        title = { en = "Hall", fr = "Salle" }
        scans = ["hall.ply"]
        text = { en = "hall.en.md" }
        [[room.link]]
        to = "loft"
        at = [100001.0, 50002.0, 13.4]
        [[room.note]]
        at = [100000.5, 50000.0, 13.0]
        title = "Desk"
        text = "A *desk*."
        image = "desk.jpg"
        [[room]]
        id = "loft"
        scans = ["hall.ply"]
        """,
        "utf-8",
    )
    return load_tour(folder)


@pytest.fixture(autouse=True)
def viewer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bundle of a few bytes: what it does is tested elsewhere."""
    dist = tmp_path / "dist"
    (dist / "draco-1").mkdir(parents=True)
    names = {"script": "viewer-1.js", "style": "style-1.css", "draco": "draco-1/"}
    parts = {"first": ["parts-1.js"], "soon": ["parts-1.js", "visit-1.js"]}
    names_too = {"icon": "icon.svg", "kiosk": "kiosk-1.css"}
    (dist / "manifest.json").write_text(json.dumps(names | names_too | parts))
    for name in (
        "viewer-1.js",
        "parts-1.js",
        "visit-1.js",
        "single.js",
        "style-1.css",
        "kiosk-1.css",
        "sw.js",
        "icon.svg",
        "draco-1/draco_decoder.wasm",
        "draco-1/draco_wasm_wrapper.js",
    ):
        (dist / name).write_text("x")
    monkeypatch.setattr(swap, "viewer_folder", lambda: dist)


def write(tour: Tour, out: Path, mark: bytes = b"glTF") -> None:
    write_site(tour, [built("loft", 0, mark), built("hall", 1, mark)], REPORT, out)


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_tour_json_says_what_the_tour_file_and_the_build_say(tour: Tour, tmp_path: Path) -> None:
    out = tmp_path / "site"
    write(tour, out)
    told = json.loads((out / "tour.json").read_text("utf-8"))
    assert told["format"] == 2
    assert told["title"] == {"en": "Light & sea", "fr": "Phare"}
    assert told["start"] == "hall"
    hall, loft = told["rooms"]
    assert loft["title"] == {"en": "loft", "fr": "loft"}
    assert hall["bounds"] == {"min": [-3, -3, 0], "max": [3, 3, 2.5]}
    (link,) = hall["links"]
    assert link["to"] == "loft"
    assert link["at"] == [1.0, 2.0, 1.4], "coordinates are relative to the room's origin"
    assert link["arrive"] == {"position": [1, 0, 1.6], "look_at": [2, 0, 1.5]}
    (note,) = hall["notes"]
    assert note["at"] == [0.5, 0.0, 1.0]
    assert note["text"]["fr"] == "<p>A <em>desk</em>.</p>"
    assert (out / note["image"]).read_bytes() == b"\xff\xd8picture"
    assert hall["made"]["bytes"] == sum(map(len, built("hall", 1).files.values()))


def test_texts_become_html_that_carries_none_of_the_author(tour: Tour, tmp_path: Path) -> None:
    write(tour, tmp_path / "site")
    hall = json.loads((tmp_path / "site/tour.json").read_text("utf-8"))["rooms"][0]
    assert hall["text"]["en"].startswith("<p>The <strong>hall</strong> &amp; its &lt;script&gt;")
    assert "href" not in hall["text"]["en"]


def test_every_address_is_relative_and_leads_to_a_file(tour: Tour, tmp_path: Path) -> None:
    out = tmp_path / "site"
    write(tour, out)
    pages = sorted(out.rglob("*.html"))
    assert [str(page.relative_to(out)) for page in pages] == [
        "404.html",
        "index.html",
        "kiosk.html",
        "report.html",
        "rooms/hall/index.html",
        "rooms/loft/index.html",
    ]
    for page in pages[1:]:  # the first is sent for addresses of any depth
        links = Links(page.read_text("utf-8"))
        assert not links.inline, f"{page}: the policy forbids what is inline"
        assert len(links.found) >= 4
        for address in links.found:
            parts = urlsplit(address)
            assert not parts.scheme, address
            assert not address.startswith("/"), address
            assert (page.parent / unquote(parts.path)).is_file(), f"{page}: {address}"


def test_pages_stand_without_script(tour: Tour, tmp_path: Path) -> None:
    out = tmp_path / "site"
    write(tour, out)
    hall = (out / "rooms/hall/index.html").read_text("utf-8")
    assert '<html lang="en" dir="ltr" data-scheme="auto">' in hall
    assert "<title>Hall – Light &amp; sea</title>" in hall
    assert re.search(r'<meta name="description" content="The hall &amp; its', hall)
    assert "<h1>Hall</h1>" in hall
    assert "<h1>Salle</h1>" in hall
    assert '<a href="../../rooms/loft/index.html">' in hall
    start = (out / "index.html").read_text("utf-8")
    assert "<title>Light &amp; sea</title>" in start
    assert 'data-room="hall"' in start


def test_a_phone_waits_with_the_scripts_of_a_visit(tour: Tour, tmp_path: Path) -> None:
    write(tour, tmp_path / "site")
    page = (tmp_path / "site/rooms/hall/index.html").read_text("utf-8")
    asked = re.findall(r'"modulepreload" href="../../viewer/([^"]+)"([^>]*)>', page)
    assert [name for name, _ in asked] == ["parts-1.js", "visit-1.js"]
    assert ["media=" in how for _, how in asked] == [False, True]
    assert 'media="not (pointer: coarse)"' in asked[1][1]


def test_all_that_a_room_opens_with_is_asked_for_by_its_page(tour: Tour, tmp_path: Path) -> None:
    """Before any script runs; on a phone not before one begins it."""
    write(tour, tmp_path / "site")
    page = (tmp_path / "site/rooms/hall/index.html").read_text("utf-8")
    asked = re.findall(r'<link rel="preload" as="fetch" href="../../([^"]+)"([^>]*)>', page)
    draco = "viewer/draco-1/"
    assert [path for path, _ in asked] == [
        "tour.json",
        "rooms/hall/tileset.json",
        f"{draco}draco_wasm_wrapper.js",
        f"{draco}draco_decoder.wasm",
        "rooms/hall/tiles/r.glb",
    ]
    assert {how for _, how in asked} == {
        ' crossorigin fetchpriority="low" media="not (pointer: coarse)"'
    }


def test_a_poster_that_has_come_stands_in_the_first_picture_of_its_page(
    tour: Tour, tmp_path: Path
) -> None:
    write(tour, tmp_path / "site")
    for name in ("index.html", "kiosk.html", "rooms/hall/index.html"):
        page = (tmp_path / "site" / name).read_text("utf-8")
        (poster,) = re.findall(r'<section id="tour".*?<img ([^>]*)>', page, re.DOTALL)
        assert "poster.webp" in poster
        assert 'decoding="sync"' in poster, name


def test_previews_and_search_engines_are_told_where_it_is(tour: Tour, tmp_path: Path) -> None:
    out = tmp_path / "site"
    write(tour.model_copy(update={"address": "https://example.org/tour/"}), out)
    page = (out / "rooms/hall/index.html").read_text("utf-8")
    assert '<link rel="canonical" href="https://example.org/tour/rooms/hall/index.html">' in page
    assert 'content="https://example.org/tour/rooms/hall/preview.jpg"' in page
    (data,) = re.findall(r'ld\+json">(.*?)</script>', page)
    assert json.loads(data)["containedInPlace"]["name"] == "Light & sea"
    sitemap = (out / "sitemap.xml").read_text("utf-8")
    assert ElementTree.fromstring(sitemap)[1][0].text == (
        "https://example.org/tour/rooms/hall/index.html"
    )
    assert "Sitemap: https://example.org/tour/sitemap.xml" in (out / "robots.txt").read_text()
    assert 'url=/tour/index.html#missing"' in (out / "404.html").read_text("utf-8")


def test_notes_carry_sound_with_captions(tour: Tour, tmp_path: Path) -> None:
    for name in ("sea.mp3", "sea.en.vtt", "sea.fr.vtt"):
        (tour.folder / name).write_text(name)
    file = tour.folder / "tour.toml"
    added = 'image = "desk.jpg"\nsound = "sea.mp3"\ncaptions = "sea.{lang}.vtt"'
    file.write_text(file.read_text("utf-8").replace('image = "desk.jpg"', added), "utf-8")
    out = tmp_path / "site"
    write(load_tour(tour.folder), out)
    (note,) = json.loads((out / "tour.json").read_text("utf-8"))["rooms"][0]["notes"]
    assert (out / note["sound"]).read_text() == "sea.mp3"
    assert (out / note["captions"]["fr"]).read_text() == "sea.fr.vtt"
    page = (out / "rooms/hall/index.html").read_text("utf-8")
    assert '<track kind="captions" srclang="fr" src="../../rooms/hall/notes/1.fr.vtt">' in page


def test_a_publisher_may_write_a_template_of_their_own(tour: Tour, tmp_path: Path) -> None:
    own = tour.folder / "templates"
    own.mkdir()
    (own / "404.html").write_text("<p>{{ tour.title.en }} is elsewhere</p>", "utf-8")
    out = tmp_path / "site"
    write(tour, out)
    assert (out / "404.html").read_text("utf-8") == "<p>Light &amp; sea is elsewhere</p>"
    assert "<h1>Hall</h1>" in (out / "rooms/hall/index.html").read_text("utf-8")


@pytest.mark.parametrize("template", ["{% if %}", "{{ tuor.title }}"])
def test_a_template_at_fault_is_told_and_nothing_is_lost(
    tour: Tour, tmp_path: Path, template: str
) -> None:
    out = tmp_path / "site"
    write(tour, out, b"first")
    before = contents(out)
    (tour.folder / "templates").mkdir()
    (tour.folder / "templates/404.html").write_text(template, "utf-8")
    with pytest.raises(InputError, match=r"`templates/404\.html`: expected a template"):
        write(tour, out, b"second")
    assert contents(out) == before


def test_where_nothing_else_is_said_the_guide_goes_from_note_to_note(
    tour: Tour, tmp_path: Path
) -> None:
    write(tour, tmp_path / "site")
    told = json.loads((tmp_path / "site/tour.json").read_text("utf-8"))
    assert [(stop["room"], stop["text"]["en"]) for stop in told["stops"]] == [
        ("hall", "The hall & its <script>alert(1)</script> door. [more](javascript:alert(1))"),
        ("hall", "Desk. A desk."),
        ("loft", "loft"),
    ]
    assert told["stops"][1]["position"] == [4, 0, 1.6]


def test_the_report_is_set_as_a_page(tour: Tour, tmp_path: Path) -> None:
    out = tmp_path / "site"
    write(tour, out)
    assert json.loads((out / "report.json").read_text("utf-8")) == REPORT
    page = (out / "report.html").read_text("utf-8")
    for expected in ("1\u202f302\u202f317", "250\u202f000", "1.31", "4.92", "3.1", "31.5", "1900"):
        assert expected in page, expected
    assert "a&lt;b&gt;.ply" in page


def test_single_files_come_with_the_site_where_they_are_asked_for(
    tour: Tour, tmp_path: Path
) -> None:
    out = tmp_path / "site"
    rooms = [built("loft", 0), built("hall", 1)]
    report = write_site(tour, rooms, REPORT, out, single_files=True)
    assert json.loads((out / "report.json").read_text("utf-8")) == report
    sizes = report["single_files"]["bytes"]
    assert list(sizes) == ["single/tour.html", "single/rooms/hall.html", "single/rooms/loft.html"]
    assert {name: (out / name).stat().st_size for name in sizes} == sizes
    assert not (out / "viewer/single.js").exists(), "no page asks for it"
    assert write_site(tour, rooms, REPORT, out) == REPORT
    assert not (out / "single").exists()


def test_a_site_takes_the_place_of_the_one_before_whole(tour: Tour, tmp_path: Path) -> None:
    out = tmp_path / "site"
    write(tour, out, b"first")
    (out / "rooms/hall/tiles/old.glb").write_bytes(b"of an earlier build")
    write(tour, out, b"second")
    assert (out / "rooms/hall/tiles/r.glb").read_bytes() == b"second"
    assert not (out / "rooms/hall/tiles/old.glb").exists()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["dist", "site", "tour"]


@pytest.mark.parametrize("moment", ["while writing", "before the swap", "between the renames"])
def test_a_killed_build_loses_nothing(
    tour: Tour, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    out = tmp_path / "site"
    write(tour, out, b"first")
    before = contents(out)

    class KilledError(BaseException):
        pass

    def killed(*_: object, **__: object) -> None:
        raise KilledError

    rename = Path.rename

    def killed_between(self: Path, target: Path) -> Path:
        if self.name.endswith(".new") or moment == "before the swap":
            raise KilledError
        return rename(self, target)

    with monkeypatch.context() as patch:
        if moment == "while writing":
            patch.setattr(swap, "headers_file", killed)
        else:
            patch.setattr(Path, "rename", killed_between)
        with pytest.raises(KilledError):
            write(tour, out, b"second")
    restore_site(out)
    assert contents(out) == before
    write(tour, out, b"third")
    assert (out / "rooms/hall/tiles/r.glb").read_bytes() == b"third"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["dist", "site", "tour"]


def test_what_is_not_a_tour_is_never_touched(tour: Tour, tmp_path: Path) -> None:
    out = tmp_path / "letters"
    out.mkdir()
    (out / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="expected a tour or an empty folder"):
        write(tour, out)
    assert contents(out) == {"letter.txt": b"dear"}
    (out / "tour.json").write_text("[]")
    with pytest.raises(InputError):
        write(tour, out)
    with pytest.raises(InputError, match="found a file"):
        write(tour, out / "letter.txt")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["dist", "letters", "tour"]


def test_an_empty_folder_becomes_a_tour(tour: Tour, tmp_path: Path) -> None:
    out = tmp_path / "deep" / "site"
    out.mkdir(parents=True)
    assert not is_site(out)
    write(tour, out)
    assert is_site(out)


def test_a_folder_that_cannot_be_written_is_told(tour: Tour, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="expected it to be read and written, found: Not"):
        write(tour, tmp_path / "file" / "site")


def test_a_full_disk_is_told_as_such(
    tour: Tour, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It had been told as a folder that cannot be written."""

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        write(tour, tmp_path / "site")
