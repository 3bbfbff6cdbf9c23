"""Only what must run runs, and a plan says why."""

from __future__ import annotations

import os
import signal
from collections.abc import Mapping
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tourgen.cache import Cache
from tourgen.errors import InputError, TourgenError
from tourgen.scheduler import RoomTasks, run_missing
from tourgen.tasks import Task, in_order, missing_tasks, task, why
from tourgen.workers import Here, Processes, Workers


@dataclass(frozen=True)
class Depth:
    depth: int


def recipe(depth: int = 9, version: int = 1, digest: str = "d") -> tuple[Task[Any], ...]:
    read = task("read", lambda: 3, version=1, digests=(digest,))
    solve = task("solve", lambda n, s: n * s.depth, read, version=version, settings=Depth(depth))
    pack = task("pack", lambda n: [n], solve, version=1)
    look = task("look", lambda n: -n, read, version=1)
    return pack, look


def run_all(
    cache: Cache, rooms: Mapping[str, tuple[Task[Any], ...]], workers: Workers | None = None
) -> tuple[dict[str, tuple[str, ...] | TourgenError], list[tuple[str, str]]]:
    """What came of each room, and what was announced."""
    told: list[tuple[str, str]] = []
    wanted = {room: RoomTasks(goals, 1.0) for room, goals in rooms.items()}
    outcome = run_missing(
        wanted, cache, workers or Here(), lambda room, stage, _: told.append((room, stage))
    )
    return outcome, told


def run(cache: Cache, goals: tuple[Task[Any], ...]) -> list[str]:
    """Names of the tasks that ran."""
    outcome, _ = run_all(cache, {"room": goals})
    ran = outcome["room"]
    assert isinstance(ran, tuple)
    return list(ran)


def test_all_run_once_in_order_and_then_never_again(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    ran = run(cache, recipe())
    assert sorted(ran) == ["look", "pack", "read", "solve"]
    assert ran.index("read") < ran.index("solve") < ran.index("pack")
    assert cache.load(recipe()[0].key) == [27]
    assert run(cache, recipe()) == []


def test_a_changed_setting_runs_its_stage_and_what_follows(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    run(cache, recipe(9))
    assert run(cache, recipe(10)) == ["solve", "pack"]
    assert cache.load(recipe(10)[0].key) == [30]
    assert run(cache, recipe(9)) == [], "the older result is still there"


def test_a_missing_middle_is_not_made_when_nothing_needs_it(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    run(cache, recipe())
    solve = in_order(recipe())[1]
    (folder,) = tmp_path.rglob(solve.key)
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()
    assert missing_tasks(cache, recipe()) == ()


def test_a_broken_input_is_made_anew(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    run(cache, recipe(9))
    read = in_order(recipe())[0]
    (folder,) = tmp_path.rglob(read.key)
    (folder / "result.pickle").write_bytes(b"cut")
    assert run(cache, recipe(10)) == ["read", "solve", "pack"]
    assert cache.load(recipe(10)[0].key) == [30]


def test_what_breaks_again_and_again_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a disk that loses what it is given: the build would never end."""
    cache = Cache(tmp_path)
    load, read = cache.load, in_order(recipe())[0].key
    monkeypatch.setattr(cache, "load", lambda key: None if key == read else load(key))
    outcome, _ = run_all(cache, {"room": recipe()})
    assert isinstance(outcome["room"], TourgenError)
    assert "read: expected a result that lasts, found it broken 3 times" in str(outcome["room"])


def test_several_results_come_as_one_argument(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    parts = tuple(task(f"part {k}", lambda k=k: k, version=1) for k in range(3))
    whole = task("whole", lambda first, all_of: (first, all_of), parts[0], parts, version=1)
    run(cache, (whole,))
    assert cache.load(whole.key) == (0, (0, 1, 2))


def _three() -> int:
    return 3


def _refuse(_: int) -> int:
    raise InputError("scan: expected a room, found none", "look again")


def _twice(n: int) -> int:
    return 2 * n


def _die_once(mark: Path, n: int) -> int:
    """Kill this process, the first time."""
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 5 * n


def _die(_: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


class _Bound:
    """A function with its first argument, which a process can be sent."""

    def __init__(self, function: Any, first: Any) -> None:
        self.function, self.first = function, first

    def __call__(self, *rest: Any) -> Any:
        return self.function(self.first, *rest)


def test_a_room_that_fails_stops_no_other(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    read = task("read", _three, version=1)
    bad, good = task("bad", _refuse, read, version=1), task("good", _twice, read, version=1)
    after = task("after", _twice, bad, version=1)
    outcome, told = run_all(cache, {"one": (after,), "two": (good,)})
    assert isinstance(outcome["one"], InputError)
    assert outcome["one"].message == "room `one`: scan: expected a room, found none"
    assert outcome["two"] == ("read", "good")
    assert ("two", "") in told
    assert ("one", "") not in told
    assert ("one", "after") not in told


def test_what_two_rooms_need_runs_once(tmp_path: Path) -> None:
    outcome, told = run_all(Cache(tmp_path), {"one": recipe(), "two": recipe(10)})
    assert [stage for _, stage in told].count("read") == 2, "told to both"
    assert sum("read" in ran for ran in outcome.values() if isinstance(ran, tuple)) == 2
    first = outcome["one"]
    assert isinstance(first, tuple)
    assert "look" in first


@pytest.mark.parametrize("tries", [1, 2])
def test_a_worker_that_dies_costs_a_retry(tmp_path: Path, tries: int) -> None:
    cache = Cache(tmp_path)
    read = task("read", _three, version=1)
    dies = _Bound(_die_once, tmp_path / "died") if tries == 1 else _die
    last = task("last", dies, read, version=1)
    other = task("other", _twice, read, version=1)
    workers = Processes(2)
    try:
        outcome, _ = run_all(cache, {"one": (last,), "two": (other,)}, workers)
    finally:
        workers.stop()
    assert cache.load(other.key) == 6
    if tries == 1:
        assert cache.load(last.key) == 15
    else:
        error = outcome["one"]
        assert isinstance(error, TourgenError)
        assert error.message.startswith("room `one`: last: expected a result, found")


def test_who_asks_processes_of_which_one_has_died_gets_others() -> None:
    """It dies between two tasks, and nobody has been told yet."""
    workers = Processes(1)
    try:
        assert isinstance(workers.submit(_die, 0).exception(), BrokenProcessPool)
        assert workers.submit(_twice, 2).result() == 4
    finally:
        workers.stop()


@pytest.mark.parametrize(
    ("widest", "shares"), [(4, [[4], [1, 1, 2], [4]]), (1, [[1], [1, 1, 1], [1]])]
)
def test_tasks_that_wait_for_nothing_run_at_once(
    tmp_path: Path, widest: int, shares: list[list[int]]
) -> None:
    """And share the threads; what waits alone gets all of them, or of its machine in a cluster."""

    class Counting:
        most, threads, are_here = 4, 4, True

        def __init__(self) -> None:
            self.widest = widest
            self.shares: list[list[int]] = []
            self.open: list[Future[Any]] = []

        def submit(self, function: Any, /, *arguments: Any) -> Future[Any]:
            if not any(not each.done() for each in self.open):
                self.shares.append([])
            self.shares[-1].append(arguments[-1])
            future: Future[Any] = Future()
            self.open.append(future)
            function(*arguments)
            if len(self.shares[-1]) == (1 if len(self.shares) != 2 else 3):
                for each in self.open:
                    if not each.done():
                        each.set_result(None)
            return future

        def died(self, _: BaseException, /) -> bool:
            return False

    read = task("read", lambda: 3, version=1)
    parts = tuple(task(f"part {k}", lambda n, k=k: n + k, read, version=1) for k in range(3))
    whole = task("whole", lambda found: sum(found), parts, version=1)
    counting = Counting()
    run_all(Cache(tmp_path), {"room": (whole,)}, counting)
    assert counting.shares == shares


def test_what_little_depends_on_runs_where_cores_idle(tmp_path: Path) -> None:
    """Exposure waits for the trimming, which works on one core, and the normals get both."""
    told: list[str] = []
    starts: list[tuple[str, int]] = []

    class Two:
        most, threads, widest, are_here = 2, 2, 2, True

        def __init__(self) -> None:
            self.open: list[Future[Any]] = []

        def submit(self, function: Any, /, *arguments: Any) -> Future[Any]:
            starts.append((told[-1], arguments[-1]))
            future: Future[Any] = Future()
            self.open.append(future)
            function(*arguments)
            if told[-1] != "trim":  # it lasts until something runs beside it
                for each in self.open:
                    each.set_result(None)
                self.open.clear()
            return future

        def died(self, _: BaseException, /) -> bool:
            return False

    scan = task("scan", lambda: 1, version=1)
    normals = task("normals", lambda n: n, scan, version=1)
    exposure = task("exposure", lambda n: n, scan, version=1)
    trim = task("trim", lambda n: n, normals, version=1)
    wanted = {"room": RoomTasks((trim, exposure), 20.0)}
    run_missing(wanted, Cache(tmp_path), Two(), lambda _, stage, __: told.append(stage))
    assert starts == [("scan", 2), ("normals", 2), ("trim", 2), ("exposure", 1)]


def test_a_plan_says_why(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    before = {each.name: each.ingredients for each in in_order(recipe(9))}
    cache.remember_ingredients("room", before)
    before = dict(cache.last_ingredients("room"))
    reasons = {each.name: why(each, before) for each in in_order(recipe(10, digest="e"))}
    assert reasons == {
        "read": "the scan's file changed",
        "solve": "settings.depth 9 -> 10",
        "pack": "after solve",
        "look": "after read",
    }
    assert why(recipe(9, version=2)[0].inputs[0], before) == "version 1 -> 2"
    assert why(recipe(9)[0], before) == "its result is no longer in the cache"
    assert why(recipe(9)[0], {}) == "never built"
