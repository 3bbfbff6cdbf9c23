"""Threads: how many a process may use, and work shared out among them.

Parts are fixed by the work and never by the number of threads, so that the same comes out of one
and of many.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

VARIABLE = "TOURGEN_THREADS"
"""Of the environment: a process's share of the cores."""


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads() -> int:
    """Threads that this process may use: its share of the cores, where a build gave it one."""
    return int(os.environ.get(VARIABLE) or cores())


def each(job: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """The result of every item, in their order, worked out on this process's threads."""
    if threads() == 1:
        return [job(item) for item in items]
    with ThreadPoolExecutor(threads()) as pool:
        return list(pool.map(job, items))


def in_parts(job: Callable[[int, int], object], count: int, part: int) -> None:
    """Run ``job(first, last)`` over 0 to ``count`` in parts, on this process's threads.

    The first part goes alone, so that loops are compiled before threads meet in them.
    """
    firsts = list(range(0, count, part))
    alone = 1 if threads() > 1 else len(firsts)
    for first in firsts[:alone]:
        job(first, min(first + part, count))
    if firsts[alone:]:
        with ThreadPoolExecutor(threads()) as pool:
            list(pool.map(lambda first: job(first, min(first + part, count)), firsts[alone:]))
