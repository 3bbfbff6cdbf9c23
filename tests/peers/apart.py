"""Work in a process of its own, so that what dies or never ends takes nothing else along."""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
from collections.abc import Callable
from typing import Any


def apart(work: Callable[..., None], *given: Any, limit_s: int | None = None) -> str:
    """Run a module's function; "" or, where it did not come to its end, why.

    Args:
        work: Leaves what it makes in a file.
        given: What it is called with.
        limit_s: It is stopped after so many seconds of the processor, of all cores together: what
            else the machine does is not its fault.
    """
    # Idle threads that spin make a busy machine six times as slow.
    os.environ["OMP_WAIT_POLICY"] = "passive"
    spawn = multiprocessing.get_context("spawn")
    worker = spawn.Process(target=_limited, args=(limit_s, work, given))
    worker.start()
    worker.join()
    if worker.exitcode == -signal.SIGXCPU:
        return f"was stopped after {(limit_s or 0) / 60:.0f} minutes of the processor"
    return f"died (exit code {worker.exitcode})" if worker.exitcode else ""


def _limited(limit_s: int | None, work: Callable[..., None], given: tuple[Any, ...]) -> None:
    if limit_s:
        _, most = resource.getrlimit(resource.RLIMIT_CPU)
        resource.setrlimit(resource.RLIMIT_CPU, (limit_s, most))
    work(*given)
