from __future__ import annotations

import hashlib
import time
from threading import Event, Thread, get_native_id

import numpy as np

from tourgen.stages.packing import await_sleep, laid_out


def test_charts_lie_apart_by_whole_texels_in_one_picture() -> None:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float64)
    flat = np.concatenate([9 * square, 5 * square])
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    owner = np.repeat([0, 1], 4)
    width, height, at = laid_out(flat, owner, np.concatenate([halves, halves + 4]), 2)
    assert width % 4 == height % 4 == 0
    moved = at - flat
    assert (moved == np.round(moved)).all()
    assert (moved == moved[4 * owner]).all()
    assert ((at >= 1) & (at <= (width - 1, height - 1))).all()
    large, small = at[:4], at[4:]
    assert np.maximum(small.min(0) - large.max(0), large.min(0) - small.max(0)).max() >= 2


def test_a_thread_at_work_is_waited_for() -> None:
    """An atlas that ends while its thread is about to sleep would never come to its end."""
    number: list[int] = []
    begun, end = Event(), Event()

    def work() -> None:
        number.append(get_native_id())
        begun.set()
        hashlib.pbkdf2_hmac("sha256", b"", b"", 1_000_000)  # half a second, and no lock is held
        end.wait()

    thread = Thread(target=work)
    thread.start()
    begun.wait()
    before_s = time.monotonic()
    await_sleep(set(number))
    worked_s = time.monotonic() - before_s
    end.set()
    thread.join()
    await_sleep(set(number))
    assert worked_s > 0.05
