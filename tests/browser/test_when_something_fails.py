"""When something fails: tiles asked for again, graphics that come back, a page without either."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from visitor import ROOMY, Visit, pixels


def test_a_tile_that_fails_is_asked_for_again(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
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


def test_a_decoder_that_fails_is_asked_for_again(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.page.route("**/draco_decoder.wasm", lambda route: route.abort())
    here.page.goto(f"{here.origin}/rooms/chamber1/index.html?levels=root")
    notice = here.page.locator(".notice:not([hidden])")
    notice.wait_for()
    notice.get_by_role("button", name="Try again").click()
    notice.wait_for()
    here.page.unroute("**/draco_decoder.wasm")
    notice.get_by_role("button", name="Try again").click()
    here.wait("window.tourgen.ready")
    here.settle()
    assert here.stats["triangles"] > 0
    here.forgive("draco_decoder.wasm", "ERR_FAILED", "Failed to load tile", "Failed to fetch")


def test_a_lost_graphics_context_comes_back(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
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
    one, other = (pixels(each).astype(int) for each in (before, after))
    assert np.abs(one - other).mean() < 2
    here.forgive("CONTEXT_LOST", "Context Lost")


def test_a_room_that_does_not_come_stays_told_whatever_else_is(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce", locale="en")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    here.use("What was scanned")
    notice = here.page.locator(".notice:not([hidden])")
    assert "Orange" in notice.inner_text()
    here.page.route("**/stairs/**/*.glb", lambda route: route.abort())
    here.page.get_by_role("button", name="Rooms").click()
    here.panel.get_by_role("link", name="Spiral stair").click()
    here.page.locator(".notice.grave", has_text="could not be loaded").wait_for()
    here.page.get_by_label("Language").select_option("fr")
    here.page.locator(".notice.grave", has_text="n’a pas pu être chargée").wait_for()
    here.page.evaluate(
        "(() => { const gl = document.querySelector('canvas').getContext('webgl2');"
        "window.graphics = gl.getExtension('WEBGL_lose_context');"
        "window.restored = new Promise((done) =>"
        " gl.canvas.addEventListener('webglcontextrestored', () => setTimeout(done)));"
        "graphics.loseContext(); setTimeout(() => graphics.restoreContext(), 200); })()"
    )
    here.page.evaluate("window.restored")
    assert here.page.locator(".notice.grave").is_visible()
    here.page.unroute("**/stairs/**/*.glb")
    notice.get_by_role("button", name="Réessayer").click()
    here.await_room("stairs")
    assert "Orange" in notice.inner_text(), "the picture is tinted still"
    notice.get_by_role("button", name="Fermer").click()
    assert notice.count() == 0
    here.forgive("stairs", "ERR_FAILED", "Failed to", "CONTEXT_LOST", "Context Lost")


def test_a_script_that_does_not_come_is_told(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce", locale="en")
    scripts = re.compile(r"/viewer/(search|overview|measure)-")
    here.page.route(scripts, lambda route: route.abort())
    here.open("rooms/chamber1/index.html", levels="root")
    missing = here.page.locator(".notice:not([hidden])", has_text="part of this page")
    search = here.page.get_by_role("button", name="Search")
    orbit = here.page.get_by_role("button", name="Orbit")
    for choose in (search.click, orbit.click, lambda: here.use("Measure")):
        choose()
        missing.get_by_role("button", name="Close").click()
        assert missing.count() == 0
    search.click()
    here.page.unroute(scripts)
    with here.page.expect_navigation():
        missing.get_by_role("button", name="Load anew").click()
    here.wait("window.tourgen?.ready")
    search.click()
    here.panel.get_by_role("searchbox").wait_for()
    here.forgive("ERR_FAILED", "dynamically imported")


def test_a_visit_whose_script_does_not_come_is_the_plain_page(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce", locale="en")
    here.page.route("**/viewer/visit-*.js", lambda route: route.abort())
    here.page.goto(f"{here.origin}/rooms/chamber1/index.html")
    here.page.locator(".notice.grave", has_text="The tour could not be loaded").wait_for()
    assert here.page.locator("main.plain").is_visible()
    here.page.unroute("**/viewer/visit-*.js")
    with here.page.expect_navigation():
        here.page.get_by_role("button", name="Try again").click()
    here.wait("window.tourgen?.ready")
    here.forgive("ERR_FAILED")


def test_without_webgl_the_page_tells_all(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
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
