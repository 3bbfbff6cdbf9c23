"""The scheduler: tasks of all rooms onto workers, each as soon as what it takes is there.

Of the tasks that can run, the one with most work behind it goes first. A task gets all threads
that are free unless others wait for them too, and starts only where memory is left for what it is
expected to take. What little depends on waits, rather than take threads from a stage that uses
them, for one that is about to leave cores idle. A worker that dies costs a retry; a room that fails
is told and does not stop the others.
"""

from __future__ import annotations

import errno
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tourgen.cache import Cache
from tourgen.errors import StageError, TourgenError
from tourgen.expected import expected_mb, expected_s, leaves_cores
from tourgen.memory import available_mb
from tourgen.tasks import Job, Task, in_order, missing_tasks, run_job
from tourgen.workers import Workers

_TRIES = 2
_LOSSES = 3

Announce = Callable[[str, str, tuple[str, ...]], None]
"""Told the room, the task that starts, and all that still has to run of the room, that one first;
twice "" and nothing when the room is done."""


@dataclass(frozen=True, slots=True)
class RoomTasks:
    """What is wanted of a room.

    Attributes:
        goals: The tasks whose results are.
        scan_mb: Size of its scans, megabytes.
    """

    goals: tuple[Task[Any], ...]
    scan_mb: float


@dataclass
class _Waiting:
    """A task that has not run.

    Attributes:
        task: It.
        rooms: Those that need it.
        behind_s: Seconds that it and the longest chain of tasks after it take.
        needs_s: Seconds that it takes.
        needs_mb: Memory.
        tries: How often a worker died of it.
    """

    task: Task[Any]
    rooms: list[str]
    behind_s: float
    needs_s: float
    needs_mb: float
    tries: int = 0


def run_missing(
    rooms: Mapping[str, RoomTasks],
    cache: Cache,
    workers: Workers,
    announce: Announce,
    profiles: Path | None = None,
) -> dict[str, tuple[str, ...] | TourgenError]:
    """Make what is missing.

    Args:
        rooms: By id.
        cache: Of the tour.
        workers: Where tasks run.
        announce: See ``Announce``.
        profiles: Folder for what is sampled of each task, if it is to be.

    Returns:
        By room the names of the tasks that ran, or why it failed.
    """
    return _Schedule(rooms, cache, workers, announce, profiles).run()


@dataclass
class _Schedule:
    rooms: Mapping[str, RoomTasks]
    cache: Cache
    workers: Workers
    announce: Announce
    profiles: Path | None
    _waiting: dict[str, _Waiting] = field(default_factory=dict)
    _running: dict[Future[Any], tuple[_Waiting, int]] = field(default_factory=dict)
    _ran: dict[str, list[str]] = field(default_factory=dict)
    _failed: dict[str, TourgenError] = field(default_factory=dict)
    _known: dict[str, Task[Any]] = field(default_factory=dict)
    _lost: Counter[str] = field(default_factory=Counter)
    """How often each result was found to be broken."""

    def run(self) -> dict[str, tuple[str, ...] | TourgenError]:
        for room, wanted in self.rooms.items():
            self._ran[room] = []
            self._known |= {each.key: each for each in in_order(wanted.goals)}
            self._add(room, missing_tasks(self.cache, wanted.goals))
        while self._start() or self._running:
            done, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in done:
                self._settle(future)
        return {room: self._failed.get(room) or tuple(ran) for room, ran in self._ran.items()}

    def _add(self, room: str, tasks: tuple[Task[Any], ...]) -> None:
        """Have a room's tasks wait; inputs come first."""
        scan_mb = self.rooms[room].scan_mb
        behind = {each.key: 0.0 for each in tasks}
        for each in reversed(tasks):
            behind[each.key] += expected_s(each.name, scan_mb)
            for needed in each.inputs:
                if needed.key in behind:
                    behind[needed.key] = max(behind[needed.key], behind[each.key])
        for each in tasks:
            if each.key in self._waiting:
                self._waiting[each.key].rooms.append(room)
            elif each.key not in self._keys_running():
                needs_s, needs_mb = (of(each.name, scan_mb) for of in (expected_s, expected_mb))
                waiting = _Waiting(each, [room], behind[each.key], needs_s, needs_mb)
                self._waiting[each.key] = waiting

    def _keys_running(self) -> set[str]:
        return {waiting.task.key for waiting, _ in self._running.values()}

    def _ready(self) -> list[_Waiting]:
        """The tasks that could start, those with most behind them first."""
        not_there = self._waiting.keys() | self._keys_running()
        ready = [
            each
            for each in self._waiting.values()
            if not any(needed.key in not_there for needed in each.task.inputs)
        ]
        return sorted(ready, key=lambda each: -each.behind_s)

    def _start(self) -> bool:
        """Start what can start; whether anything did."""
        started = False
        while ready := [each for each in self._ready() if self._fits(each)]:
            slots = self.workers.most - len(self._running)
            free = self.workers.threads - sum(map(_used, self._running.values()))
            due = [each for each in ready if self._is_due(each, ready[0])]
            if slots < 1 or free < 1 or not due:
                break
            chosen = due[0]
            alone = leaves_cores(chosen.task.name)
            share = free if alone else max(1, free // min(slots, len(due)))
            share = min(share, self.workers.widest)
            del self._waiting[chosen.task.key]
            for room in chosen.rooms:
                self.announce(room, chosen.task.name, self._ahead(room, chosen))
            job = Job.of(chosen.task)
            future = self.workers.submit(run_job, self.cache, job, self.profiles, share)
            self._running[future] = chosen, share
            started = True
        return started

    def _fits(self, each: _Waiting) -> bool:
        """Whether memory is left for a task; one that a worker died of runs alone."""
        if not self._running:
            return True
        if each.tries or any(running.tries for running, _ in self._running.values()):
            return False
        left = available_mb() if self.workers.are_here else None
        return left is None or each.needs_mb < left

    def _is_due(self, each: _Waiting, first: _Waiting) -> bool:
        """Whether a task need not wait for one as long that will leave a core to it.

        Args:
            each: That could start.
            first: Of all that could, the one with most behind it.
        """
        if each is first and not self._running:
            return True
        before = [other for other, _ in self._running.values()]
        if any(leaves_cores(other.task.name) for other in (*before, first)):
            return True
        return not any(
            leaves_cores(other.task.name)
            and other.behind_s > each.behind_s
            and other.needs_s > each.needs_s
            and set(other.rooms) & set(each.rooms)
            for other in self._waiting.values()
        )

    def _ahead(self, room: str, chosen: _Waiting) -> tuple[str, ...]:
        left = (each.task.name for each in self._waiting.values() if room in each.rooms)
        running = (each.task.name for each, _ in self._running.values() if room in each.rooms)
        return (chosen.task.name, *running, *left)

    def _settle(self, future: Future[Any]) -> None:
        """Note how a task ended."""
        each, _ = self._running.pop(future)
        error = future.exception()
        if error is None:
            lost = future.result()
            if lost is not None:  # an input is broken: it is made again, and then this
                self._again(each, self._known[lost])
                return
            for room in each.rooms:
                self._ran[room].append(each.task.name)
                if room not in self._failed and not self._ahead_of(room):
                    self.announce(room, "", ())
            return
        if self.workers.died(error):
            each.tries += 1
            if each.tries < _TRIES:
                self._waiting[each.task.key] = each
                return
        for room in each.rooms:
            self._fail(room, _told(room, each.task.name, error))

    def _ahead_of(self, room: str) -> bool:
        running = (each for each, _ in self._running.values())
        return any(room in each.rooms for each in (*self._waiting.values(), *running))

    def _again(self, each: _Waiting, lost: Task[Any]) -> None:
        self._lost[lost.key] += 1
        if self._lost[lost.key] >= _LOSSES:
            found = f"expected a result that lasts, found it broken {_LOSSES} times"
            error = StageError(f"{lost.name}: {found}", "look after the disk and the memory")
            for room in each.rooms:
                self._fail(room, _told(room, each.task.name, error))
            return
        for room in each.rooms:
            self._add(room, (*missing_tasks(self.cache, (lost,)), each.task))

    def _fail(self, room: str, error: TourgenError) -> None:
        """Note why a room failed, and drop what only it needs."""
        self._failed.setdefault(room, error)
        for key, each in list(self._waiting.items()):
            each.rooms = [other for other in each.rooms if other != room]
            if not each.rooms:
                del self._waiting[key]


def _used(running: tuple[_Waiting, int]) -> int:
    """Threads that a running task keeps busy of those it got."""
    each, threads = running
    return 1 if leaves_cores(each.task.name) else threads


def _told(room: str, stage: str, error: BaseException) -> TourgenError:
    """An error of a task in words."""
    if isinstance(error, TourgenError):
        return type(error)(f"room `{room}`: {error.message}", error.hint)
    if isinstance(error, MemoryError):
        return StageError(
            f"room `{room}`: {stage}: expected enough memory, found none left",
            "build with `--jobs 1`, or raise `surface.detail_mm`",
        )
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return StageError(
            f"room `{room}`: {stage}: expected room on the disk, found none left",
            "free some and build again: finished stages are kept",
        )
    if isinstance(error, ModuleNotFoundError):
        return StageError(
            f"room `{room}`: {stage}: expected `{error.name}` where it runs, found none",
            "install the same tourgen on every worker",
        )
    told = StageError(
        f"room `{room}`: {stage}: expected a result, found {type(error).__name__}: {error}",
        "build again: finished stages are kept; with too little memory use `--jobs 1`",
    )
    told.__cause__ = error
    return told
