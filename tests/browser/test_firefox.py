"""The visit in Firefox: a room opens, is drawn, and is walked in, without an error."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from firefox import opened

SIZE = (640, 480)
STEP_M = 0.1
SHADES = 100
"""Of grey; what is blank has few."""
HEARD = """(() => {
  window.heard = [];
  addEventListener("error", ({ message }) => window.heard.push(message));
  addEventListener("unhandledrejection", ({ reason }) => window.heard.push(String(reason)));
  return true;
})()
"""


def test_a_room_is_walked_in_firefox(origin: str, tmp_path: Path) -> None:
    program = shutil.which("firefox-esr")
    assert program, "firefox-esr: expected on the path, found none; `make test` installs it"
    with opened(Path(program), tmp_path, SIZE) as here:
        here.call("WebDriver:Navigate", url=f"{origin}/rooms/chamber1/index.html?levels=root")
        assert here.evaluate(HEARD)
        here.wait("window.tourgen?.idle")
        shown = here.picture().mean(axis=2)
        assert len(np.unique(shown.round())) > SHADES
        before = np.array(here.evaluate("window.tourgen.position"))
        here.hold("w", 1000)
        here.wait("window.tourgen.idle")
        after = np.array(here.evaluate("window.tourgen.position"))
        assert np.linalg.norm(after - before) > STEP_M
        assert here.evaluate("window.heard") == []
        assert (
            here.evaluate("document.querySelector('.notice:not([hidden])')?.innerText ?? ''") == ""
        )
