"""What a command takes as a whole: wall time, processor time, and memory of all its processes.

Memory is the sum of proportional set sizes (proc(5), ``smaps_rollup``): a page that several
processes share counts once. Time is told while they run: who is forked by a server is nobody's
child whom the end of the command would count.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

_EVERY_S = 0.2
_FAILED_TELLS = 300


@dataclass(frozen=True)
class Usage:
    """Of one run.

    Attributes:
        wall_s: From start to end.
        processor_s: Of all its processes together, as last seen of each.
        peak_mb: Proportional memory of all its processes, at its highest.
        failed: "" where it came to its end; else why not.
    """

    wall_s: float
    processor_s: float
    peak_mb: float
    failed: str


def measured(command: Sequence[str], *, most_s: float, most_mb: float, log: Path) -> Usage:
    """Run a command to its end, or until it takes too much.

    Args:
        command: With its arguments.
        most_s: It is stopped after so long.
        most_mb: It is stopped when it takes more memory.
        log: What it prints goes there.
    """
    begun = time.monotonic()
    peak_mb, failed = 0.0, ""
    spent_s: dict[int, float] = {}
    with log.open("wb") as stream:
        process = subprocess.Popen(
            command,
            stdout=stream,
            stderr=stream,
            # Idle threads that spin make a busy machine six times as slow.
            env={**os.environ, "OMP_WAIT_POLICY": "passive"},
        )
        while process.poll() is None:
            family = list(_family(process.pid))
            peak_mb = max(peak_mb, sum(map(_proportional_mb, family)))
            for each in family:
                spent_s[each] = max(spent_s.get(each, 0.0), _spent_s(each))
            taken_s = time.monotonic() - begun
            if taken_s > most_s or peak_mb > most_mb:
                failed = "out of memory" if peak_mb > most_mb else f"over {most_s / 60:.0f} min"
                for each in list(_family(process.pid)):
                    with suppress(ProcessLookupError):
                        os.kill(each, signal.SIGKILL)
            time.sleep(_EVERY_S)
    wall_s = time.monotonic() - begun
    if process.returncode and not failed:
        failed = f"exit code {process.returncode}: {log.read_text('utf-8')[-_FAILED_TELLS:]}"
    return Usage(wall_s, sum(spent_s.values()), peak_mb, failed)


def _family(process: int) -> Iterator[int]:
    """A process and all that descend from it."""
    yield process
    try:
        threads = list(Path(f"/proc/{process}/task").iterdir())
        children = [pid for each in threads for pid in (each / "children").read_text().split()]
    except OSError:
        return
    for child in children:
        yield from _family(int(child))


def _proportional_mb(process: int) -> float:
    try:
        told = Path(f"/proc/{process}/smaps_rollup").read_text(encoding="ascii")
    except OSError:
        return 0.0
    return next((int(s.split()[1]) / 1024 for s in told.splitlines() if s.startswith("Pss:")), 0.0)


def _spent_s(process: int) -> float:
    """Processor time of a process, its threads' together (proc(5), ``stat``)."""
    try:
        told = Path(f"/proc/{process}/stat").read_text(encoding="ascii")
    except OSError:
        return 0.0
    user, system = told.rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")
