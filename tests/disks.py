"""A small disk of its own, to be filled and freed while programs write to it."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

MB = 1 << 20


@dataclass
class Disk:
    """One that is mounted for some programs alone.

    Attributes:
        folder: Where it is mounted, for the programs that `within` starts.
        holder: What holds it.
    """

    folder: Path
    holder: subprocess.Popen[bytes]

    @property
    def within(self) -> list[str]:
        """What starts a program that sees it."""
        alone = ["nsenter", f"--target={self.holder.pid}", "--mount"]
        return [*alone, *(["--user", "--preserve-credentials"] if os.geteuid() else []), "--"]

    @property
    def seen(self) -> Path:
        """Where it is seen by everybody else."""
        return Path(f"/proc/{self.holder.pid}/root{self.folder}")

    def fill(self) -> None:
        """Leave no room at all."""
        with suppress(OSError), (self.seen / "filling").open("ab", buffering=0) as file:
            while file.write(bytes(MB)):
                pass
        assert os.statvfs(self.seen).f_bavail == 0

    def free(self) -> None:
        """Give back what `fill` has taken."""
        (self.seen / "filling").unlink()


@contextmanager
def disk_of(size: int, folder: Path) -> Iterator[Disk]:
    """A disk of so many bytes at a folder, which is made."""
    folder.mkdir()
    script = f"mount -t tmpfs -o size={size} tmpfs {folder} && echo mounted && exec sleep 10000"
    alone = ["unshare", "--mount", *(["--map-root-user"] if os.geteuid() else [])]
    with subprocess.Popen([*alone, "sh", "-c", script], stdout=subprocess.PIPE) as holder:
        assert holder.stdout
        try:
            assert holder.stdout.readline() == b"mounted\n"
            yield Disk(folder, holder)
        finally:
            holder.kill()
