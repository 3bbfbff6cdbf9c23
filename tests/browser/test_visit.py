"""The visit: every way to see, all that it tells, every address, on the miniature tour."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Locator
from published import rooms_of
from served import served
from visitor import Vector, Visit, Visitor

NODE_MODULES = Path(__file__).parents[1] / "node_modules"
SIZE = (700, 440)


def tour_of(site: Path) -> dict[str, Any]:
    return dict(json.loads((site / "tour.json").read_text("utf-8")))


def see(here: Visitor, way: str) -> None:
    here.page.get_by_role("button", name=way, exact=True).click()
    here.wait(f"window.tourgen.see === {({'Plan': 'plan'} | WAYS)[way]!r}")


WAYS = {"Walk": "walk", "Orbit": "orbit", "Dollhouse": "dollhouse"}


def use(here: Visitor, tool: str) -> None:
    here.page.get_by_role("button", name="Tools", exact=True).click()
    here.page.locator(".tool-item", has_text=tool).click()


def angle_between(one: Vector, other: Vector) -> float:
    cosine = one @ other / np.linalg.norm(one) / np.linalg.norm(other)
    return float(np.arccos(np.clip(cosine, -1, 1)))


def pixels(screenshot: bytes) -> np.ndarray[Any, Any]:
    return np.asarray(Image.open(io.BytesIO(screenshot)).convert("RGB"), int)


def box_of(each: Locator) -> dict[str, float]:
    box = each.bounding_box()
    assert box
    return dict(box)


def panel(here: Visitor) -> Locator:
    return here.page.locator(".panel:not([hidden])")


# ---- ways to see


def test_a_room_is_turned_about_and_one_comes_down_where_one_clicks(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    see(here, "Orbit")
    here.settle()
    outside = here.position
    assert outside[2] > 3, "above the ceiling"
    here.page.mouse.move(350, 220)
    here.page.mouse.down()
    here.page.mouse.move(470, 220, steps=5)
    here.page.mouse.up()
    here.settle()
    assert np.linalg.norm(here.position - outside) > 1
    here.page.mouse.click(350, 235)
    here.wait("window.tourgen.see === 'walk'")
    here.settle()
    assert here.position[2] < 2.6


def test_the_dollhouse_shows_every_room_in_its_place_and_leads_into_it(
    site: Path, visit: Visit
) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    before = here.position
    see(here, "Dollhouse")
    see(here, "Walk")
    here.settle()
    assert np.allclose(here.position, before, atol=0.02), "where one stood"
    see(here, "Dollhouse")
    here.settle()
    names = here.page.locator(".spot.place:not(.away)")
    assert sorted(names.all_inner_texts()) == sorted(
        room["title"]["en"] for room in rooms_of(site).values()
    )
    boxes = {each.inner_text(): box_of(each) for each in names.all()}
    charts, watch = boxes["Chamber of the charts"], boxes["Chamber of the watch"]
    assert charts["y"] < watch["y"], "it lies a storey higher"
    names.filter(has_text="Chamber of the charts").click()
    here.await_room("chamber2")
    assert here.page.evaluate("window.tourgen.see") == "walk"


def test_the_plan_shows_where_one_is_and_leads_to_where_one_clicks(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    see(here, "Plan")
    plan = here.page.locator(".plan-sheet")
    assert plan.locator(".plan-room.here").get_attribute("data-room") == "chamber1"
    assert plan.locator(".scale span").inner_text() in ("1 m", "2 m")
    assert plan.locator(".compass").is_visible()
    box = box_of(plan.locator(".plan-room.here .plan-floor"))
    before = here.position
    here.page.mouse.click(box["x"] + 0.7 * box["width"], box["y"] + 0.7 * box["height"])
    here.wait("window.tourgen.see === 'walk'")
    here.settle()
    moved = here.position - before
    assert moved[0] > 0.5, "to the right on paper is x"
    assert moved[1] < -0.5, "down on paper is -y"
    see(here, "Plan")
    plan.get_by_role("button", name="Level 1").click()
    plan.get_by_role("button", name="Chamber of the charts").click()
    here.await_room("chamber2")


def test_the_small_map_turns_up_where_one_walks(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    you = here.page.locator(".map-arrow")
    before = you.get_attribute("style")
    here.page.keyboard.down("ArrowLeft")
    here.page.wait_for_timeout(500)
    here.page.keyboard.up("ArrowLeft")
    here.settle()
    assert you.get_attribute("style") != before
    marks = here.page.locator(".mini-map .you")
    assert [mark.is_visible() for mark in marks.all()].count(True) == 1
    here.page.locator(".mini-map").click()
    here.wait("window.tourgen.see === 'plan'")


def test_the_guide_leads_from_stop_to_stop_and_into_other_rooms(site: Path, visit: Visit) -> None:
    stops = tour_of(site)["stops"]
    here = visit(size=SIZE)
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.get_by_role("button", name="Guided tour").click()
    guide = here.page.locator(".guide")
    assert guide.locator(".guide-caption").inner_text() == stops[0]["text"]["en"]
    guide.get_by_role("button", name="Next stop").click()
    assert guide.locator(".guide-count").inner_text() == f"2 / {len(stops)}"
    guide.get_by_role("button", name="Pause").click()
    wanted = np.subtract(stops[1]["look_at"], stops[1]["position"])
    wanted /= np.linalg.norm(wanted)
    for _ in range(60):
        here.page.wait_for_timeout(200)
        away_m = np.linalg.norm(here.position - stops[1]["position"])
        if away_m < 0.05 and here.look @ wanted > 0.99:  # it turns to the last
            break
    assert np.allclose(here.position, stops[1]["position"], atol=0.1)
    assert here.look @ wanted > 0.99
    elsewhere = next(i for i, stop in enumerate(stops) if stop["room"] != "chamber1")
    for _ in range(elsewhere - 1):
        guide.get_by_role("button", name="Next stop").click()
    here.await_room(stops[elsewhere]["room"])
    assert guide.is_visible()
    guide.get_by_role("button", name="End the guided tour").click()
    assert not guide.is_visible()


def test_the_guide_goes_on_by_itself_and_waits_when_one_looks_around(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.page.add_init_script(
        "const fetched = window.fetch;"
        "window.fetch = async (...all) => {"
        "  const answer = await fetched(...all);"
        "  if (!String(all[0]).endsWith('tour.json')) return answer;"
        "  const tour = await answer.json();"
        "  tour.stops.forEach((stop) => { stop.seconds = 1; });"
        "  return new Response(JSON.stringify(tour));"
        "};"
    )
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.get_by_role("button", name="Guided tour").click()
    count = here.page.locator(".guide-count")
    count.wait_for()
    here.wait("document.querySelector('.guide-count').textContent.startsWith('2 ')")
    here.page.mouse.move(300, 200)
    here.page.mouse.down()
    here.page.mouse.move(360, 200, steps=4)
    here.page.mouse.up()
    assert here.page.locator(".guide").get_by_role("button", name="Play").is_visible()
    stood = count.inner_text()
    here.page.wait_for_timeout(1500)
    assert count.inner_text() == stood


PAD = """
const buttons = Array.from({ length: 17 }, () => ({ pressed: false }));
const pad = { connected: true, axes: [0, 0, 0, 0], buttons };
navigator.getGamepads = () => [pad];
window.pad = pad;
"""


def test_a_gamepad_walks_looks_and_opens(site: Path, visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.page.add_init_script(PAD)
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.evaluate("window.dispatchEvent(new Event('gamepadconnected'))")
    before, heading = here.position, here.look
    here.page.evaluate("pad.axes[2] = 1")
    here.page.wait_for_timeout(700)
    here.page.evaluate("pad.axes[2] = 0")
    assert here.look @ heading < 0.97
    here.page.evaluate("pad.axes[1] = -1")
    for _ in range(50):
        here.page.wait_for_timeout(100)
        if np.linalg.norm(here.position - before) > 0.15:
            break
    here.page.evaluate("pad.axes[1] = 0")
    assert np.linalg.norm(here.position - before) > 0.15
    note = rooms_of(site)["chamber1"]["notes"][1]
    here.page.evaluate(
        "({ position, look_at }) => window.tourgen.teleport(position, look_at)", note["view"]
    )
    here.page.locator(".spot.note:not(.away)", has_text="Plaque").wait_for()
    here.page.evaluate("pad.buttons[0].pressed = true")
    panel(here).wait_for()
    assert panel(here).locator("h2").inner_text() == note["title"]["en"]


def test_a_headset_shows_the_room_and_one_leaves_it_at_will(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.page.add_init_script(path=NODE_MODULES / "iwer/build/iwer.min.js")
    here.page.add_init_script(
        "window.headset = new IWER.XRDevice(IWER.metaQuest3);"
        "headset.installRuntime({ forceInstall: true });"
    )
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    before = here.position
    use(here, "Virtual reality")
    here.wait("window.tourgen.isImmersed")
    here.wait("window.tourgen.stats.frames > 5")
    assert abs(here.position[2] - before[2]) < 0.5
    heading = here.look
    here.page.evaluate("headset.controllers.right.updateAxes('thumbstick', 1, 0)")
    for _ in range(40):
        here.page.wait_for_timeout(50)
        if here.look @ heading < 0.95:
            break
    turned = np.degrees(angle_between(here.look[:2], heading[:2]))
    assert turned == pytest.approx(30, abs=3), "one step, however long the stick is held"
    here.page.evaluate("headset.controllers.right.updateAxes('thumbstick', 0, 0)")
    here.page.evaluate(
        "headset.controllers.right.position.set(0.2, 1.3, -0.2);"
        "headset.controllers.right.quaternion.set(-0.38, 0, 0, 0.92);"
        "headset.controllers.right.updateButtonValue('trigger', 1)"
    )
    here.page.wait_for_timeout(400)
    stood = here.position
    here.page.evaluate("headset.controllers.right.updateButtonValue('trigger', 0)")
    for _ in range(40):
        here.page.wait_for_timeout(50)
        if np.linalg.norm(here.position - stood) > 0.4:
            break
    assert np.linalg.norm(here.position - stood) > 0.4, "to where one pointed"
    here.page.evaluate("headset.controllers.right.updateButtonValue('squeeze', 1)")
    here.wait("!window.tourgen.isImmersed")
    here.settle()
    assert abs(here.position[2] - before[2]) < 0.3


# ---- what it tells


def test_notes_show_pictures_and_play_sounds_with_captions(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/stairs/index.html#note=1", levels="root")
    panel(here).locator("img").wait_for()
    assert "Section of the tower" in (panel(here).locator("img").get_attribute("alt") or "")
    here.open("rooms/chamber2/index.html#note=2", levels="root")
    sound = here.page.locator(".panel audio")
    sound.wait_for()
    sound.evaluate("each => { each.muted = true; each.play().catch(() => undefined); }")
    captions = panel(here).locator(".captions")
    here.wait("document.querySelector('.captions').textContent !== ''")
    assert captions.inner_text() == "[The swell below the tower]"
    here.page.keyboard.press("Escape")
    assert sound.evaluate("each => each.paused")


def test_languages_change_at_once_and_stay(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce", locale="en")
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
        here = visit(origin=origin, size=SIZE)
        asked: list[str] = []
        here.page.on("request", lambda request: asked.append(request.url.rpartition("/")[2]))
        here.open("rooms/chamber1/index.html", levels="root")
        assert here.page.evaluate("document.documentElement.dir") == "rtl"
        assert here.page.get_by_role("button", name="الأدوات").is_visible()
        assert [name[:2] for name in asked if re.match(r"[a-z]{2}-\w+\.js", name)] == ["ar"]
        tools, titles = (box_of(here.page.locator(f".top .{name}")) for name in ("tools", "titles"))
        assert tools["x"] < titles["x"]


def test_search_finds_a_note_and_leads_before_it(site: Path, visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.get_by_role("button", name="Search").click()
    panel(here).locator("input").fill("telescop")
    found = panel(here).locator(".found-item")
    assert found.first.locator("strong").inner_text() == "Telescope"
    found.first.click()
    here.await_room("chamber2")
    here.settle()
    note = rooms_of(site)["chamber2"]["notes"][1]
    assert np.allclose(here.position, note["view"]["position"], atol=0.15)
    assert panel(here).locator("h2").inner_text() == "Telescope"


def test_search_forgives_accents_and_a_wrong_letter(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce", locale="fr")
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.get_by_role("button", name="Rechercher").click()
    panel(here).locator("input").fill("poele")
    assert panel(here).locator(".found-item strong").first.inner_text() == "Poêle"
    panel(here).locator("input").fill("escalyer")
    assert panel(here).locator(".found-item strong").first.inner_text() == "Escalier à vis"
    panel(here).locator("input").fill("xyzzy")
    assert panel(here).locator(".found-count").inner_text() == "Résultats : 0"


def test_a_known_length_is_measured(site: Path, visit: Visit) -> None:
    """From the floor straight up to the ceiling beside the lamp."""
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    room = rooms_of(site)["chamber1"]
    height = room["bounds"]["max"][2] - room["bounds"]["min"][2]
    place = [1.7, 0.3, 1.6]
    here.teleport(place, [1.7001, 0.3, 0.0])
    use(here, "Measure")
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
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html#see=orbit", levels="root")
    here.wait("window.tourgen.see === 'orbit'")
    here.settle()
    whole = here.picture()
    here.page.evaluate(
        "document.querySelectorAll('#tour > *').forEach((e) => e.removeAttribute('style'))"
    )
    use(here, "Cut open")
    slider = panel(here).locator("input[type=range]")
    slider.fill("0.3")
    here.settle()
    cut = here.picture()
    sky = np.array([205, 216, 224])
    shown = [(np.abs(each.astype(int) - sky).max(axis=2) > 8).mean() for each in (whole, cut)]
    assert shown[1] < 0.9 * shown[0]


def test_what_was_inferred_is_tinted(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html#see=orbit", levels="root")
    here.wait("window.tourgen.see === 'orbit'")
    here.settle()
    before = here.page.screenshot()
    use(here, "What was scanned")
    assert "Orange" in here.page.locator(".notice").inner_text()
    here.settle()
    after = here.page.screenshot()
    one, other = pixels(before), pixels(after)
    redder = (other - one)[100:330, 100:600]
    assert ((redder[..., 0] - redder[..., 2]) > 25).mean() > 0.002
    here.page.locator(".notice button").click()
    assert not here.page.locator(".notice").is_visible()


def test_a_picture_is_saved(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    with here.page.expect_download() as saved:
        use(here, "Save a picture")
    assert saved.value.suggested_filename == "chamber1.png"
    picture = np.asarray(Image.open(saved.value.path()).convert("RGB"))
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    assert picture.std() > 20, "not blank"


def test_how_the_tour_was_made_can_be_cited(site: Path, visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce", locale="en-GB")
    here.open("rooms/chamber1/index.html", levels="root")
    use(here, "About this tour")
    made = rooms_of(site)["chamber1"]["made"]
    text = panel(here).inner_text()
    for expected in (f"{made['points']:,}", "12 May 2026", "CC BY 4.0", "simulated scanner"):
        assert expected in text, expected


# ---- where one is


def test_an_address_brings_a_view_back(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber2/index.html#at=0.5,-1,1.6,90,-10", levels="root")
    here.settle()
    assert here.position == pytest.approx([0.5, -1, 1.6], abs=0.02)
    down = np.radians(10)
    assert here.look == pytest.approx([0, np.cos(down), -np.sin(down)], abs=0.01)
    here.page.mouse.move(300, 200)
    here.page.mouse.down()
    here.page.mouse.move(420, 200, steps=4)
    here.page.mouse.up()
    here.settle()
    here.page.wait_for_timeout(600)
    look, url = here.look, here.page.url
    told = [float(number) for number in url.split("at=")[1].split(",")]
    assert told[:3] == pytest.approx([0.5, -1, 1.6], abs=0.02)
    there = visit(size=SIZE, reduced_motion="reduce")
    there.page.goto(url)
    there.await_room("chamber2")
    assert there.look == pytest.approx(look, abs=0.01)


def test_an_address_that_leads_nowhere_leads_to_the_entrance(site: Path, visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    entry = rooms_of(site)["chamber1"]["entry"]["position"]
    for place in ("at=x,y", "at=1,2", "see=dance&note=99", "at=900,0,1.6,0,0"):
        here.page.goto("about:blank")
        here.open(f"rooms/chamber1/index.html#{place}", levels="root")
        assert np.allclose(here.position, entry, atol=0.1), place
    assert "no such place" in here.page.locator(".notice:not([hidden])").inner_text()


def test_a_page_that_is_not_there_leads_to_the_start_which_says_so(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("index.html#missing", levels="root")
    assert "no such page" in here.page.locator(".notice:not([hidden])").inner_text()
    assert here.room == "chamber1"


def test_back_and_forward_go_through_rooms_and_views(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html#at=1.6,-1.2,1.6,90,0", levels="root")
    here.settle()
    here.page.get_by_role("button", name="Rooms").click()
    panel(here).get_by_role("link", name="Spiral stair").click()
    here.await_room("stairs")
    here.page.go_back()
    here.await_room("chamber1")
    assert here.position == pytest.approx([1.6, -1.2, 1.6], abs=0.05)
    here.page.go_forward()
    here.await_room("stairs")


def test_a_view_is_shared_and_shown_in_another_page(visit: Visit, tmp_path: Path) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    use(here, "Share this view")
    panel(here).locator("textarea").first.wait_for()
    link, frame = (each.input_value() for each in panel(here).locator("textarea").all())
    assert re.fullmatch(rf"{here.origin}/rooms/chamber1/index\.html\?levels=root#at=[-\d.,]+", link)
    (tmp_path / "index.html").write_text(f"<!doctype html><title>x</title>{frame}", "utf-8")
    with served(tmp_path) as elsewhere:
        there = here.page.context.new_page()
        there.goto(f"{elsewhere}/index.html")
        there.frame_locator("iframe").locator(".cover.gone").wait_for(state="attached")


# ---- when something fails


def test_a_tile_that_fails_is_asked_for_again(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    failed: list[str] = []

    def answer(route: Any) -> None:
        url = route.request.url
        if not url.endswith("/r.glb") and failed.count(url) < 2:
            failed.append(url)
            route.fulfill(status=503, body="")
        else:
            route.continue_()

    here.page.route("**/*.glb", answer)
    here.open("rooms/chamber1/index.html")
    for _ in range(100):
        here.page.wait_for_timeout(200)
        if failed and here.page.evaluate("window.tourgen.idle && window.tourgen.stats.tiles > 3"):
            break
    here.settle()
    assert here.stats["tiles"] > 3
    assert here.page.locator(".notice:not([hidden])").count() == 0
    here.forgive("503", "Failed to load tile")


def test_a_lost_graphics_context_comes_back(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    before = here.page.screenshot(clip={"x": 150, "y": 120, "width": 400, "height": 200})
    here.page.evaluate(
        "(() => { const gl = document.querySelector('canvas').getContext('webgl2');"
        "window.graphics = gl.getExtension('WEBGL_lose_context'); graphics.loseContext(); })()"
    )
    here.page.locator(".notice:not([hidden])").wait_for()
    here.page.evaluate("graphics.restoreContext()")
    here.wait("document.querySelector('.notice').hidden")
    here.settle()
    here.page.wait_for_timeout(300)
    after = here.page.screenshot(clip={"x": 150, "y": 120, "width": 400, "height": 200})
    one, other = pixels(before), pixels(after)
    assert np.abs(one - other).mean() < 2
    here.forgive("CONTEXT_LOST", "Context Lost")


def test_without_webgl_the_page_tells_all(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null;")
    here.page.goto(f"{here.origin}/rooms/chamber1/index.html")
    here.page.locator(".notice").wait_for()
    plain = here.page.locator("main.plain")
    assert plain.is_visible()
    assert plain.locator("h1").first.inner_text() == "Chamber of the watch"
    around = plain.locator(".around img")
    around.scroll_into_view_if_needed()
    here.wait("document.querySelector('.around img').naturalWidth === 2048")
    assert plain.get_by_role("heading", name="Box bed").is_visible()
