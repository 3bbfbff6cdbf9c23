"""Only what must run runs, and a plan says why."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tourgen.cache import Cache
from tourgen.tasks import Runner, Task, in_order, missing_tasks, task, why


@dataclass(frozen=True)
class Depth:
    depth: int


def recipe(depth: int = 9, version: int = 1, digest: str = "d") -> tuple[Task[Any], ...]:
    read = task("read", lambda: 3, version=1, digests=(digest,))
    solve = task("solve", lambda n, s: n * s.depth, read, version=version, settings=Depth(depth))
    pack = task("pack", lambda n: [n], solve, version=1)
    look = task("look", lambda n: -n, read, version=1)
    return pack, look


def run(cache: Cache, goals: tuple[Task[Any], ...]) -> Runner:
    runner = Runner(cache, goals, lambda _: None)
    runner.run()
    return runner


def test_all_run_once_in_order_and_then_never_again(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    first = run(cache, recipe())
    assert first.ran == ["read", "solve", "pack", "look"]
    assert first.result(recipe()[0]) == [27]
    second = run(cache, recipe())
    assert second.ran == []
    assert second.result(recipe()[0]) == [27]


def test_a_changed_setting_runs_its_stage_and_what_follows(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    run(cache, recipe(9))
    changed = run(cache, recipe(10))
    assert changed.ran == ["solve", "pack"]
    assert changed.result(recipe(10)[0]) == [30]
    assert run(cache, recipe(9)).ran == [], "the older result is still there"


def test_a_missing_middle_is_not_made_when_nothing_needs_it(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    run(cache, recipe())
    solve = in_order(recipe())[1]
    (folder,) = tmp_path.rglob(solve.key)
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()
    assert missing_tasks(cache, recipe()) == ()


def test_a_broken_entry_is_made_anew(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    run(cache, recipe())
    pack = recipe()[0]
    (folder,) = tmp_path.rglob(pack.key)
    (folder / "result.pickle").write_bytes(b"cut")
    runner = run(cache, recipe())
    assert runner.result(pack) == [27]
    assert runner.ran == ["pack"]


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


def test_results_are_let_go_when_no_later_task_needs_them(tmp_path: Path) -> None:
    runner = run(Cache(tmp_path), recipe())
    assert runner._held == {}
