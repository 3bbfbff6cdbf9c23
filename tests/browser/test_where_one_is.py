"""Where one is: every view has an address, which brings it back, or leads to the start."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from published import rooms_of
from served import served
from visitor import ROOMY, Visit


def test_an_address_brings_a_view_back(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
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
    there = visit(size=ROOMY, reduced_motion="reduce")
    there.page.goto(url)
    there.await_room("chamber2")
    assert there.look == pytest.approx(look, abs=0.01)


def test_an_address_that_leads_nowhere_leads_to_the_entrance(site: Path, visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    entry = rooms_of(site)["chamber1"]["entry"]["position"]
    for place in ("at=x,y", "at=1,2", "see=dance&note=99", "at=900,0,1.6,0,0"):
        here.page.goto("about:blank")
        here.open(f"rooms/chamber1/index.html#{place}", levels="root")
        assert np.allclose(here.position, entry, atol=0.1), place
    assert "no such place" in here.page.locator(".notice:not([hidden])").inner_text()


def test_a_page_that_is_not_there_leads_to_the_start_which_says_so(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("index.html#missing", levels="root")
    assert "no such page" in here.page.locator(".notice:not([hidden])").inner_text()
    assert here.room == "chamber1"


def test_back_and_forward_go_through_rooms_and_views(visit: Visit) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html#at=1.6,-1.2,1.6,90,0", levels="root")
    here.settle()
    here.page.get_by_role("button", name="Rooms").click()
    here.panel.get_by_role("link", name="Spiral stair").click()
    here.await_room("stairs")
    here.page.go_back()
    here.await_room("chamber1")
    assert here.position == pytest.approx([1.6, -1.2, 1.6], abs=0.05)
    here.page.go_forward()
    here.await_room("stairs")


def test_a_view_is_shared_and_shown_in_another_page(visit: Visit, tmp_path: Path) -> None:
    here = visit(size=ROOMY, reduced_motion="reduce")
    here.open("rooms/chamber1/index.html", levels="root")
    here.settle()
    here.use("Share this view")
    here.panel.locator("textarea").first.wait_for()
    link, frame = (each.input_value() for each in here.panel.locator("textarea").all())
    assert re.fullmatch(rf"{here.origin}/rooms/chamber1/index\.html\?levels=root#at=[-\d.,]+", link)
    (tmp_path / "index.html").write_text(f"<!doctype html><title>x</title>{frame}", "utf-8")
    with served(tmp_path) as elsewhere:
        there = here.page.context.new_page()
        there.goto(f"{elsewhere}/index.html")
        there.frame_locator("iframe").locator(".cover.gone").wait_for(state="attached")
