"""A dask cluster on this machine, as dask's own command line starts it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from distributed import Client

_DASK = [sys.executable, "-m", "dask"]
_ALONE = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


@contextmanager
def cluster(
    folder: Path, cores: Sequence[int | None] = (None, None), threads: int = 1
) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """The address of a scheduler, and its workers.

    Args:
        folder: Where it keeps its files.
        cores: That each worker is bound to; None: to no one.
        threads: Of each worker.
    """
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    log = (folder / "dask.log").open("wb")

    def start(core: int | None, *words: str) -> subprocess.Popen[bytes]:
        bound = [] if core is None else ["taskset", "--cpu-list", str(core)]
        there = ["--scheduler-file", str(file), "--no-dashboard"]
        return subprocess.Popen(
            [*bound, *_DASK, *words, *there],
            stdout=log,
            stderr=log,
            cwd=folder,
            env={**os.environ, **_ALONE},
        )

    running = [start(None, "scheduler", "--host", "127.0.0.1", "--port", "0")]
    worker = ("worker", "--nthreads", str(threads), "--no-nanny", "--host", "127.0.0.1")
    running += [start(core, *worker) for core in cores]
    try:
        yield _address(file, len(cores)), running[1:]
    finally:
        for each in running:
            each.kill()
            each.wait()
        log.close()


def _address(file: Path, workers: int) -> str:
    """Of the scheduler, once all workers are there."""
    for _ in range(300):
        if file.exists() and file.stat().st_size:
            break
        time.sleep(0.1)
    with Client(scheduler_file=str(file), timeout=30, set_as_default=False) as client:
        client.wait_for_workers(workers, timeout=60)
        return str(client.scheduler.address)
