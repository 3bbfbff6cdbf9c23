"""The vigil: whether the kiosk's page lives, by its line and by its signs of life.

The page holds a line open. When its process dies, the system closes that at once; a page that
hangs keeps it open, but gives no sign.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Lock
from typing import Final

COMES_WITHIN_S: Final = 60.0
"""A slow machine starts a browser and loads the page in so long."""
GONE_S: Final = 0.7
"""A line that broke by itself is opened anew in less."""
HANGS_S: Final = 20.0
"""Signs come every two seconds, unless the page is busy."""


class Vigil:
    """Of one start of the browser.

    Args:
        now: A clock that no change of date moves, seconds.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now, self._lock, self._start = now, Lock(), 0
        self.begin()

    def begin(self) -> None:
        """The browser was started, or the page loads anew."""
        with self._lock:
            self._start += 1
            self._lines, self._came = 0, False
            self._since = self._sign = self._now()

    def opened(self) -> int:
        """The page has opened a line. Returns which start it is of."""
        with self._lock:
            self._lines, self._came = self._lines + 1, True
            self._since = self._sign = self._now()
            return self._start

    def closed(self, start: int) -> None:
        """A line is closed; that of a page before this one is found to be broken late."""
        with self._lock:
            if start == self._start:
                self._lines -= 1
                self._since = self._now()

    def alive(self) -> None:
        """The page has given a sign."""
        with self._lock:
            self._sign = self._now()

    @property
    def came(self) -> bool:
        """Whether the page has come."""
        with self._lock:
            return self._came

    @property
    def fault(self) -> str | None:
        """Why the browser is to be started anew; None where all is well."""
        with self._lock:
            now = self._now()
            if not self._came:
                return "the page did not come" if now - self._since > COMES_WITHIN_S else None
            if not self._lines:
                return "the page is gone" if now - self._since > GONE_S else None
            return "the page hangs" if now - self._sign > HANGS_S else None
