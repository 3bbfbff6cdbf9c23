"""Progress of a film: frames drawn, and how long is left."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from tourgen.progress import duration


class FrameBar:
    """A bar on a terminal, a line a segment elsewhere."""

    def __init__(self, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._display = Progress(
            TextColumn("{task.description}"),
            BarColumn(30),
            TextColumn("{task.completed:.0f} of {task.total:.0f} frames"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[left]}"),
            console=self._console,
        )
        self._task = self._display.add_task("film", total=1, left="")
        self._drawn = 0
        self._started = time.monotonic()

    def __enter__(self) -> FrameBar:
        if self._console.is_terminal:
            self._display.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._console.is_terminal:
            self._display.stop()

    def resume(self, done: int, total: int) -> None:
        """Say how much there is to do, and how much was done by an earlier run."""
        self._drawn = 0
        self._started = time.monotonic()
        self._display.update(self._task, completed=done, total=total)
        if done and not self._console.is_terminal:
            self._console.print(f"film: {done} of {total} frames are there", highlight=False)

    def advance(self) -> None:
        """A frame was drawn."""
        self._drawn += 1
        self._display.update(self._task, advance=1, left=self._left)

    def segment(self) -> None:
        """A segment is whole."""
        if not self._console.is_terminal:
            task = self._display.tasks[0]
            told = f"film: {task.completed:.0f} of {task.total:.0f} frames, {self._left}"
            self._console.print(told, highlight=False)

    @property
    def _left(self) -> str:
        remaining = self._display.tasks[0].remaining or 0
        if not remaining:
            return "done"
        return duration(remaining * (time.monotonic() - self._started) / max(1, self._drawn))
