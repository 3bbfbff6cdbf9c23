"""A task is a stage bound to its inputs and settings, keyed before anything runs."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, is_dataclass
from typing import Any, Generic, TypeVar, cast

from tourgen.cache import Cache, Cost, Ingredients, key_of, library_version
from tourgen.memory import PeakMemory

Result = TypeVar("Result", covariant=True)


@dataclass(frozen=True, eq=False)
class Task(Generic[Result]):
    """A stage to be run, or not, when somebody asks for its result.

    Attributes:
        name: The stage's name, one a room.
        run: Called with the inputs' results and, where there are any, the settings.
        inputs: The tasks whose results it takes.
        settings: A frozen dataclass, or None.
        ingredients: What its key is made of.
        key: Where its result is kept.
    """

    name: str
    run: Callable[..., Result]
    inputs: tuple[Task[Any], ...]
    settings: Any
    ingredients: Ingredients
    key: str


def task(
    name: str,
    run: Callable[..., Result],
    *inputs: Task[Any],
    version: int,
    libraries: tuple[str, ...] = (),
    settings: Any = None,
    digests: tuple[str, ...] = (),
) -> Task[Result]:
    """Bind a stage.

    Args:
        name: The stage's name.
        run: The stage.
        inputs: What it is fed.
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
        "inputs": {each.name: each.key for each in inputs},
    }
    ingredients = json.loads(json.dumps(ingredients))  # as it will be read back: tuples are lists
    return Task(name, run, inputs, settings, ingredients, key_of(ingredients))


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


@dataclass
class Runner:
    """Runs the tasks of one room, each at most once, and only those that must.

    A result is held while a later task still needs it and then let go.

    Attributes:
        cache: Where results are kept.
        goals: The tasks whose results are wanted.
        announce: Told the task that is about to run.
        ran: Names of the tasks that ran.
    """

    cache: Cache
    goals: tuple[Task[Any], ...]
    announce: Callable[[Task[Any]], None]
    ran: list[str] = field(default_factory=list)
    _held: dict[str, Any] = field(default_factory=dict)

    def run(self) -> None:
        """Make what is missing."""
        missing = missing_tasks(self.cache, self.goals)
        for position, each in enumerate(missing):
            self._make(each)
            needed = {i.key for later in missing[position + 1 :] for i in later.inputs}
            self._held = {key: value for key, value in self._held.items() if key in needed}

    def result(self, each: Task[Result]) -> Result:
        """The result of a task, from hand or cache; made anew where the entry is broken."""
        if each.key not in self._held:
            found = self.cache.load(each.key)
            if found is None:
                self._make(each)
            else:
                self._held[each.key] = found
        return cast("Result", self._held[each.key])

    def _make(self, each: Task[Any]) -> None:
        inputs = [self.result(needed) for needed in each.inputs]
        self.announce(each)
        started = time.perf_counter()
        with PeakMemory() as memory:
            result = each.run(*inputs, *(() if each.settings is None else (each.settings,)))
        cost = Cost(round(time.perf_counter() - started, 3), memory.peak_mb)
        self.cache.store(each.key, result, cost)
        self._held[each.key] = result
        self.ran.append(each.name)


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
