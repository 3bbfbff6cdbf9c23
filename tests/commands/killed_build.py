"""`tourgen build` that is killed in the middle of an update: ``killed_build.py DIR write|swap``.

While it writes the new site, or between its two renames, where there is no site of that name.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

from tourgen.cli import main

write_bytes, rename = Path.write_bytes, Path.rename


def write_half(self: Path, content: bytes) -> int:
    """Write any file but the site's worker, which names all the others; half of that."""
    if self.name != "sw.js":
        return write_bytes(self, content)
    write_bytes(self, content[: len(content) // 2])
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


def put_aside(self: Path, target: Path) -> Path:
    """Put the site of before aside, and nothing in its place."""
    moved = rename(self, target)
    if target.name.endswith(".old"):
        os.kill(os.getpid(), signal.SIGKILL)
    return moved


if __name__ == "__main__":
    if sys.argv[2] == "write":
        Path.write_bytes = write_half  # type: ignore[assignment]
    else:
        Path.rename = put_aside  # type: ignore[assignment]
    main(["build", sys.argv[1], "--jobs", "1"])
