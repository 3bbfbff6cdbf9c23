"""Progress: which stage works on which room, and how long is left.

The time left starts from what each stage takes for a megabyte of scan, and is corrected by how
this machine does on this room.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from tourgen.expected import expected_s


@dataclass(frozen=True, slots=True)
class Started:
    """A room's stage has started.

    Attributes:
        room: Id of the room.
        stage: What runs now.
        ahead: What still has to run, the current stage first; empty when the room is done.
        scan_mb: Size of the room's scans, megabytes.
    """

    room: str
    stage: str
    ahead: tuple[str, ...]
    scan_mb: float


Listener = Callable[[Started], None]


@dataclass
class ProgressBars:
    """One bar a room on a terminal, one line a stage elsewhere."""

    console: Console = field(default_factory=lambda: Console(stderr=True))
    _bars: dict[str, TaskID] = field(default_factory=dict)
    _estimates: dict[str, Estimate] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Prepare the display."""
        self._display = Progress(
            TextColumn("{task.fields[room]}"),
            BarColumn(30),
            TextColumn("{task.fields[stage]}"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[left]}"),
            console=self.console,
        )

    def __enter__(self) -> ProgressBars:
        if self.console.is_terminal:
            self._display.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._display.stop()

    def __call__(self, event: Started) -> None:
        """Show that a stage has started."""
        estimate = self._estimates.setdefault(event.room, Estimate(event.scan_mb, event.ahead))
        left = duration(estimate.left_s(event.ahead)) if event.ahead else "done"
        if not self.console.is_terminal:
            told = ", ".join(filter(None, [event.stage, left]))
            self.console.print(f"{event.room}: {told}", highlight=False)
            return
        if event.room not in self._bars:
            self._bars[event.room] = self._display.add_task(
                event.room, total=1.0, room=event.room, stage="", left=""
            )
        self._display.update(
            self._bars[event.room],
            completed=estimate.done_share(event.ahead),
            stage=event.stage,
            left=left,
        )


class Estimate:
    """How long one room still takes."""

    def __init__(self, scan_mb: float, ahead: tuple[str, ...]) -> None:
        self._scan_mb = scan_mb
        self._total = self._expected_s(ahead)
        self._started = time.monotonic()

    def _expected_s(self, stages: tuple[str, ...]) -> float:
        return sum(expected_s(stage, self._scan_mb) for stage in stages)

    def done_share(self, ahead: tuple[str, ...]) -> float:
        """Share of the work that is done."""
        return 1.0 - self._expected_s(ahead) / self._total if self._total else 1.0

    def left_s(self, ahead: tuple[str, ...]) -> float:
        """Seconds left."""
        left = self._expected_s(ahead)
        done = self._total - left
        pace = (time.monotonic() - self._started) / done if done > 0.1 * self._total else 1.0
        return left * pace


def duration(seconds: float) -> str:
    """Seconds in words, roundly."""
    if seconds < 50:
        return f"about {max(5, 5 * round(seconds / 5))} s left"
    return f"about {round(seconds / 60)} min left" if seconds > 90 else "about 1 min left"
