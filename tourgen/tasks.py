"""A task is a stage bound to its inputs and settings, keyed before anything runs."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, is_dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from tourgen.cache import Cache, Cost, Ingredients, key_of, library_version
from tourgen.memory import PeakMemory, give_back
from tourgen.profile import sampled
from tourgen.threads import use_threads

Result = TypeVar("Result", covariant=True)


@dataclass(frozen=True, eq=False)
class Task(Generic[Result]):
    """A stage to be run, or not, when somebody asks for its result.

    Attributes:
        name: The stage's name, one a room.
        run: Called with the inputs' results and, where there are any, the settings.
        arguments: The tasks whose results it takes; those of a tuple come as a tuple.
        settings: A frozen dataclass, or None.
        ingredients: What its key is made of.
        key: Where its result is kept.
    """

    name: str
    run: Callable[..., Result]
    arguments: tuple[Task[Any] | tuple[Task[Any], ...], ...]
    settings: Any
    ingredients: Ingredients
    key: str

    @property
    def inputs(self) -> tuple[Task[Any], ...]:
        """The tasks whose results it takes, one after the other."""
        return _flat_inputs(self.arguments)


def task(
    name: str,
    run: Callable[..., Result],
    *arguments: Task[Any] | tuple[Task[Any], ...],
    version: int,
    libraries: tuple[str, ...] = (),
    settings: Any = None,
    digests: tuple[str, ...] = (),
) -> Task[Result]:
    """Bind a stage.

    Args:
        name: The stage's name.
        run: The stage.
        arguments: The tasks that feed it; the results of a tuple of them come as one argument.
        version: Of the stage's code.
        libraries: Distributions whose version may change the result.
        settings: A frozen dataclass, the stage's last argument; None where it has none.
        digests: Of the files that it reads.
    """
    ingredients = {
        "stage": name,
        "version": version,
        "libraries": {library: library_version(library) for library in libraries},
        "settings": asdict(settings) if is_dataclass(settings) else None,  # type: ignore[arg-type]
        "files": list(digests),
        "inputs": {each.name: each.key for each in _flat_inputs(arguments)},
    }
    ingredients = json.loads(json.dumps(ingredients))  # as it will be read back: tuples are lists
    return Task(name, run, arguments, settings, ingredients, key_of(ingredients))


def _flat_inputs(arguments: tuple[Task[Any] | tuple[Task[Any], ...], ...]) -> tuple[Task[Any], ...]:
    return tuple(
        each
        for argument in arguments
        for each in (argument if isinstance(argument, tuple) else (argument,))
    )


def in_order(goals: tuple[Task[Any], ...]) -> tuple[Task[Any], ...]:
    """The goals and all that they need, inputs first, each once."""

    def walk(each: Task[Any], seen: set[str]) -> Iterator[Task[Any]]:
        if each.key in seen:
            return
        seen.add(each.key)
        for needed in each.inputs:
            yield from walk(needed, seen)
        yield each

    seen: set[str] = set()
    return tuple(each for goal in goals for each in walk(goal, seen))


@dataclass(frozen=True, slots=True)
class Job:
    """What a process needs to run a task.

    Attributes:
        run: See ``Task``.
        arguments: Keys of the results that it takes, as the task has them.
        settings: See ``Task``.
        key: Where its result is kept.
    """

    run: Callable[..., Any]
    arguments: tuple[str | tuple[str, ...], ...]
    settings: Any
    key: str

    @staticmethod
    def of(each: Task[Any]) -> Job:
        """The job of a task."""
        keys = tuple(
            tuple(task.key for task in argument) if isinstance(argument, tuple) else argument.key
            for argument in each.arguments
        )
        return Job(each.run, keys, each.settings, each.key)


def run_job(cache: Cache, job: Job, profiles: Path | None, threads: int) -> str | None:
    """Run a task whose inputs are in the cache, and keep its result there.

    Args:
        cache: Of the tour.
        job: The task's.
        profiles: Folder for what is sampled of it; None: nothing is.
        threads: That it may use.

    Returns:
        None, or the key of an input that is not there, or is broken.
    """
    with use_threads(threads), PeakMemory() as memory:
        started = time.perf_counter()
        try:
            arguments = [_loaded(cache, argument) for argument in job.arguments]
        except _LostError as lost:
            return lost.key
        with sampled(profiles and profiles / job.key):
            result = job.run(*arguments, *(() if job.settings is None else (job.settings,)))
        del arguments
    cost = Cost(round(time.perf_counter() - started, 3), memory.peak_mb)
    cache.store(job.key, result, cost)
    del result
    give_back()
    return None


class _LostError(Exception):
    """An entry is not in the cache, or broken."""

    def __init__(self, key: str) -> None:
        self.key = key


def _loaded(cache: Cache, argument: str | tuple[str, ...]) -> Any:
    if isinstance(argument, tuple):
        return tuple(_loaded(cache, key) for key in argument)
    found = cache.load(argument)
    if found is None:
        raise _LostError(argument)
    return found


def missing_tasks(cache: Cache, goals: tuple[Task[Any], ...]) -> tuple[Task[Any], ...]:
    """The tasks that must run for the goals: those without an entry that a missing one needs."""
    needed: set[str] = set()

    def walk(each: Task[Any]) -> None:
        if each.key not in needed and not cache.has(each.key):
            needed.add(each.key)
            for upstream in each.inputs:
                walk(upstream)

    for goal in goals:
        walk(goal)
    return tuple(each for each in in_order(goals) if each.key in needed)


def why(each: Task[Any], before: Mapping[str, Ingredients]) -> str:
    """Why a task must run, against what it was last made from."""
    last = before.get(each.name)
    if last is None:
        return "never built"
    changes = list(_changes(last, each.ingredients, ("settings", "version", "libraries")))
    if last["files"] != each.ingredients["files"]:
        changes.append("the scan's file changed")
    changed = [
        name for name, key in each.ingredients["inputs"].items() if last["inputs"].get(name) != key
    ]
    if not changes and changed:
        changes.append(f"after {', '.join(changed)}")
    return ", ".join(changes) or "its result is no longer in the cache"


def _changes(last: Ingredients, now: Ingredients, sections: tuple[str, ...]) -> Iterator[str]:
    for section in sections:
        old, new = _flat(last[section], section), _flat(now[section], section)
        for name in sorted(old | new):
            if old.get(name) != new.get(name):
                yield f"{name} {_shown(old.get(name))} -> {_shown(new.get(name))}"


def _flat(value: Any, name: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        return {name: value}
    return {k: v for key, inner in value.items() for k, v in _flat(inner, f"{name}.{key}").items()}


def _shown(value: Any) -> str:
    return "none" if value is None else str(value)
