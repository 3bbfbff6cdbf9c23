"""Unchanged: a build of a tour of which nothing has changed since the last one is told at once.

To find out which stages must run takes every stage's settings and version, and so their libraries,
seconds before anything is known. So a build notes the size and time of change of every file that it
may have looked at, of those that it published and of the program; while they are the same, there is
nothing to do.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from sysconfig import get_path
from typing import Any

_NOTE = Path(".tourgen") / "built.json"
_PACKAGE = Path(__file__).parent
_PROGRAM = (_PACKAGE, _PACKAGE.parent / "templates", _PACKAGE.parent / "static" / "dist")
"""What pages are made by; in an installed package the first holds the others."""


def remember_build(folder: Path, out: Path, outside: Iterable[Path]) -> None:
    """Note what a build saw.

    Args:
        folder: The tour's.
        out: The site's.
        outside: Files that it read from elsewhere on this machine.
    """
    outer = [str(file.resolve()) for file in outside]
    note = {"out": str(out.resolve()), "outside": outer, "files": _state(folder, out, outer)}
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
        if note["files"] != _state(folder, Path(out), note["outside"]):
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


def _state(folder: Path, out: Path, outside: Iterable[str]) -> dict[str, list[int]]:
    """Size and time of change of all files by path."""
    found: dict[str, list[int]] = {}
    for root in (folder, out, *_PROGRAM, *map(Path, outside)):
        for file in _files(root.resolve()):
            about = file.lstat()  # a link may lead to nothing
            found[str(file)] = [about.st_size, about.st_mtime_ns]
            if file.is_symlink() and file.exists():
                about = file.stat()
                found[f"{file} ->"] = [about.st_size, about.st_mtime_ns]
    # Installing another version of a library touches the folder that holds it.
    libraries = Path(get_path("purelib"))
    found[str(libraries)] = [0, libraries.stat().st_mtime_ns]
    return found


def _files(root: Path) -> Iterable[Path]:
    """A file, or all below a folder but what tourgen or Python keeps there for itself."""
    if root.is_file():
        yield root
    for folder, below, names in os.walk(root):
        below[:] = [name for name in below if not name.startswith(".") and name != "__pycache__"]
        yield from (Path(folder, name) for name in names)
