"""What the kiosk's page is told, and what tour.toml may say of it."""

from __future__ import annotations

import base64
import hashlib
import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from tourgen.errors import Faults
from tourgen.site.kiosk import code_of, codes, kiosk_settings
from tourgen.site.offline import icon, worker_script
from tourgen.tour import Kiosk, Tour, load_tour

TOLD: dict[str, Any] = {
    "title": {"en": "Light"},
    "address": "https://example.org/tour/",
    "credits": {"en": '<p>By <a href="https://example.org/?a=1&amp;b=2" rel="noopener">us</a></p>'},
    "rooms": [
        {
            "text": {"en": '<a title="x" href="mailto:us@example.org">Mail</a>'},
            "notes": [{"text": {"en": "<p>No link.</p>"}}],
        }
    ],
}


def tour_with(kiosk: str, folder: Path) -> Tour:
    (folder / "hall.ply").write_bytes(b"ply")
    (folder / "tour.toml").write_text(
        f'[tour]\ntitle = "Light"\n[kiosk]\n{kiosk}\n[[room]]\nid = "hall"\nscans = ["hall.ply"]\n',
        "utf-8",
    )
    return load_tour(folder)


def test_every_address_that_texts_name_has_a_code_of_its_own() -> None:
    found = codes(TOLD)
    assert sorted(found) == [
        "https://example.org/?a=1&b=2",
        "https://example.org/tour/",
        "mailto:us@example.org",
    ]
    assert len(set(found.values())) == 3
    for address in found:
        drawing = ElementTree.fromstring(code_of(address))
        assert drawing.tag.endswith("svg")
        assert drawing.get("viewBox")


def test_a_pin_is_told_by_its_digest_alone() -> None:
    told = kiosk_settings(Kiosk(pin="1911"), TOLD)
    assert "1911" not in json.dumps(told)
    lock = told["pin"]
    again = hashlib.pbkdf2_hmac("sha256", b"1911", bytes.fromhex(lock["salt"]), lock["rounds"])
    assert again.hex() == lock["digest"]
    assert kiosk_settings(Kiosk(), TOLD)["pin"] is None


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ('hours = "10:00-18:00"', dict.fromkeys(("mon", "sat", "sun"), "10:00-18:00")),
        ('hours = { fri = "20:00-02:00" }', {"fri": "20:00-02:00"}),
        ('hours = { fri = "20:00-24:00" }', {"fri": "20:00-24:00"}),
    ],
)
def test_hours_are_for_every_day_or_by_day(line: str, told: dict[str, str], tmp_path: Path) -> None:
    hours = tour_with(line, tmp_path).kiosk.hours
    assert hours is not None
    assert told.items() <= dict(hours).items()


@pytest.mark.parametrize(
    ("line", "fault", "hint"),
    [
        ("idle_s = 5", "kiosk.idle_s: expected 10 to 3600, found 5", ""),
        ("warning_s = 500", "kiosk.warning_s: expected 5 to 120, found 500", ""),
        ('pin = "12"', 'kiosk.pin: expected four to eight digits, found "12"', ""),
        ("pin = 1911", "kiosk.pin: expected a string", ""),
        ('controls = "lower"', "kiosk.controls: expected", ""),
        ('hours = "10-18"', 'kiosk.hours: expected hours such as "10:00-18:00"', ""),
        ('hours = { sat = "25:00-26:00" }', 'kiosk.hours: expected hours such as "10:00-18', ""),
        ('hours = { satt = "10:00-18:00" }', "kiosk.hours: day `satt` does not exist", "`sat`"),
        ("idle = 5", "kiosk.idle: ", "idle_s"),
    ],
)
def test_a_kiosk_at_fault_is_told(line: str, fault: str, hint: str, tmp_path: Path) -> None:
    with pytest.raises(Faults) as raised:
        tour_with(line, tmp_path)
    (found,) = raised.value.faults
    assert fault in found.message
    assert hint in found.hint


def test_the_worker_is_told_every_file_with_its_digest(tmp_path: Path) -> None:
    (tmp_path / "rooms/hall").mkdir(parents=True)
    (tmp_path / "tour.json").write_bytes(b"{}")
    (tmp_path / "rooms/hall/r.glb").write_bytes(b"glTF")
    (tmp_path / "report.json").write_bytes(b"{}")
    (tmp_path / "rooms/hall/preview.jpg").write_bytes(b"jpeg")
    first, _, code = worker_script(tmp_path, "run()").partition("\n")
    assert code == "run()"
    told = json.loads(first.removeprefix("self.tour=").removesuffix(";"))
    assert [file["url"] for file in told["files"]] == ["rooms/hall/r.glb", "tour.json"]
    assert told["bytes"] == 6
    digest = base64.b64encode(hashlib.sha384(b"glTF").digest()).decode()
    assert told["files"][0]["integrity"] == f"sha384-{digest}"
    (tmp_path / "tour.json").write_bytes(b"[]")
    assert worker_script(tmp_path, "run()") != f"{first}\n{code}"


def test_an_icon_is_the_middle_of_a_picture(tmp_path: Path) -> None:
    wide = np.zeros((90, 160, 3), np.uint8)
    wide[:, 35:125] = (200, 40, 10)
    Image.fromarray(wide).save(tmp_path / "wide.webp", lossless=True)
    (tmp_path / "icon.png").write_bytes(icon((tmp_path / "wide.webp").read_bytes(), 48))
    with Image.open(tmp_path / "icon.png") as drawn:
        assert drawn.size == (48, 48)
        assert np.abs(np.asarray(drawn).astype(int) - (200, 40, 10)).max() < 4
