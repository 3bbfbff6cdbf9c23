"""Unchanged: a build of a tour of which nothing has changed since the last one is told at once.

To find out which stages must run takes every stage's settings and version, and so their libraries,
seconds before anything is known. So a build notes the size and time of change of every file that it
may have looked at, of those that it published and of the program; while they are the same, there is
nothing to do. What it looks at is noted before it begins: whoever changes a title meanwhile finds
the change with the next build.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from sysconfig import get_path
from typing import Any

_NOTE = Path(".tourgen") / "built.json"
_PACKAGE = Path(__file__).parent
_PROGRAM = (_PACKAGE, _PACKAGE.parent / "templates", _PACKAGE.parent / "static" / "dist")
"""What pages are made by; in an installed package the first holds the others."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What a build looks at, as it was when it began.

    Attributes:
        outside: Files elsewhere on this machine.
        files: Size and time of change of all files by path.
    """

    outside: tuple[str, ...]
    files: Mapping[str, list[int]]


def seen_by_build(folder: Path, out: Path, outside: Iterable[Path]) -> Seen:
    """Note what a build is about to look at.

    Args:
        folder: The tour's.
        out: The site's, which it does not look at.
        outside: Files that it reads from elsewhere on this machine.
    """
    outer = tuple(str(file.resolve()) for file in outside)
    return Seen(outer, _looked_at(folder, out, outer))


def remember_build(folder: Path, out: Path, seen: Seen) -> None:
    """Note what a build saw, and what it published.

    Args:
        folder: The tour's.
        out: The site's.
        seen: What it looked at, as it was when it began.
    """
    files = {**seen.files, **_state([out])}
    note = {"out": str(out.resolve()), "outside": seen.outside, "files": files}
    aside = folder / _NOTE.with_suffix(f".{os.getpid()}.aside")
    aside.write_text(json.dumps(note), encoding="utf-8")
    aside.replace(folder / _NOTE)


def forget_build(folder: Path) -> None:
    """Have the next build look: what it read or sent lies where nothing tells of a change."""
    (folder / _NOTE).unlink(missing_ok=True)


def last_report(folder: Path, out: str, *, single_files: bool = False) -> dict[str, Any] | None:
    """The report of the last build, of which every stage is in the cache; None: build again.

    Args:
        folder: The tour's.
        out: The site's.
        single_files: Whether the site shall hold the tour and each room as one file, too.
    """
    try:
        note = json.loads((folder / _NOTE).read_text(encoding="utf-8"))
        if note["out"] != str(Path(out).resolve()):
            return None
        files = {**_looked_at(folder, Path(out), note["outside"]), **_state([Path(out)])}
        if note["files"] != files:
            return None
        report: dict[str, Any] = json.loads((Path(out) / "report.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, KeyError):
        return None
    if ("single_files" in report) != single_files:
        return None
    report["cached_stages"] += report["ran_stages"]
    report |= {"ran_stages": 0, "seconds": 0.0}
    for room in report["rooms"].values():
        room["ran"] = []
    return report


def _looked_at(folder: Path, out: Path, outside: Iterable[str]) -> dict[str, list[int]]:
    """Size and time of change of all files but the site's by path, the libraries among them."""
    site = f"{out.resolve()}{os.sep}"
    all_files = _state([folder, *_PROGRAM, *map(Path, outside)])
    found = {path: about for path, about in all_files.items() if not path.startswith(site)}
    # Installing another version of a library touches the folder that holds it.
    libraries = Path(get_path("purelib"))
    found[str(libraries)] = [0, libraries.stat().st_mtime_ns]
    return found


def _state(roots: Iterable[Path]) -> dict[str, list[int]]:
    """Size and time of change of all files by path."""
    found: dict[str, list[int]] = {}
    for root in roots:
        for file in _files(root.resolve()):
            about = file.lstat()  # a link may lead to nothing
            found[str(file)] = [about.st_size, about.st_mtime_ns]
            if file.is_symlink() and file.exists():
                about = file.stat()
                found[f"{file} ->"] = [about.st_size, about.st_mtime_ns]
    return found


def _files(root: Path) -> Iterable[Path]:
    """A file, or all below a folder but what tourgen or Python keeps there for itself."""
    if root.is_file():
        yield root
    for folder, below, names in os.walk(root):
        below[:] = [name for name in below if not name.startswith(".") and name != "__pycache__"]
        yield from (Path(folder, name) for name in names)
