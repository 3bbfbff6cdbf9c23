"""Who is judged in a room: our methods and the other programs, each with its mesh at hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import get_args

import chains
import numpy as np
from ledger import digest
from programs import ATTEMPTS, MESHLAB_BALLS, MESHLAB_POISSON, OPEN3D_POISSON, Attempt, made
from rooms import BenchRoom
from score import load

from tourgen.geometry import Float64, Int32
from tourgen.tour import Surface

CHAINS: dict[str, Callable[[Float64, Int32, BenchRoom, int], chains.Painted]] = {
    OPEN3D_POISSON: chains.vertex_chain,
    MESHLAB_POISSON: chains.texture_chain,
    MESHLAB_BALLS: chains.texture_chain,
}


@dataclass(frozen=True)
class Contestant:
    """A mesh of one room.

    Attributes:
        name: Column of the tables.
        setting: Of a peer; "" for ours.
        files: What its mesh is read from.
        site: Of what is published: where.
        room: Its id.
    """

    name: str
    setting: str
    files: tuple[Path, ...]
    site: Path | None
    room: str

    @cached_property
    def mesh(self) -> tuple[Float64, Int32]:
        """Vertices and faces."""
        first = self.files[0]
        if first.suffix == ".npz":
            with np.load(first) as stored:
                return stored["vertices"].astype(np.float64), stored["faces"]
        return load(first)

    @cached_property
    def told(self) -> str:
        """What the method says of its surface; "" where it says nothing."""
        first = self.files[0]
        if first.suffix != ".npz":
            return ""
        with np.load(first) as stored:
            return str(stored["told"]) if "told" in stored else ""

    @cached_property
    def digest(self) -> str:
        """Of its mesh, and of its colours where it is published."""
        return digest(self.files)

    @cached_property
    def shown_digest(self) -> str:
        """Of all that its pictures depend on: where it is published, the viewer too."""
        if self.site is None:
            return self.digest
        viewer = (file for file in sorted((self.site / "viewer").rglob("*")) if file.is_file())
        return digest((*self.files, self.site / "rooms" / self.room / "index.html", *viewer))


def published(name: str, site: Path, room: str) -> Contestant:
    """A published room."""
    folder = site / "rooms" / room
    files = (folder / "tileset.json", *sorted(folder.glob("tiles/*.glb")))
    return Contestant(name, "", files, site, room)


def peers(
    room: BenchRoom, scratch: Path, attempts: Sequence[Attempt] = ATTEMPTS
) -> tuple[list[Contestant], dict[tuple[str, str], str]]:
    """Every attempt of every other program, made one after the other; why some have no mesh."""
    found, failed = [], {}
    for attempt in attempts:
        print(f"{room.id}: {attempt.program}, {attempt.setting} ...", flush=True)
        file = made(attempt, room, scratch)
        if isinstance(file, str):
            failed[attempt.program, attempt.setting] = file
        else:
            found.append(Contestant(attempt.program, attempt.setting, (file,), None, room.id))
    return found, failed


def methods() -> tuple[str, ...]:
    """All that ``room.surface.method`` may name."""
    return tuple(map(str, get_args(Surface.model_fields["method"].annotation)))


def tiles_bytes(site: Path, room: str) -> int:
    """What a visitor fetches of a room when all of it comes."""
    folder = site / "rooms" / room
    files = (folder / "tileset.json", *folder.glob("tiles/*.glb"))
    return sum(file.stat().st_size for file in files)
