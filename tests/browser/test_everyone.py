"""A visit for everyone: no violation that axe can find, and all of it by keyboard alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from visitor import Visit, Visitor

AXE = Path(__file__).parents[1] / "node_modules/axe-core/axe.min.js"
SIZES = {"desktop": (1280, 800), "phone": (390, 844)}
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]


def violations(here: Visitor) -> list[str]:
    here.page.evaluate(AXE.read_text("utf-8"))
    found = here.page.evaluate(
        "(tags) => axe.run(document, { runOnly: tags, resultTypes: ['violations'] })", RULES
    )
    return [
        f"{each['id']}: {node['target']}: {node['failureSummary']}"
        for each in found["violations"]
        for node in each["nodes"]
    ]


def tool(here: Visitor, name: str) -> None:
    here.page.locator(".tools button").nth(3).click()
    here.page.locator(".tool-item", has_text=name).click()


MODES = {
    "walk": lambda _: None,
    "orbit": lambda here: here.page.locator(".way").nth(1).click(),
    "dollhouse": lambda here: here.page.locator(".way").nth(2).click(),
    "plan": lambda here: here.page.locator(".way").nth(3).click(),
    "guide": lambda here: here.page.locator(".guide-start").click(),
    "search": lambda here: here.page.locator(".tools button").nth(0).click(),
    "about": lambda here: here.page.locator(".tools button").nth(1).click(),
    "rooms": lambda here: here.page.locator(".tools button").nth(2).click(),
    "tools": lambda here: here.page.locator(".tools button").nth(3).click(),
    "measure": lambda here: tool(here, "Measure"),
    "section": lambda here: tool(here, "Cut open"),
    "tint": lambda here: tool(here, "What was scanned"),
    "share": lambda here: tool(here, "Share this view"),
    "help": lambda here: tool(here, "Keys and gestures"),
    "credits": lambda here: tool(here, "About this tour"),
}


LEAVE = """
for (const each of [".panel:not([hidden]) .round", ".guide-controls .round:last-child",
                    ".tool-bar .round", ".notice:not([hidden]) button", ".way"]) {
  document.querySelector(each)?.click();
}
"""


@pytest.mark.parametrize(
    ("size", "scheme", "modes"),
    [("phone", "dark", tuple(MODES)), ("desktop", "light", ("walk", "plan", "rooms", "share"))],
)
def test_axe_finds_nothing_in_any_mode(
    visit: Visit, size: str, scheme: str, modes: tuple[str, ...]
) -> None:
    found = []
    here = visit(size=SIZES[size], color_scheme=scheme, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    for name in modes:
        MODES[name](here)
        here.page.wait_for_timeout(300)
        found += [f"{name}: {each}" for each in violations(here)]
        here.page.evaluate(f"() => {{{LEAVE}}}")
    assert not found, "\n".join(found)


@pytest.mark.parametrize("page", ["index.html", "rooms/stairs/index.html", "report.html"])
def test_axe_finds_nothing_on_plain_pages(visit: Visit, page: str) -> None:
    here = visit(size=SIZES["desktop"])
    here.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null;")
    here.page.goto(f"{here.origin}/{page}")
    if page != "report.html":  # a page that has no room
        here.page.locator(".notice.grave").wait_for()
    assert not violations(here)


@pytest.mark.parametrize("page", ["index.html", "rooms/stairs/index.html"])
def test_axe_finds_nothing_while_the_poster_stands_alone(visit: Visit, page: str) -> None:
    here = visit(size=SIZES["phone"])
    here.page.route("**/viewer/*.js", lambda _: None)  # scripts are asked for, and never come
    here.page.goto(f"{here.origin}/{page}", wait_until="commit")
    here.page.locator("#tour > img").wait_for()
    assert not violations(here)


def test_targets_are_large_enough_for_a_finger(visit: Visit) -> None:
    here = visit(size=SIZES["phone"], has_touch=True)
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.wait_for_timeout(600)
    small = here.page.evaluate(
        "[...document.querySelectorAll('#tour button, #tour select, #tour a')]"
        ".filter((e) => e.offsetParent && !e.classList.contains('away'))"
        ".map((e) => [e.className, e.offsetWidth, e.offsetHeight])"
        ".filter(([, w, h]) => w < 44 || h < 44)"
    )
    assert small == []


def test_text_at_twice_its_size_still_fits(visit: Visit) -> None:
    here = visit(size=SIZES["desktop"])
    here.open("rooms/chamber1/index.html", levels="root")
    here.page.evaluate("document.documentElement.style.fontSize = '32px'")
    here.page.wait_for_timeout(300)
    outside = here.page.evaluate(
        "[...document.querySelectorAll('#tour .top *, #tour .dock *')]"
        ".filter((e) => e.offsetParent)"
        ".map((e) => [e.className, e.getBoundingClientRect()])"
        ".filter(([, r]) => r.right > innerWidth + 1 || r.left < -1 || r.bottom > innerHeight + 1)"
        ".map(([name]) => String(name))"
    )
    assert outside == []


def test_the_guided_tour_by_keyboard(visit: Visit) -> None:
    here = visit(size=SIZES["desktop"], reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    keyboard = here.page.keyboard

    def has_focus(selector: str) -> bool:
        return bool(here.page.evaluate(f"document.activeElement.matches({selector!r})"))

    here.page.locator(".guide-start").focus()
    keyboard.press("Enter")
    here.wait("document.activeElement.matches('.guide .play')")
    bar = "parseFloat(document.querySelector('.guide-bar').style.transform.slice(7))"
    here.wait(f"{bar} > 0.05")
    here.page.evaluate(
        "window.told = 0; new MutationObserver(() => (window.told += 1)).observe("
        "document.querySelector('.guide-caption'), { childList: true, characterData: true })"
    )
    keyboard.press("Enter")
    here.page.get_by_role("button", name="Play").wait_for()
    assert here.page.evaluate(bar) > 0.05, "as long as one has stayed"
    keyboard.press("Enter")
    keyboard.press("Enter")
    assert here.page.evaluate("window.told") == 0, "nothing is read out again"

    here.page.locator(".guide-caption").focus()
    here.settle()
    before = [*here.position, *here.look]
    for key in ("ArrowDown", "PageDown", "ArrowLeft"):
        keyboard.press(key)
        here.page.wait_for_timeout(300)
    here.settle()
    assert [*here.position, *here.look] == before, "arrows scroll what is read"

    here.page.locator(".guide-controls .round:last-child").focus()
    keyboard.press("Enter")
    assert has_focus(".guide-start")


def test_the_whole_tour_by_keyboard_alone(visit: Visit) -> None:
    here = visit(size=SIZES["desktop"])
    here.open("rooms/chamber1/index.html", levels="root")
    keyboard = here.page.keyboard

    def focus(selector: str) -> None:
        """Tab until something has the focus, and see that it shows."""
        for _ in range(60):
            keyboard.press("Tab")
            if here.page.evaluate(f"document.activeElement.matches({selector!r})"):
                style = "getComputedStyle(document.activeElement).outlineStyle"
                outline = here.page.evaluate(style)
                assert outline != "none"
                return
        raise AssertionError(f"{selector}: no way there by Tab")

    focus(".spot.note")
    keyboard.press("Enter")
    assert here.page.evaluate("document.activeElement.closest('.panel') !== null")
    keyboard.press("Escape")
    assert here.page.evaluate("document.activeElement.matches('.spot.note')")

    focus(".way:nth-of-type(4)")
    keyboard.press("Enter")
    here.wait("window.tourgen.see === 'plan'")
    focus(".way:nth-of-type(1)")
    keyboard.press("Enter")
    here.wait("window.tourgen.see === 'walk'")

    for room in ("stairs", "chamber2"):
        focus(".tools button:nth-of-type(3)")
        keyboard.press("Enter")
        focus(f".rooms a[href*='{room}']")
        keyboard.press("Enter")
        here.await_room(room)
        title = here.page.locator("#tour h1").inner_text()
        assert title in here.page.locator(".unseen").inner_text(), "arrival is announced"

    focus("canvas")
    before = here.position
    keyboard.down("ArrowUp")
    for _ in range(100):
        here.page.wait_for_timeout(100)
        if np.linalg.norm(here.position - before) > 0.1:
            break
    keyboard.up("ArrowUp")
    assert np.linalg.norm(here.position - before) > 0.1
