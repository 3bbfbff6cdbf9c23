"""Threads: how many a process may use, and work shared out among them.

Parts are fixed by the work and never by the number of threads, so that the same comes out of one
and of many.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

_NATIVE = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
VARIABLE = "TOURGEN_THREADS"
"""Of the environment: a process's share of the cores."""


def limit_native_threads() -> None:
    """Let libraries that are not loaded yet, here and in new processes, start no threads.

    They would fight with ours for the cores, and sums would depend on how many there are.
    """
    for name in _NATIVE:
        os.environ.setdefault(name, "1")


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads() -> int:
    """Threads that this process may use: its share of the cores, where a build gave it one."""
    return int(os.environ.get(VARIABLE) or cores())


@contextmanager
def use_threads(count: int) -> Iterator[None]:
    """Let work inside use so many threads."""
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = str(count)
    try:
        yield
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before


def each(job: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """The result of every item, in their order, worked out on this process's threads."""
    if threads() == 1:
        return [job(item) for item in items]
    with ThreadPoolExecutor(threads()) as pool:
        return list(pool.map(job, items))


def in_parts(job: Callable[[int, int], object], count: int, part: int) -> None:
    """Run ``job(first, last)`` over 0 to ``count`` in parts, on this process's threads.

    One item goes alone, so that loops are compiled before threads meet in them.

    Args:
        part: Items of a part, at least 2.
    """
    if threads() == 1 or count <= part:
        for first in range(0, count, part):
            job(first, min(first + part, count))
        return
    job(0, 1)
    firsts = [1, *range(part, count, part)]
    with ThreadPoolExecutor(threads()) as pool:
        list(pool.map(job, firsts, [*firsts[1:], count]))
