"""A tour that was taken along works whole without a network, and is never shown by halves."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from published import rooms_of
from visitor import ALONG, WAIT_S, Visit, Visitor

from tourgen.site.offline import WORKER, worker_script
from tourgen.site.pages import viewer_folder

WORKERS = (
    "navigator.serviceWorker.getRegistration().then((found) =>"
    " [found?.installing, found?.waiting, found?.active].map((each) => each?.state))"
)
"""What the versions of a tour are at, for who has to find out why one did not come."""


@contextmanager
def serving(site: Path) -> Iterator[tuple[str, Callable[[], None]]]:
    """A server in a process of its own: its address, and how it is cut off."""
    command = [sys.executable, "-u", "-m", "tourgen.cli", "serve", str(site), "--port", "8930"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout
        address = server.stdout.readline().partition(" at ")[2].split(",")[0].split(" ")[0]

        def cut() -> None:
            server.kill()
            server.wait()

        try:
            yield address.rstrip("/"), cut
        finally:
            cut()


def taken_along(visit: Visit, origin: str) -> Visitor:
    """Somebody on a visit of a while; the clock is helped."""
    here = visit(origin, service_workers="allow", reduced_motion="reduce")
    here.page.clock.install()
    here.open("index.html")
    here.page.clock.run_for(21_000)
    here.wait(ALONG)
    return here


def test_after_one_visit_the_whole_tour_works_without_a_server(site: Path, visit: Visit) -> None:
    with serving(site) as (origin, cut):
        here = taken_along(visit, origin)
        cut()
        for room in rooms_of(site):
            here.open(f"rooms/{room}/index.html", lang="fr", levels="leaves")
            here.settle()
            assert here.page.evaluate("window.tourgen.stats.tiles") > 1
        page = here.page
        page.get_by_role("button", name="Visite guidée").click()
        page.locator(".guide-caption").wait_for()
        with page.expect_navigation(url="**/index.html*"):
            page.evaluate("location.href = 'nowhere.html'")
        here.wait("window.tourgen?.ready")
        assert "no such page" in page.locator(".notice").inner_text()
        here.forgive("ERR_CONNECTION_REFUSED", "nowhere.html", "answer 404")


def test_a_sound_is_heard_without_a_server(site: Path, visit: Visit) -> None:
    sound = next(
        note["sound"] for room in rooms_of(site).values() for note in room["notes"] if note["sound"]
    )
    with serving(site) as (origin, cut):
        here = taken_along(visit, origin)
        cut()
        length_s = here.page.evaluate(
            "(address) => new Promise((done, failed) => { const sound = new Audio(address);"
            " sound.onloadedmetadata = () => done(sound.duration); sound.onerror = failed; })",
            f"{origin}/{sound}",
        )
        assert length_s > 1


def test_an_update_is_taken_over_whole_or_not_at_all(
    site: Path, visit: Visit, tmp_path: Path
) -> None:
    here_folder = Path(shutil.copytree(site, tmp_path / "site"))
    with serving(here_folder) as (origin, _):
        here = visit(origin, service_workers="allow", reduced_motion="reduce")
        page = here.page
        page.clock.install()
        page.goto(f"{origin}/kiosk.html?levels=root")
        here.wait("window.tourgen?.ready")
        here.wait(ALONG)
        old = "Ar Steren lighthouse"
        assert old in page.locator(".start-screen").inner_text()

        told = (here_folder / "tour.json").read_text("utf-8")
        (here_folder / "tour.json").write_text(told.replace(old, "A new name"), "utf-8")
        code = (viewer_folder() / WORKER).read_text("utf-8")
        (here_folder / WORKER).write_text(worker_script(here_folder, code), "utf-8")
        (here_folder / "tour.json").write_text(told, "utf-8")  # copied only in part, as yet
        page.clock.run_for(65_000)
        page.wait_for_timeout(3000)
        page.reload()
        here.wait("window.tourgen?.ready")
        assert old in page.locator(".start-screen").inner_text()

        (here_folder / "tour.json").write_text(told.replace(old, "A new name"), "utf-8")
        end = time.monotonic() + WAIT_S
        while time.monotonic() < end:  # looks for news, has it come, looks whether it waits
            page.clock.run_for(65_000)
            page.wait_for_timeout(2500)
            here.wait("window.tourgen?.ready")
            if "A new name" in page.locator(".start-screen").inner_text():
                break
        assert "A new name" in page.locator(".start-screen").inner_text(), page.evaluate(WORKERS)
        here.forgive("integrity", "bad-precaching-response", "Failed to fetch", "sha384")


def test_it_is_installable(visit: Visit) -> None:
    """Chromium's own verdict."""
    here = visit(service_workers="allow")
    here.open("index.html", levels="root")
    devtools = here.page.context.new_cdp_session(here.page)
    manifest = devtools.send("Page.getAppManifest")
    assert manifest["url"] == f"{here.origin}/tour.webmanifest"
    assert manifest["errors"] == []
    errors = devtools.send("Page.getInstallabilityErrors")["installabilityErrors"]
    # A context of a test counts as a private window, which installs nothing.
    assert [each["errorId"] for each in errors] in ([], ["in-incognito"])


def test_who_saves_data_is_asked_first(visit: Visit) -> None:
    here = visit(service_workers="allow", reduced_motion="reduce")
    here.page.add_init_script(
        "Object.defineProperty(Navigator.prototype, 'connection',"
        " { get: () => ({ saveData: true }) })"
    )
    here.page.clock.install()
    here.open("index.html", levels="root")
    here.page.clock.run_for(60_000)
    assert here.page.evaluate("navigator.serviceWorker.getRegistration().then(Boolean)") is False
    here.page.get_by_role("button", name="Tools").click()
    offer = here.page.get_by_role("button", name="Take the tour along")
    assert "MB" in offer.inner_text()
    offer.click()
    here.page.get_by_text("works without a network").wait_for()
    here.wait(ALONG)
    here.page.evaluate(
        "(() => { window.told = [];"
        "navigator.serviceWorker.onmessage = ({ data }) => told.push(data); })()"
    )
    here.page.evaluate("fetch('tour.json').then((answer) => answer.text())")
    here.page.wait_for_timeout(500)
    assert here.page.evaluate("window.told") == [], "what is served is not on its way"
