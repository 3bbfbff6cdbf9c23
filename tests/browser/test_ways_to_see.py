"""Ways to see: orbit, dollhouse, plan, small map, guide, gamepad."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from published import rooms_of, tour_of
from visitor import ROOMY, Visit, box_of


def test_signs_of_doors_are_whole_wherever_one_looks(site: Path, visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    (eye, door), seen = (here.position, rooms_of(site)["chamber1"]["links"][0]["at"]), 0
    sign = here.page.locator(".spot.door:not(.away)")
    along = np.array(door) - eye
    across = np.array([along[1], -along[0], 0])
    for aside in np.linspace(-1, 1, 21):
        here.teleport(list(eye), list(np.array(door) + aside * across))
        for each in sign.all():
            box = box_of(each)
            assert box["x"] >= 0
            assert box["x"] + box["width"] <= ROOMY[0]
            seen += 1
    assert seen > 5


def test_a_room_is_turned_about_and_one_comes_down_where_one_clicks(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.see("Orbit")
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
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    before = here.position
    here.see("Dollhouse")
    here.see("Walk")
    here.settle()
    assert np.allclose(here.position, before, atol=0.02), "where one stood"
    here.see("Dollhouse")
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


def test_a_room_out_of_the_picture_is_brought_into_it_by_tab(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.see("Dollhouse")
    here.settle()
    here.page.keyboard.down("ArrowUp")
    away = here.page.locator(".spot.place.away")
    away.first.wait_for(state="attached")
    here.page.keyboard.up("ArrowUp")
    here.settle()
    away.first.focus()
    here.wait("!document.activeElement.matches('.away')")
    assert here.page.evaluate("document.activeElement.matches('.place')")


def test_the_plan_shows_where_one_is_and_leads_to_where_one_clicks(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.see("Plan")
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
    here.see("Plan")
    plan.get_by_role("button", name="Level 1").click()
    plan.get_by_role("button", name="Chamber of the charts").click()
    here.await_room("chamber2")


@pytest.mark.parametrize(("then", "see", "shown"), [
    ("Plan", "plan", ".plan-sheet"),
    ("Guided tour", "walk", ".guide"),
    ("Walk", "walk", "#tour"),
])  # fmt: skip
def test_what_was_chosen_last_is_seen_however_late_its_script(
    visit: Visit, then: str, see: str, shown: str
) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    held: list[Any] = []
    here.page.route("**/viewer/overview-*.js", lambda route: held.append(route))
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.get_by_role("button", name="Orbit", exact=True).click()
    while not held:
        here.page.wait_for_timeout(20)
    here.page.get_by_role("button", name=then, exact=True).click()
    here.page.locator(shown).wait_for()
    with here.page.expect_response("**/viewer/overview-*.js"):
        held[0].continue_()
    here.page.wait_for_timeout(500)
    assert here.page.evaluate("window.tourgen.see") == see
    assert here.page.locator(shown).is_visible()


def test_the_small_map_turns_up_where_one_walks(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
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
    here = visit(size=ROOMY)
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
    here = visit(size=ROOMY, reduced_motion="reduce")
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
TWO_FRAMES = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def test_a_gamepad_walks_looks_and_opens(site: Path, visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.page.add_init_script(PAD)
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.evaluate("window.dispatchEvent(new Event('gamepadconnected'))")
    before, heading = here.position, here.look
    here.page.evaluate("pad.axes[2] = 1")
    for _ in range(50):
        here.page.wait_for_timeout(100)
        if here.look @ heading < 0.97:
            break
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
    here.page.evaluate(TWO_FRAMES)  # the sign may have been in sight before, elsewhere
    here.page.evaluate("pad.buttons[0].pressed = true")
    here.panel.wait_for()
    assert here.panel.locator("h2").inner_text() == note["title"]["en"]


def test_a_gamepad_takes_over_from_the_guide_on_the_way(visit: Visit) -> None:
    here = visit(size=ROOMY)
    here.page.add_init_script(PAD)
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.evaluate("window.dispatchEvent(new Event('gamepadconnected'))")
    here.page.get_by_role("button", name="Guided tour").click()
    guide = here.page.locator(".guide")
    guide.wait_for()
    here.page.evaluate("pad.buttons[5].pressed = true")
    here.wait("document.querySelector('.guide-count').textContent.startsWith('2 ')")
    here.page.evaluate("pad.axes[2] = 1")
    guide.get_by_role("button", name="Play").wait_for()
    here.page.evaluate("pad.axes[2] = 0")
    here.page.evaluate(TWO_FRAMES)
    stood = here.position
    here.page.wait_for_timeout(1000)
    assert np.allclose(here.position, stood, atol=0.01)
