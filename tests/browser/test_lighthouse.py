"""Lighthouse finds nothing to mend on a room's page; `make bench-viewer` asks how fast it is."""

from __future__ import annotations

from lighthouse import judged

ASKED = ("accessibility", "best-practices", "seo")


def test_lighthouse_finds_nothing_to_mend(origin: str) -> None:
    found = judged(f"{origin}/rooms/chamber1/index.html", ASKED)
    assert found.scores == dict.fromkeys(ASKED, 100), "\n".join(found.faults)
