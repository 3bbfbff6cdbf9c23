"""Work shared out among threads: every item once, the same by one thread and by many."""

from __future__ import annotations

from threading import Lock

import pytest

from tourgen.threads import in_parts, use_threads


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 2, 7, 8, 9, 50])
def test_every_item_is_done_once_and_no_part_is_too_large(threads: int, count: int) -> None:
    done = [0] * count
    sizes: list[int] = []
    lock = Lock()

    def job(first: int, last: int) -> None:
        with lock:
            sizes.append(last - first)
            for item in range(first, last):
                done[item] += 1

    with use_threads(threads):
        in_parts(job, count, 8)
    assert done == [1] * count
    assert all(0 < size <= 8 for size in sizes)


def test_one_item_goes_alone_before_threads_meet() -> None:
    begun: list[int] = []
    with use_threads(2):
        in_parts(lambda first, last: begun.append(last - first), 30, 10)
    assert begun[0] == 1
