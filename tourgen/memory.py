"""Memory: how high this process climbs, how much the machine has left, and giving some back."""

from __future__ import annotations

import ctypes
import sys
from contextlib import suppress
from pathlib import Path
from types import TracebackType

_STATUS = Path("/proc/self/status")
_CLEAR_REFS = Path("/proc/self/clear_refs")
_MEMINFO = Path("/proc/meminfo")
_GROUP, _OF_GROUP = Path("/sys/fs/cgroup"), ("max", "current")


class PeakMemory:
    """Measures, inside a ``with`` block, the highest resident set.

    On Linux the kernel's high-water mark is reset first (proc(5), clear_refs); elsewhere the
    figure is the highest since the process began.
    """

    peak_mb: float = 0.0

    def __enter__(self) -> PeakMemory:
        with suppress(OSError):
            _CLEAR_REFS.write_text("5")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.peak_mb = _high_water_mb()


def _high_water_mb() -> float:
    with suppress(OSError, StopIteration, ValueError):
        line = next(s for s in _STATUS.read_text().splitlines() if s.startswith("VmHWM"))
        return round(int(line.split()[1]) / 1024, 1)
    import resource  # not on Windows

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (2**20 if sys.platform == "darwin" else 2**10), 1)


def available_mb() -> float | None:
    """Megabytes that processes may still take, by the machine and by its control group."""
    with suppress(OSError, StopIteration, ValueError):
        lines = _MEMINFO.read_text().splitlines()
        left = int(next(s for s in lines if s.startswith("MemAvailable")).split()[1]) / 1024
        with suppress(OSError, ValueError):
            most, used = (int((_GROUP / f"memory.{name}").read_text()) for name in _OF_GROUP)
            left = min(left, (most - used) / 2**20)
        return left
    return None


def give_back() -> None:
    """Return freed memory to the machine; glibc keeps what was freed between what was not."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL("libc.so.6").malloc_trim(0)
