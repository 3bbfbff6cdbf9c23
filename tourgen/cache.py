"""The cache: what a stage made, kept under a key of everything that it was made from.

A key is the digest of its *ingredients*: the stage's name and version, the versions of the
libraries it calls, its settings, and the keys of what it was fed. Thread counts, paths and log
levels never enter. Entries are written aside and renamed, and carry a digest of their own: an
entry cut short or flipped counts as absent. Arrays lie in a file of their own, which is mapped into
memory: of a large result only what is looked at is read, and processes share it.
"""

from __future__ import annotations

import hashlib
import json
import mmap
import os
import pickle
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from tourgen.errors import StageError

Ingredients = Mapping[str, Any]

_FOLDER = ".tourgen"
_LIMIT_BYTES = 40 * 2**30
_RESULT, _ARRAYS = "result.pickle", "arrays.bin"
_ALIGNED = 64
"""Arrays begin at multiples of so many bytes."""


@dataclass(frozen=True, slots=True)
class Cost:
    """What making a result took.

    Attributes:
        seconds: Wall time.
        peak_rss_mb: Highest resident memory of the process meanwhile.
    """

    seconds: float
    peak_rss_mb: float


def key_of(ingredients: Ingredients) -> str:
    """The key of a result made from these ingredients."""
    text = json.dumps(ingredients, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


@lru_cache
def library_version(name: str) -> str:
    """Version of an installed library; Open3D goes by two names."""
    for distribution in (name, f"{name}-cpu"):
        try:
            return version(distribution)
        except PackageNotFoundError:
            continue
    return "absent"


def stamp_of(file: Path) -> str:
    """Of a file's state: its size and time of change."""
    about = file.stat()
    return f"{about.st_size}-{about.st_mtime_ns}"


class Cache:
    """The results of one tour, in ``DIR/.tourgen``."""

    def __init__(self, tour_folder: Path) -> None:
        self.tour_folder = tour_folder
        self._root = tour_folder / _FOLDER
        self._results = self._root / "results"

    def has(self, key: str) -> bool:
        """Whether there is an entry."""
        return (self._results / key).is_dir()

    def cost(self, key: str) -> Cost | None:
        """What the entry cost to make; None where there is none."""
        try:
            about = json.loads((self._results / key / "about.json").read_text())
        except (OSError, ValueError):
            return None
        return Cost(**about["cost"])

    def load(self, key: str) -> Any:
        """The result; None where there is none that is whole: what is left of it is dropped.

        Raises:
            StageError: It can neither be read nor dropped.
        """
        folder = self._results / key
        try:
            about = json.loads((folder / "about.json").read_text())
            if _digest(folder) == about["sha256"]:
                data = (folder / _RESULT).read_bytes()
                arrays = _mapped(folder / _ARRAYS, about["arrays"])
                os.utime(folder)
                return pickle.loads(data, buffers=arrays)
        except (OSError, ValueError, KeyError):
            pass
        shutil.rmtree(folder, ignore_errors=True)
        if folder.exists():
            raise StageError(
                f"`{folder}`: expected a result that can be read or dropped, found neither",
                f"delete `{self._root}`, as the user who made it, and build again",
            )
        return None

    def store(self, key: str, result: Any, cost: Cost) -> None:
        """Keep a result; a second store of one key changes nothing."""
        self._results.mkdir(parents=True, exist_ok=True)
        aside = Path(tempfile.mkdtemp(prefix="aside-", dir=self._results))
        try:
            self._fill(aside, result, cost)
            aside.rename(self._results / key)
        except OSError:
            shutil.rmtree(aside, ignore_errors=True)
            if not self.has(key):  # else another process stored it first
                raise

    def _fill(self, aside: Path, result: Any, cost: Cost) -> None:
        arrays: list[pickle.PickleBuffer] = []
        data = pickle.dumps(result, protocol=5, buffer_callback=arrays.append)
        (aside / _RESULT).write_bytes(data)
        about = {
            "arrays": _written(arrays, aside / _ARRAYS),
            "sha256": _digest(aside),
            "cost": {"seconds": cost.seconds, "peak_rss_mb": cost.peak_rss_mb},
        }
        (aside / "about.json").write_text(json.dumps(about))

    def prune(self, keep: frozenset[str], limit_bytes: int = _LIMIT_BYTES) -> None:
        """Drop leftovers of killed builds, then the longest unused entries over the limit."""
        if not self._results.is_dir():
            return
        entries = []
        for folder in self._results.iterdir():
            if folder.name.startswith("aside-"):
                shutil.rmtree(folder, ignore_errors=True)
                continue
            size = sum(file.stat().st_size for file in folder.iterdir())
            entries.append((folder.name in keep, folder.stat().st_mtime, size, folder))
        total = sum(entry[2] for entry in entries)
        for kept, _, size, folder in sorted(entries, key=lambda entry: entry[:2]):
            if kept or total <= limit_bytes:
                break
            shutil.rmtree(folder, ignore_errors=True)
            total -= size

    def clear(self) -> int:
        """Drop everything; returns the bytes freed."""
        size = sum(file.stat().st_size for file in self._root.rglob("*") if file.is_file())
        shutil.rmtree(self._root, ignore_errors=True)
        return size

    def last_ingredients(self, room_id: str) -> dict[str, Ingredients]:
        """What each stage of a room was last made from, by stage."""
        return self._read_json(f"last/{room_id}.json")

    def remember_ingredients(self, room_id: str, stages: Mapping[str, Ingredients]) -> None:
        """Keep what a room's stages were made from, so that a plan can tell what changed."""
        self._write_json(f"last/{room_id}.json", stages)

    def file_digests(self, files: list[Path]) -> dict[Path, str]:
        """The digest of each file's contents, remembered by its size and time of change."""
        known = self._read_json("digests.json")
        digests = {}
        for file in files:
            stamp = stamp_of(file)
            entry = known.get(str(file))
            if entry is None or entry["stamp"] != stamp:
                with file.open("rb") as stream:
                    digest = hashlib.file_digest(stream, "sha256").hexdigest()
                known[str(file)] = entry = {"stamp": stamp, "sha256": digest}
            digests[file] = entry["sha256"]
        self._write_json("digests.json", known)
        return digests

    def _read_json(self, name: str) -> dict[str, Any]:
        try:
            content = json.loads((self._root / name).read_text())
        except (OSError, ValueError):
            return {}
        return content if isinstance(content, dict) else {}

    def _write_json(self, name: str, content: Mapping[str, Any]) -> None:
        target = self._root / name
        target.parent.mkdir(parents=True, exist_ok=True)
        aside = target.with_suffix(f".{os.getpid()}.aside")
        aside.write_text(json.dumps(content))
        aside.replace(target)


def _written(arrays: list[pickle.PickleBuffer], file: Path) -> list[int]:
    """Write arrays one after the other; how many bytes each has."""
    sizes = []
    with file.open("wb") as stream:
        for array in arrays:
            size = stream.write(array.raw())
            stream.write(bytes(-size % _ALIGNED))
            sizes.append(size)
    return sizes


def _mapped(file: Path, sizes: list[int]) -> list[memoryview]:
    """The arrays of a file; what is written to them stays in this process."""
    if not sum(sizes):
        return [memoryview(bytearray()) for _ in sizes]
    with file.open("rb") as stream:
        mapped = memoryview(mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_COPY))
    found, start = [], 0
    for size in sizes:
        found.append(mapped[start : start + size])
        start += size + -size % _ALIGNED
    return found


def _digest(folder: Path) -> str:
    """Of an entry's files."""
    digest = hashlib.sha256()
    for name in (_RESULT, _ARRAYS):
        with (folder / name).open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()
