"""What it tells: notes, languages, search, measures, sections, pictures, where it comes from."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
from PIL import Image
from published import rooms_of, tour_of
from served import served
from visitor import ROOMY, Visit, box_of, pixels


def test_notes_show_pictures_and_play_sounds_with_captions(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/stairs/index.html#note=1", levels="root")
    here.panel.locator("img").wait_for()
    assert "Section of the tower" in (here.panel.locator("img").get_attribute("alt") or "")
    here.open("rooms/chamber2/index.html#note=2", levels="root")
    sound = here.page.locator(".panel audio")
    sound.wait_for()
    sound.evaluate("each => { each.muted = true; each.play().catch(() => undefined); }")
    captions = here.panel.locator(".captions")
    here.wait("document.querySelector('.captions').textContent !== ''")
    assert captions.inner_text() == "[The swell below the tower]"
    here.page.keyboard.press("Escape")
    assert sound.evaluate("each => each.paused")


def test_languages_change_at_once_and_stay(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce", locale="en")
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.get_by_label("Language").select_option("fr")
    here.wait("document.documentElement.lang === 'fr'")
    assert here.page.locator("h1").first.inner_text() == "Chambre de veille"
    assert here.page.get_by_label("Langue").input_value() == "fr"
    assert "lang=fr" in here.page.url
    here.page.goto(f"{here.origin}/rooms/chamber2/index.html")
    here.await_room("chamber2")
    assert here.page.locator("#tour h1").inner_text() == "Chambre des cartes"


def test_a_language_from_right_to_left_turns_the_page(
    site: Path, visit: Visit, tmp_path: Path
) -> None:
    tour = tour_of(site)
    tour["languages"] = ["ar"]
    tour["title"] = {"ar": "منارة"}
    for each in site.iterdir():
        if each.name != "tour.json":
            (tmp_path / each.name).symlink_to(each)
    (tmp_path / "tour.json").write_text(json.dumps(tour), "utf-8")
    with served(tmp_path) as origin:
        here = visit(origin=origin, size=ROOMY)
        asked: list[str] = []
        here.page.on("request", lambda request: asked.append(request.url.rpartition("/")[2]))
        here.open("rooms/chamber1/index.html", levels="root")
        assert here.page.evaluate("document.documentElement.dir") == "rtl"
        assert here.page.get_by_role("button", name="الأدوات").is_visible()
        assert [name[:2] for name in asked if re.match(r"[a-z]{2}-\w+\.js", name)] == ["ar"]
        tools, titles = (box_of(here.page.locator(f".top .{name}")) for name in ("tools", "titles"))
        assert tools["x"] < titles["x"]


def test_search_finds_a_note_and_leads_before_it(site: Path, visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.get_by_role("button", name="Search").click()
    here.panel.locator("input").fill("telescop")
    found = here.panel.locator(".found-item")
    assert found.first.locator("strong").inner_text() == "Telescope"
    found.first.click()
    here.await_room("chamber2")
    here.settle()
    note = rooms_of(site)["chamber2"]["notes"][1]
    assert np.allclose(here.position, note["view"]["position"], atol=0.15)
    assert here.panel.locator("h2").inner_text() == "Telescope"


def test_search_for_the_room_one_is_in_leaves_one_there(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    before = here.page.evaluate("[history.length, window.tourgen.stats.bytes]")
    here.page.get_by_role("button", name="Search").click()
    here.panel.locator("input").fill("chamber of the watch")
    here.panel.locator(".found-item", has_text="Chamber of the watch").first.click()
    here.panel.wait_for(state="hidden")
    here.page.wait_for_timeout(500)
    assert here.page.evaluate("[history.length, window.tourgen.stats.bytes]") == before


def test_search_forgives_accents_and_a_wrong_letter(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce", locale="fr")
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.get_by_role("button", name="Rechercher").click()
    here.panel.locator("input").fill("poele")
    assert here.panel.locator(".found-item strong").first.inner_text() == "Poêle"
    here.panel.locator("input").fill("escalyer")
    assert here.panel.locator(".found-item strong").first.inner_text() == "Escalier à vis"
    here.panel.locator("input").fill("xyzzy")
    assert here.panel.locator(".found-count").inner_text() == "Résultats : 0"


def test_a_known_length_is_measured(site: Path, visit: Visit) -> None:
    """From the floor straight up to the ceiling beside the lamp."""
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    room = rooms_of(site)["chamber1"]
    height = room["bounds"]["max"][2] - room["bounds"]["min"][2]
    place = [1.7, 0.3, 1.6]
    here.teleport(place, [1.7001, 0.3, 0.0])
    here.use("Measure")
    here.page.locator(".measure").wait_for()
    here.page.keyboard.press("Enter")
    here.wait("document.querySelector('.tool-hint').textContent.includes('second')")
    here.teleport(place, [1.7001, 0.3, 3.0])
    here.page.keyboard.press("Enter")
    here.wait("window.tourgen.metres !== null")
    metres = here.page.evaluate("window.tourgen.metres")
    assert 0.8 * height < metres < 1.1 * height
    assert here.page.locator(".tool-hint").inner_text() == f"Distance: {metres:.2f} m"
    here.page.locator(".tool-bar button").click()
    assert here.page.locator(".measure").count() == 0


def test_a_room_is_cut_open(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html#see=orbit", levels="root")
    here.wait("window.tourgen.see === 'orbit'")
    here.settle()
    whole = here.picture()
    here.page.evaluate(
        "document.querySelectorAll('#tour > *').forEach((e) => e.removeAttribute('style'))"
    )
    here.use("Cut open")
    slider = here.panel.locator("input[type=range]")
    slider.fill("0.3")
    here.settle()
    cut = here.picture()
    sky = np.array([205, 216, 224])
    shown = [(np.abs(each.astype(int) - sky).max(axis=2) > 8).mean() for each in (whole, cut)]
    assert shown[1] < 0.9 * shown[0]


def test_what_was_inferred_is_tinted(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html#see=orbit", levels="root")
    here.wait("window.tourgen.see === 'orbit'")
    here.settle()
    before = here.page.screenshot()
    here.use("What was scanned")
    assert "Orange" in here.page.locator(".notice").inner_text()
    here.settle()
    after = here.page.screenshot()
    one, other = (pixels(each).astype(int) for each in (before, after))
    redder = (other - one)[100:330, 100:600]
    assert ((redder[..., 0] - redder[..., 2]) > 25).mean() > 0.002
    here.page.locator(".notice button").click()
    assert not here.page.locator(".notice").is_visible()


def test_a_picture_is_saved(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    with here.page.expect_download() as saved:
        here.use("Save a picture")
    assert saved.value.suggested_filename == "chamber1.png"
    picture = np.asarray(Image.open(saved.value.path()).convert("RGB"))
    assert picture.shape == (ROOMY[1], ROOMY[0], 3)
    assert picture.std() > 20, "not blank"


def test_where_no_browser_copies_what_is_to_be_copied_is_selected(visit: Visit) -> None:
    """Over plain http from another machine."""
    here = visit(size=ROOMY, reduced_motion="reduce", locale="en")
    here.page.add_init_script("delete Navigator.prototype.clipboard;")
    here.open("rooms/chamber1/index.html", levels="root")
    here.use("Share this view")
    here.panel.get_by_role("button", name="Copy").first.click()
    field = "document.activeElement"
    here.wait(f"{field}.matches('textarea') && {field}.selectionEnd === {field}.value.length")
    assert here.page.evaluate("String(getSelection())").startswith(here.origin)


def test_how_the_tour_was_made_can_be_cited(site: Path, visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce", locale="en-GB")
    here.open("rooms/chamber1/index.html", levels="root")
    here.use("About this tour")
    made = rooms_of(site)["chamber1"]["made"]
    text = here.panel.inner_text()
    for expected in (f"{made['points']:,}", "12 May 2026", "CC BY 4.0", "simulated scanner"):
        assert expected in text, expected
