"""Workers: rooms onto processes of this machine.

Each process gets its share of the cores, so that native threads of two rooms never fight for
the same ones. A room that fails is told and does not stop the others.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.queues import SimpleQueue
from threading import Thread

from tourgen import threads
from tourgen.cache import Cache
from tourgen.errors import StageError, TourgenError
from tourgen.pipeline import RoomRecipe, RoomResult, build_room
from tourgen.progress import Listener, Started

_THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    threads.VARIABLE,
)

_events: SimpleQueue[Started | None]


def build_rooms(
    recipes: tuple[RoomRecipe, ...], cache: Cache, jobs: int, listener: Listener
) -> list[RoomResult | TourgenError]:
    """Build rooms side by side.

    Args:
        recipes: Of the rooms.
        cache: Of the tour.
        jobs: How many rooms at once.
        listener: Told each stage that starts, in this process.

    Returns:
        For each recipe the result, or why there is none.
    """
    if jobs == 1 or len(recipes) == 1:
        return [_attempt(recipe, cache, listener) for recipe in recipes]
    context = get_context("spawn")  # libraries that start threads do not survive a fork
    events: SimpleQueue[Started | None] = context.SimpleQueue()
    share = max(1, threads.cores() // jobs)
    with (
        _forwarding(events, listener),
        _limited_threads(share),
        ProcessPoolExecutor(jobs, context, _initialise, (events,)) as pool,
    ):
        futures = [pool.submit(_in_worker, recipe, cache) for recipe in recipes]
        return [_outcome(recipe, future) for recipe, future in zip(recipes, futures, strict=True)]


def _attempt(recipe: RoomRecipe, cache: Cache, listener: Listener) -> RoomResult | TourgenError:
    try:
        return build_room(recipe, cache, listener)
    except TourgenError as error:
        return type(error)(f"room `{recipe.room.id}`: {error.message}", error.hint)
    except MemoryError:
        return StageError(
            f"room `{recipe.room.id}`: expected enough memory, found none left",
            "build fewer rooms at once with `--jobs 1`, or raise `surface.detail_mm`",
        )


def _initialise(events: SimpleQueue[Started | None]) -> None:
    global _events  # a queue reaches a pool's process only this way
    _events = events
    Thread(target=_die_with_parent, daemon=True).start()


def _die_with_parent() -> None:
    """A build that was killed leaves no process behind that works on for nobody."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _in_worker(recipe: RoomRecipe, cache: Cache) -> RoomResult | TourgenError:
    return _attempt(recipe, cache, _events.put)


def _outcome(
    recipe: RoomRecipe, future: Future[RoomResult | TourgenError]
) -> RoomResult | TourgenError:
    try:
        return future.result()
    except Exception as error:  # a process that died takes its room along, not the others
        return StageError(
            f"room `{recipe.room.id}`: expected a result, found {type(error).__name__}: {error}",
            "build again: finished stages are kept; with too little memory use `--jobs 1`",
        )


@contextmanager
def _forwarding(events: SimpleQueue[Started | None], listener: Listener) -> Iterator[None]:
    def forward() -> None:
        while (event := events.get()) is not None:
            listener(event)

    thread = Thread(target=forward, daemon=True)
    thread.start()
    try:
        yield
    finally:
        events.put(None)
        thread.join()


@contextmanager
def _limited_threads(share: int) -> Iterator[None]:
    """Processes started inside see these limits; libraries read them when they load."""
    before = {name: os.environ.get(name) for name in _THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, str(share)))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
