"""Alone: what one process at a time may do with a folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import filelock

from tourgen.errors import InputError


@contextmanager
def alone(lock: Path, fault: InputError) -> Iterator[None]:
    """Hold a lock for as long as the block lasts; who is killed holds it no longer.

    Args:
        lock: Its file, made where there is none.
        fault: Raised where another process holds it.
    """
    lock.parent.mkdir(parents=True, exist_ok=True)
    held = filelock.FileLock(lock)
    try:
        held.acquire(timeout=0)
    except filelock.Timeout:
        raise fault from None
    try:
        yield
    finally:
        held.release()
