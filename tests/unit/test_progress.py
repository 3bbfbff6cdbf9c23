"""The time left: falls as stages end, follows the machine's pace, is told roundly."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from tourgen import expected
from tourgen.progress import Estimate, ProgressBars, Started, duration

STAGES = ("clean", "normals", "surface", "unwrap", "bake", "pack")


def test_the_time_left_falls_stage_by_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr("tourgen.progress.time.monotonic", lambda: clock[0])
    estimate = Estimate(20.0, STAGES)
    left = [Estimate(20.0, ahead := STAGES[i:]).left_s(ahead) for i in range(len(STAGES) + 1)]
    assert left == sorted(left, reverse=True)
    assert left[-1] == 0
    assert estimate.done_share(STAGES) == 0
    assert estimate.done_share(()) == 1
    # a machine that took twice as long so far is expected to go on so
    clock[0] = 2 * (left[0] - left[3])
    assert estimate.left_s(STAGES[3:]) == pytest.approx(2 * left[3])


def test_what_is_crowded_in_a_large_scan_takes_little() -> None:
    """150 million points took 10.5 minutes beside other work, and were told to take 81."""
    all_stages = tuple(expected._SECONDS)
    usual, large, largest = (Estimate(mb, all_stages).left_s(all_stages) for mb in (20, 228, 2250))
    assert 5 * usual < large < largest
    assert largest < 2 * large


@pytest.mark.parametrize(
    ("seconds", "told"),
    [
        (1, "about 5 s left"),
        (42, "about 40 s left"),
        (60, "about 1 min left"),
        (200, "about 3 min left"),
    ],
)
def test_durations_are_told_roundly(seconds: float, told: str) -> None:
    assert duration(seconds) == told


def test_without_a_terminal_each_stage_is_a_line() -> None:
    stream = io.StringIO()
    with ProgressBars(Console(file=stream)) as show:
        show(Started("tower", "surface", ("surface", "pack"), 20.0))
        show(Started("tower", "", (), 20.0))
    lines = stream.getvalue().splitlines()
    assert lines[0].startswith("tower: surface, about ")
    assert lines[1] == "tower: done"
