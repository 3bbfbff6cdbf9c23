"""Single files: opened from a disk, without a network, they are whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from published import rooms_of, tour_of
from visitor import Visit, Visitor

from tourgen.site.pages import viewer_folder
from tourgen.site.single import write_singles

SIZE = (700, 440)

LOADED = """
[...document.querySelectorAll(%r)].every((each) => each.complete && each.naturalWidth > 0)
"""


@pytest.fixture(scope="module")
def singles(site: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The single files of the miniature tour, in a folder whose name an address must escape."""
    out = tmp_path_factory.mktemp("on a disk") / "single"
    write_singles(site, (viewer_folder() / "single.js").read_text("utf-8"), out)
    return out


@pytest.fixture
def opened(singles: Path, visit: Visit) -> Visit:
    """Makes visitors of single files, who may ask for nothing but the file itself."""

    def make(file: str, place: str = "", **settings: Any) -> Visitor:
        here = visit(origin=singles.as_uri(), size=SIZE, offline=True, **settings)
        page = f"{here.origin}/{file}"
        here.page.on(
            "request",
            lambda request: (
                None
                if request.url.startswith(("data:", "blob:", page))
                else here.faults.append(f"request beside the page: {request.url}")
            ),
        )
        here.page.goto(page + place)
        return here

    return make


def test_one_walks_through_doors_and_back_through_history(site: Path, opened: Visit) -> None:
    here = opened("tour.html")
    here.await_room("chamber1")
    door = next(link for link in rooms_of(site)["chamber1"]["links"] if link["to"] == "stairs")
    back = next(link for link in rooms_of(site)["stairs"]["links"] if link["to"] == "chamber1")
    here.teleport(back["arrive"]["position"], door["at"])
    here.page.locator(".door[data-to=stairs]").click()
    here.await_room("stairs")
    here.settle()
    assert "tour.html#room=stairs" in here.page.url
    here.page.go_back()
    here.await_room("chamber1")
    here.page.go_forward()
    here.await_room("stairs")


def test_notes_show_pictures_and_play_sounds_with_captions(opened: Visit) -> None:
    here = opened("tour.html", "#room=stairs&note=1")
    here.await_room("stairs")
    panel = here.page.locator(".panel:not([hidden])")
    panel.locator("img").wait_for()
    here.wait(LOADED % ".panel img")
    here.page.get_by_role("button", name="Rooms", exact=True).click()
    here.wait(LOADED % ".rooms img")
    panel.get_by_role("button", name="Telescope").click()
    here.await_room("chamber2")
    panel.locator("audio").wait_for()
    here.page.evaluate(
        "const it = document.querySelector('.panel audio'); it.muted = true; it.play()"
    )
    here.wait("document.querySelector('.panel audio').currentTime > 0")
    here.wait("document.querySelector('.captions').textContent !== ''")
    here.wait("document.querySelector('.panel audio').seekable.end(0) > 1")


def test_all_ways_to_see_and_the_language_stand_in_the_address(site: Path, opened: Visit) -> None:
    here = opened("tour.html")
    here.await_room("chamber1")
    here.page.locator("header select").select_option("fr")
    assert here.page.locator("header h1").inner_text() == rooms_of(site)["chamber1"]["title"]["fr"]
    for way, name in (("orbit", "Tourner"), ("dollhouse", "Maquette"), ("plan", "Plan")):
        here.page.locator(".way", has_text=name).click()
        here.wait(f"window.tourgen.see === {way!r}")
        here.settle()
        assert f"see={way}" in here.page.url
    assert "lang=fr" in here.page.url
    again = opened("tour.html", "#room=stairs&lang=fr&see=dollhouse")
    again.await_room("stairs")
    again.wait("window.tourgen.see === 'dollhouse'")
    again.settle()
    assert again.page.locator("header h1").inner_text() == rooms_of(site)["stairs"]["title"]["fr"]


def test_the_guide_leads_into_other_rooms(site: Path, opened: Visit) -> None:
    stops = tour_of(site)["stops"]
    elsewhere = next(i for i, stop in enumerate(stops) if stop["room"] != stops[0]["room"])
    here = opened("tour.html")
    here.await_room(stops[0]["room"])
    here.page.get_by_role("button", name="Guided tour").click()
    for _ in range(elsewhere):
        here.page.get_by_role("button", name="Next stop").click()
    here.await_room(stops[elsewhere]["room"])


def test_a_room_by_itself_has_no_door_that_leads_nowhere(site: Path, opened: Visit) -> None:
    here = opened("rooms/chamber1.html")
    here.await_room("chamber1")
    here.settle()
    assert here.page.locator(".door").count() == 0
    assert here.page.locator(".note").count() == len(rooms_of(site)["chamber1"]["notes"])
    here.page.get_by_role("button", name="Tools", exact=True).click()
    assert here.page.locator(".tool-item", has_text="Share").count() == 0, "nobody has this disk"
    here.page.get_by_role("button", name="Guided tour").click()
    stops = [stop for stop in tour_of(site)["stops"] if stop["room"] == "chamber1"]
    assert here.page.locator(".guide-count").inner_text() == f"1 / {len(stops)}"
    lost = opened("rooms/chamber1.html", "#room=stairs")
    lost.await_room("chamber1")
    lost.page.locator(".notice", has_text="no such page").wait_for()


def test_without_a_graphics_card_it_shows_its_pictures_and_texts(opened: Visit) -> None:
    here = opened("tour.html", java_script_enabled=False)
    assert here.page.locator("#room\\=stairs").is_visible(), "without script, too"
    here = opened("rooms/chamber2.html")
    here.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null;")
    here.page.reload()
    here.page.locator(".notice.grave").wait_for()
    here.page.evaluate("document.querySelectorAll('img').forEach((it) => it.scrollIntoView())")
    here.wait(LOADED % ".plain img")
    here.page.evaluate("document.querySelector('.plain audio').load()")
    here.wait("document.querySelector('.plain audio').duration > 1")


def test_no_other_script_may_run(opened: Visit) -> None:
    here = opened("rooms/stairs.html")
    here.await_room("stairs")
    here.page.evaluate(
        "const it = document.createElement('script');"
        "it.textContent = 'window.isTricked = true'; document.body.append(it)"
    )
    assert here.page.evaluate("window.isTricked") is None
    assert any("Content Security Policy" in fault for fault in here.faults)
    here.forgive("Content Security Policy")
