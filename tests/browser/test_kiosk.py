"""The kiosk: it attracts, lets somebody visit, and forgets them; there is no way out."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page
from visitor import Visit, Visitor

from tourgen.site.kiosk import code_of

SIZE = (960, 600)
PIN = "1911"
IDLE_S, WARNING_S = 60, 15
Kiosk = Callable[..., Visitor]


@pytest.fixture
def kiosk(visit: Visit) -> Iterator[Kiosk]:
    """Makes kiosks whose clock stands unless it is told to run."""

    def make(size: tuple[int, int] = SIZE, at: datetime | None = None, **settings: Any) -> Visitor:
        here = visit(size=size, reduced_motion="reduce", **settings)
        here.page.clock.install(time=at or datetime(2026, 7, 6, 12))
        here.page.goto(f"{here.origin}/kiosk.html?levels=root")
        here.wait("window.tourgen?.ready")
        return here

    return make


def state(page: Page) -> str:
    return str(page.evaluate("document.getElementById('tour').dataset.state"))


def begin(here: Visitor, language: str = "en") -> None:
    here.page.locator(f".begin[lang={language}]").click()
    here.wait("window.tourgen.ready")
    assert state(here.page) == "visit"


def leave_alone(here: Visitor, seconds: float) -> None:
    here.page.clock.run_for(int(1000 * seconds))


def seen(here: Visitor) -> dict[str, Any]:
    """All that a visitor may have changed."""
    page = here.page
    return {
        "room": here.room,
        "position": [round(float(value), 2) for value in here.position],
        "look": [round(float(value), 2) for value in here.look],
        "see": page.evaluate("window.tourgen.see"),
        "language": page.evaluate("document.documentElement.lang"),
        "panel": page.locator(".panel").is_visible(),
        "notice": page.locator(".notice").is_visible(),
        "tools": page.locator(".tool-bar").count(),
        "address": page.url,
    }


# ---- attracting, visiting, forgetting


def test_it_attracts_in_every_language_and_goes_from_stop_to_stop(kiosk: Kiosk) -> None:
    here = kiosk()
    assert state(here.page) == "attract"
    told = here.page.locator(".start-screen").inner_text()
    for words in ("Ar Steren lighthouse", "Phare d'Ar Steren", "Touch to begin", "Touchez"):
        assert words in told
    places = set()
    for _ in range(6):
        leave_alone(here, 10)
        here.wait("window.tourgen.ready")
        places.add((here.room, *(round(float(value), 1) for value in here.position)))
    assert len(places) > 3
    for hidden in (".top", ".dock", ".mini-map"):
        assert not here.page.locator(hidden).is_visible()


@pytest.mark.parametrize("size", [(1280, 800), (1080, 1920)])
def test_nine_languages_all_stand_on_the_screen(
    site: Path, visit: Visit, size: tuple[int, int]
) -> None:
    told = json.loads((site / "tour.json").read_text("utf-8"))
    told["languages"] = ["en", "fr", "de", "ar", "br", "es", "it", "nl", "pt"]
    here = visit(size=size, reduced_motion="reduce")
    here.page.route("**/tour.json", lambda route: route.fulfill(json=told))
    here.page.goto(f"{here.origin}/kiosk.html?levels=root")
    here.wait("window.tourgen?.ready")
    boxes = [each.bounding_box() for each in here.page.locator(".begin").all()]
    assert len(boxes) == len(told["languages"])
    for box in boxes:
        assert box is not None
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= size[1]
    assert "المس للبدء" in here.page.locator(".begin[lang=ar]").inner_text()


def test_a_touch_begins_in_the_language_touched_and_nothing_of_it_stays(kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here, "en")
    fresh = seen(here)
    page = here.page
    begin_again(here, "fr")
    assert seen(here)["language"] == "fr"
    page.get_by_role("button", name="Salles").click()
    page.locator(".panel").get_by_role("link", name="Escalier").click()
    here.await_room("stairs")
    page.get_by_role("button", name="Tourner").click()
    here.wait("window.tourgen.see === 'orbit'")
    page.get_by_role("button", name="Outils").click()
    page.get_by_role("button", name="Ce qui a été relevé").click()
    leave_alone(here, IDLE_S + 1)
    assert state(page) == "warning"
    assert "Êtes-vous toujours là" in page.get_by_role("alertdialog").inner_text()
    leave_alone(here, WARNING_S + 1)
    assert state(page) == "attract"
    begin(here, "en")
    assert seen(here) == fresh


def begin_again(here: Visitor, language: str) -> None:
    here.page.get_by_role("button", name="Start over").click()
    assert state(here.page) == "attract"
    begin(here, language)


def test_who_touches_before_the_tour_shows_itself_is_not_led(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.page.clock.install(time=datetime(2026, 7, 6, 12))
    held: list[Any] = []
    here.page.route("**/viewer/guide-*.js", lambda route: held.append(route))
    here.page.goto(f"{here.origin}/kiosk.html?levels=root")
    here.wait("window.tourgen?.ready")
    while not held:
        here.page.wait_for_timeout(20)
    begin(here)
    stood = here.position
    with here.page.expect_response("**/viewer/guide-*.js"):
        held[0].continue_()
    here.page.wait_for_timeout(500)
    leave_alone(here, 20)
    assert here.position.tolist() == stood.tolist()


def test_whoever_is_still_there_goes_on(kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here)
    leave_alone(here, IDLE_S - 5)
    assert state(here.page) == "visit"
    here.page.mouse.move(300, 300)
    leave_alone(here, IDLE_S - 5)
    assert state(here.page) == "visit"
    leave_alone(here, 10)
    assert state(here.page) == "warning"
    here.page.get_by_role("button", name="Go on").click()
    assert state(here.page) == "visit"
    leave_alone(here, IDLE_S - 5)
    assert state(here.page) == "visit"


def test_whoever_uses_a_gamepad_is_still_there(kiosk: Kiosk) -> None:
    here = kiosk()
    here.page.evaluate(
        "window.pad = { connected: true, axes: [0, 0, 0, 0],"
        "  buttons: Array.from({ length: 17 }, () => ({ pressed: false })) };"
        "navigator.getGamepads = () => [pad];"
        "window.dispatchEvent(new Event('gamepadconnected'))"
    )

    def push() -> None:
        for turn in (1, 0):
            here.page.evaluate(f"pad.axes[2] = {turn}")
            leave_alone(here, 0.2)

    before = here.position
    push()
    assert state(here.page) == "attract"
    for _ in range(4):
        leave_alone(here, 10)
        here.wait("window.tourgen.ready")
    assert np.linalg.norm(here.position - before) > 0.1, "it goes on attracting"
    begin(here)
    leave_alone(here, IDLE_S - 5)
    push()
    leave_alone(here, IDLE_S - 5)
    assert state(here.page) == "visit"
    leave_alone(here, 10)
    assert state(here.page) == "warning"
    push()
    assert state(here.page) == "visit"


def test_who_is_led_and_touches_nothing_is_not_asked(kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here)
    here.page.get_by_role("button", name="Guided tour").click()
    leave_alone(here, IDLE_S + 2)
    here.wait("window.tourgen.ready")
    assert state(here.page) == "visit"


def test_a_changed_clock_changes_nothing(kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here)
    for when in (datetime(2026, 7, 7, 12), datetime(2026, 7, 6, 12)):
        here.page.clock.set_system_time(when)
        leave_alone(here, 1)
        assert state(here.page) == "visit"
    leave_alone(here, IDLE_S)
    assert state(here.page) == "warning"


# ---- no way out


def test_what_leads_out_is_a_code(site: Path, kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here)
    page = here.page
    page.get_by_role("button", name="Tools").click()
    page.get_by_role("button", name="About this tour").click()
    page.locator(".panel").get_by_role("link", name="CC BY 4.0").click()
    code = page.locator(".panel img.code")
    code.wait_for()
    assert page.url.startswith(f"{here.origin}/kiosk.html")
    assert len(page.context.pages) == 1
    address = "https://creativecommons.org/licenses/by/4.0/"
    path = str(code.get_attribute("src")).removeprefix(f"{here.origin}/")
    assert (site / path).read_bytes() == code_of(address)
    assert code.evaluate("image => image.naturalWidth") > 0


KEYS = (
    "Control+p", "Control+s", "Control+o", "Control+f", "Control+r", "Control+u", "Control+d",
    "Control+h", "Control+j", "Control+l", "Control+=", "Control+0", "Control+Shift+i", "F1",
    "F3", "F5", "F7", "F11", "F12", "Alt+ArrowLeft", "Alt+Home", "Meta+l", "Backspace",
    "Shift+Escape",
)  # fmt: skip


def test_keys_gestures_and_drops_that_leave_the_page_are_refused(kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here)
    page = here.page
    page.evaluate(
        "window.passed = [];"
        "for (const kind of ['keydown', 'contextmenu', 'dragstart', 'dragover', 'drop', 'wheel',"
        " 'selectstart', 'auxclick', 'copy', 'paste']) document.addEventListener(kind, (event) => {"
        " if (!event.defaultPrevented) window.passed.push(kind + ' ' + (event.key ?? '')); })"
    )
    for keys in KEYS:
        page.keyboard.press(keys)
    page.mouse.click(400, 300, button="right")
    page.mouse.click(400, 300, button="middle")
    page.evaluate(
        "for (const kind of ['dragstart', 'dragover', 'drop', 'selectstart', 'copy', 'paste'])"
        " document.body.dispatchEvent(new Event(kind, { bubbles: true, cancelable: true }));"
        "document.body.dispatchEvent(new WheelEvent('wheel',"
        " { bubbles: true, cancelable: true, ctrlKey: true }))"
    )
    passed = page.evaluate("window.passed")
    # A modifier by itself does nothing.
    assert [
        each for each in passed if not each.endswith((" Control", " Alt", " Meta", " Shift"))
    ] == []
    assert page.url == f"{here.origin}/kiosk.html?levels=root"
    page.keyboard.press("ArrowLeft")
    assert "keydown ArrowLeft" in page.evaluate("window.passed")


def test_a_key_let_go_beside_another_is_let_go(kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here)
    before = here.look
    keyboard = here.page.keyboard
    keyboard.down("ArrowLeft")
    leave_alone(here, 1)
    keyboard.down("Control")
    keyboard.up("ArrowLeft")
    keyboard.up("Control")
    leave_alone(here, 1)
    look = here.look
    assert look.tolist() != before.tolist()
    leave_alone(here, 1)
    assert here.look.tolist() == look.tolist()


# ---- the service corner


def open_corner(here: Visitor) -> None:
    for _ in range(5):
        here.page.mouse.click(30, 30)
    here.page.locator(".pin-pad").wait_for()


def enter(here: Visitor, pin: str) -> None:
    for digit in pin:
        here.page.get_by_role("button", name=digit, exact=True).click()


def test_the_service_corner_counts_visits_by_room_and_language(kiosk: Kiosk) -> None:
    here = kiosk(accept_downloads=True)
    begin(here, "fr")
    begin_again_from_french(here)
    page = here.page
    page.get_by_role("button", name="Rooms").click()
    page.locator(".panel").get_by_role("link", name="Spiral stair").click()
    here.await_room("stairs")
    open_corner(here)
    enter(here, "1234")
    page.get_by_text("Not these").wait_for()
    enter(here, PIN)
    page.get_by_role("button", name="Save the visits").wait_for()
    assert "00:00:" in page.locator(".panel").inner_text()
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save the visits").click()
    rows = list(csv.DictReader(Path(saved.value.path()).read_text("utf-8").splitlines()))
    visits = page.locator(".figures div", has_text="Visits")
    assert visits.locator("dd").inner_text() == "2"
    assert [(row["room"], row["language"], row["visits"]) for row in rows] == [
        ("", "en", "1"),
        ("", "fr", "1"),
        ("chamber1", "en", "1"),
        ("chamber1", "fr", "1"),
        ("stairs", "en", "1"),
    ]
    assert {row["day"] for row in rows} == {"2026-07-06"}


def begin_again_from_french(here: Visitor) -> None:
    here.page.get_by_role("button", name="Recommencer").click()
    begin(here, "en")


def test_who_guesses_the_pin_waits(kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here)
    open_corner(here)
    for guess in ("0000", "1111", "2222", "3333", "4444"):
        enter(here, guess)
        here.page.get_by_text("Not these").wait_for()
    enter(here, PIN)
    here.page.wait_for_timeout(500)
    assert here.page.locator(".pin-pad").is_visible()
    leave_alone(here, 59)
    open_corner(here)
    leave_alone(here, 2)
    enter(here, PIN)
    here.page.get_by_role("button", name="Save the visits").wait_for()


def test_a_pad_opened_anew_knows_of_the_guesses_before(kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here)
    for guesses in (("0000", "1111", "2222"), ("3333", "4444")):
        open_corner(here)
        for guess in guesses:
            enter(here, guess)
            here.page.get_by_text("Not these").wait_for()
        here.panel.get_by_role("button", name="Close").click()
    open_corner(here)
    enter(here, PIN)
    here.page.wait_for_timeout(500)
    assert here.page.locator(".pin-pad").is_visible()
    leave_alone(here, 50)
    here.page.mouse.move(300, 300)
    leave_alone(here, 11)
    enter(here, PIN)
    here.page.get_by_role("button", name="Save the visits").wait_for()
    open_corner(here)
    enter(here, "0000")
    here.page.get_by_text("Not these").wait_for()
    enter(here, PIN)
    here.page.get_by_role("button", name="Save the visits").wait_for()


def test_where_no_browser_checks_a_pin_that_is_told(visit: Visit) -> None:
    """Over plain http from another machine."""
    here = visit(size=SIZE, reduced_motion="reduce")
    here.page.add_init_script(
        "Object.defineProperty(window, 'isSecureContext', { get: () => false });"
        "Object.defineProperty(Crypto.prototype, 'subtle', { get: () => undefined });"
    )
    here.page.goto(f"{here.origin}/kiosk.html?levels=root")
    here.wait("window.tourgen?.ready")
    begin(here)
    for _ in range(5):
        here.page.mouse.click(30, 30)
    here.panel.get_by_text("over https").wait_for()


# ---- lasting


def test_a_lost_graphics_context_comes_back_or_the_page_begins_anew(kiosk: Kiosk) -> None:
    here = kiosk()
    here.page.evaluate(
        "window.first = true;"
        "window.lost = document.querySelector('canvas').getContext('webgl2')"
        ".getExtension('WEBGL_lose_context'); window.lost.loseContext()"
    )
    leave_alone(here, 2)
    here.page.evaluate("window.lost.restoreContext()")
    leave_alone(here, 2)
    assert here.page.evaluate("window.first")
    assert state(here.page) == "attract"
    here.page.evaluate("window.lost.loseContext()")
    with here.page.expect_navigation():
        leave_alone(here, 8)
    here.wait("window.tourgen?.ready")
    assert not here.page.evaluate("window.first ?? false")
    assert state(here.page) == "attract"


def test_a_room_that_does_not_come_is_asked_for_again(kiosk: Kiosk) -> None:
    here = kiosk()
    begin(here)
    here.page.route("**/stairs/**", lambda route: route.abort())
    here.page.get_by_role("button", name="Rooms").click()
    here.page.locator(".panel").get_by_role("link", name="Spiral stair").click()
    here.page.locator(".notice.grave").wait_for()
    leave_alone(here, IDLE_S + WARNING_S + 2)
    assert state(here.page) == "attract"
    here.await_room("chamber1")
    here.forgive("stairs", "ERR_FAILED", "Failed to fetch")


def test_the_first_room_is_asked_for_again_while_nobody_is_there(visit: Visit) -> None:
    here = visit(size=SIZE, reduced_motion="reduce")
    here.page.clock.install(time=datetime(2026, 7, 6, 12))
    asked: list[str] = []
    here.page.route("**/chamber1/**/*.glb", lambda route: (asked.append("tile"), route.abort()))
    here.page.goto(f"{here.origin}/kiosk.html?levels=root")
    here.page.locator(".notice.grave:not([hidden])").wait_for(state="attached")
    here.page.unroute("**/chamber1/**/*.glb")
    assert asked
    leave_alone(here, 7)
    here.await_room("chamber1")
    assert state(here.page) == "attract"
    here.forgive("chamber1", "ERR_FAILED", "Failed to")
