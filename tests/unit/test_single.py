"""Single files: what is in them, what they allow, and what becomes of the page they are made of."""

from __future__ import annotations

import hashlib
import json
import re
from base64 import b64decode, b64encode
from pathlib import Path
from typing import Any

import pytest

import tourgen.site.single as single
from tourgen.errors import Faults, InputError
from tourgen.site.single import write_singles

SCRIPT = "console.log('the viewer');"
FILE = re.compile(r'data-file="([^"]+)">data:([^;]+);(?:[^,;]+;)?base64,([^<]*)<')

PAGE = """<!doctype html>
<html lang="en"><head>
<meta charset="utf-8">
<meta property="og:image" content="{up}rooms/{room}/preview.jpg">
<link rel="icon" href="{up}viewer/icon.svg" type="image/svg+xml">
<link rel="stylesheet" href="{up}viewer/style-1.css">
<link rel="stylesheet" href="{up}theme/theme.css">
<link rel="preload" as="fetch" href="{up}tour.json" crossorigin>
<link rel="canonical" href="https://example.org/">
<script type="application/ld+json">{{"name": "Light &amp; sea"}}</script>
<script type="module" src="{up}viewer/viewer-1.js"></script>
</head><body>
<div id="tour" data-site="{up}" data-room="{room}">
<img src="{up}rooms/{room}/poster.webp" alt="Light &amp; sea">
</div>
<main class="plain"><h1>{room} &copy;&#39;</h1>
<img src="{up}rooms/{room}/poster.webp" alt="">
<img src="{up}rooms/{room}/notes/1.svg" alt="">
<ul>
<li><a href="{up}rooms/hall/index.html">hall</a></li>
<li><a href="{up}rooms/loft/index.html">loft</a></li>
</ul>
<p><a href="{up}index.html">start</a></p>
<p><a href="https://example.org/#x">elsewhere</a></p>
</main>
</body>
</html>
"""


def room(name: str, to: str) -> dict[str, Any]:
    return {
        "id": name,
        "title": {"en": name},
        "entry": {"position": [0, 0, 1.6], "look_at": [1, 0, 1.6]},
        "links": [{"to": to}],
    }


@pytest.fixture
def site(tmp_path: Path) -> Path:
    told = {
        "start": "hall",
        "languages": ["en"],
        "logo": "theme/logo.svg",
        "rooms": [room("hall", "loft"), room("loft", "hall")],
        "stops": [{"room": "hall", "text": {"en": "here"}}],
    }
    files = {
        "tour.json": json.dumps(told),
        "index.html": PAGE.format(up="", room="hall"),
        "viewer/icon.svg": "<svg/>",
        "viewer/viewer-1.js": "not carried",
        "viewer/style-1.css": "p { color: red; }\n",
        "viewer/draco-1/draco_decoder.wasm": "\0asm",
        "theme/theme.css": '@font-face { src: url("font.woff2") format("woff2"); }\n',
        "theme/font.woff2": "wOF2",
        "theme/logo.svg": "<svg/>",
    }
    for name in ("hall", "loft"):
        files |= {
            f"rooms/{name}/index.html": PAGE.format(up="../../", room=name),
            f"rooms/{name}/tileset.json": "{}",
            f"rooms/{name}/tiles/r.glb": f"glTF of {name}",
            f"rooms/{name}/poster.webp": f"RIFF of {name}",
            f"rooms/{name}/preview.jpg": "not carried",
            f"rooms/{name}/notes/1.svg": "<svg/>",
        }
    for path, content in files.items():
        file = tmp_path / "site" / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content, "utf-8")
    return tmp_path / "site"


def written(site: Path) -> dict[str, str]:
    """The text of each single file by its name."""
    out = site / "single"
    report = write_singles(site, SCRIPT, out)
    assert report["warnings"] == []
    found = {
        file.relative_to(out).as_posix(): file.read_text("utf-8") for file in out.rglob("*.html")
    }
    sizes = {f"single/{name}": len(text.encode()) for name, text in found.items()}
    assert report["bytes"] == sizes
    return found


def carried(text: str) -> dict[str, bytes]:
    return {path: b64decode(data) for path, _, data in FILE.findall(text)}


def test_a_tour_and_every_room_carry_what_the_viewer_asks_for(site: Path) -> None:
    pages = written(site)
    assert sorted(pages) == ["rooms/hall.html", "rooms/loft.html", "tour.html"]
    whole, loft = carried(pages["tour.html"]), carried(pages["rooms/loft.html"])
    for name in ("hall", "loft"):
        assert whole[f"rooms/{name}/tiles/r.glb"] == f"glTF of {name}".encode()
    always = ["theme/logo.svg", "tour.json", "viewer/draco-1/draco_decoder.wasm"]
    assert sorted(loft) == [
        "rooms/loft/notes/1.svg",
        "rooms/loft/tiles/r.glb",
        "rooms/loft/tileset.json",
        *always,
    ]
    assert json.loads(whole["tour.json"]) == json.loads((site / "tour.json").read_bytes())
    poster = b64encode(b"RIFF of loft").decode()
    image = f'<img src="data:image/webp;base64,{poster}" alt="Light &amp; sea" '
    assert f'{image}data-file="rooms/loft/poster.webp">' in pages["rooms/loft.html"]
    assert pages["rooms/loft.html"].count(poster) == 1


def test_a_room_alone_has_no_doors_but_a_guide(site: Path) -> None:
    pages = written(site)
    told = json.loads(carried(pages["rooms/loft.html"])["tour.json"])
    (loft,) = told["rooms"]
    assert told["start"] == loft["id"] == "loft"
    assert loft["links"] == []
    assert [(stop["room"], stop["text"]) for stop in told["stops"]] == [("loft", {"en": "loft"})]
    assert told["stops"][0]["position"] == [0, 0, 1.6]
    told = json.loads(carried(pages["rooms/hall.html"])["tour.json"])
    assert told["stops"] == [{"room": "hall", "text": {"en": "here"}}]


def test_only_what_is_in_the_file_may_run_and_nothing_is_asked_for(site: Path) -> None:
    for page in written(site).values():
        (policy,) = re.findall(r'Content-Security-Policy" content="([^"]+)"', page)
        assert page.index("<head>") < page.index("<meta charset") < page.index(policy)
        assert page.index(policy) < page.index("<link")
        assert page.count("charset=") == 1
        rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
        assert rules["default-src"] == "'none'"
        (script,) = re.findall(r'<script type="module">(.*?)</script>', page, re.DOTALL)
        assert rules["script-src"] == f"{allowed(script)} 'wasm-unsafe-eval'"
        styles = re.findall(r"<style>(.*?)</style>", page, re.DOTALL)
        assert rules["style-src"].split() == [allowed(style) for style in styles]
        assert 'url("data:font/woff2;base64,d09GMg==")' in styles[1]
        text = re.sub(r"\bdata:[^\"<; ]+;[^\"<]+", "", page)
        named = re.findall(r'(?:src|href|content)="([^"]*)"', text)
        assert {name for name in named if not name.startswith(("#", "https:"))} <= {"", policy}
        assert 'rel="preload"' not in page
        assert "og:" not in page
        assert "data-site" not in page


def allowed(text: str) -> str:
    return f"'sha256-{b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def test_links_lead_to_places_in_the_page_or_are_gone(site: Path) -> None:
    pages = written(site)
    links = re.findall(r'<a href="([^"]+)"', pages["rooms/hall.html"])
    assert links == ["#room=hall", "https://example.org/#x"]
    assert "<li></li>" not in pages["rooms/hall.html"]
    assert "start" not in re.sub(r"<script.*?</script>", "", pages["rooms/hall.html"])
    whole = pages["tour.html"]
    assert set(re.findall(r'href="#([^"]+)"', whole)) == set(re.findall(r'id="(room=.*?)"', whole))
    assert "<h1>loft &copy;&#39;</h1>" in whole
    assert '<img alt="" data-shows="rooms/loft/notes/1.svg">' in whole
    assert whole.count("<main") == whole.count("</main>") == 1
    assert '<script type="application/ld+json">{"name": "Light &amp; sea"}</script>' in whole


def test_a_template_without_a_place_for_them_is_told(site: Path) -> None:
    (site / "rooms/hall/index.html").write_text("<p>hall</p>")
    with pytest.raises(InputError, match=r"^`templates/room\.html`: expected a page with `<head>`"):
        write_singles(site, SCRIPT, site / "single")


def test_a_room_too_large_for_browsers_is_told_and_nothing_written(
    site: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(single, "LARGEST_BYTES", 2_000_000)
    (site / "rooms/hall/tiles/r.glb").write_bytes(bytes(3_000_000))
    with pytest.raises(Faults) as faults:
        write_singles(site, SCRIPT, site / "single")
    (fault,) = faults.value.faults
    assert fault.message.startswith("room `hall`: expected a single file of at most ")
    assert fault.message.endswith("MB, found 4 MB")
    assert "texture.texel_mm" in fault.hint
    assert faults.value.exit_code == 2
    assert not (site / "single").exists()


def test_a_tour_too_large_for_browsers_leaves_its_rooms(
    site: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(single, "LARGEST_BYTES", 2_000_000)
    for name in ("hall", "loft"):
        (site / f"rooms/{name}/tiles/r.glb").write_bytes(bytes(1_000_000))
    report = write_singles(site, SCRIPT, site / "single")
    assert sorted(report["bytes"]) == ["single/rooms/hall.html", "single/rooms/loft.html"]
    (warning,) = report["warnings"]
    assert re.fullmatch(r"tour: expected a single file .*, found 2 MB: left out, .*", warning)
