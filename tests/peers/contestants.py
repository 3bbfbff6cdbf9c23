"""Who is judged in a room: our methods and the other programs, each with its mesh at hand."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import get_args

import chains
import numpy as np
from programs import ATTEMPTS, MESHLAB_BALLS, MESHLAB_POISSON, OPEN3D_POISSON, Attempt, made
from rooms import BenchRoom
from score import load

from tourgen.geometry import Float64, Int32
from tourgen.tour import Surface

PUBLISHED = "published"
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
        files: What it was read from.
        site: Of ours: where it is published.
    """

    name: str
    setting: str
    files: tuple[Path, ...]
    site: Path | None

    @cached_property
    def mesh(self) -> tuple[Float64, Int32]:
        """Vertices and faces."""
        first = self.files[0]
        if first.suffix == ".npz":
            with np.load(first) as stored:
                return stored["vertices"].astype(np.float64), stored["faces"]
        return load(first)


def ours(name: str, site: Path, room: str) -> Contestant:
    """A published room."""
    folder = site / "rooms" / room
    files = (folder / "tileset.json", *sorted(folder.glob("tiles/*.glb")))
    return Contestant(name, "", files, site)


def peers(
    room: BenchRoom, scratch: Path, attempts: Sequence[Attempt] = ATTEMPTS
) -> Iterator[Contestant]:
    """Every attempt of every other program, made one after the other."""
    for attempt in attempts:
        print(f"{room.id}: {attempt.program}, {attempt.setting} ...", flush=True)
        try:
            file = made(attempt, room, scratch)
        except (RuntimeError, subprocess.SubprocessError) as error:
            print(f"{room.id}: {error}", flush=True)
            continue
        yield Contestant(attempt.program, attempt.setting, (file,), None)


def methods() -> tuple[str, ...]:
    """All that ``room.surface.method`` may name."""
    return tuple(map(str, get_args(Surface.model_fields["method"].annotation)))


def tiles_bytes(site: Path, room: str) -> int:
    """What a visitor fetches of a room when all of it comes."""
    folder = site / "rooms" / room
    files = (folder / "tileset.json", *folder.glob("tiles/*.glb"))
    return sum(file.stat().st_size for file in files)
