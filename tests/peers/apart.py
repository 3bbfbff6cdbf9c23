"""Work in a process of its own, so that what dies or never ends takes nothing else along."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from typing import Any


def apart(work: Callable[..., None], *given: Any, limit_s: float | None = None) -> str:
    """Run a module's function; "" or, where it did not come to its end, why.

    Args:
        work: Leaves what it makes in a file.
        given: What it is called with.
        limit_s: After so many seconds it is stopped.
    """
    # Idle threads that spin make a busy machine six times as slow.
    os.environ["OMP_WAIT_POLICY"] = "passive"
    worker = multiprocessing.get_context("spawn").Process(target=work, args=given)
    worker.start()
    worker.join(limit_s)
    if worker.is_alive():
        worker.kill()
        worker.join()
        return f"was stopped after {(limit_s or 0) / 60:.0f} minutes"
    return f"died (exit code {worker.exitcode})" if worker.exitcode else ""
