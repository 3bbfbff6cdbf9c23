"""The modelled lighthouse and the simulated scanner of the demo.

``python -m tourgen.simulate FOLDER [--full] [--room ID ...] [--no-e57]`` writes what a surveyor
hands over to ``FOLDER/scans`` and the ground truth to ``FOLDER/truth``. Seeded: the same bytes
each time. What is there already, from this version and in this size, is left alone.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tourgen.simulation.atlas import build_truth
from tourgen.simulation.model import RoomModel
from tourgen.simulation.output import write_e57, write_ply, write_truth
from tourgen.simulation.rooms import chamber1, chamber2
from tourgen.simulation.scanner import (
    SPARE,
    Grid,
    Returns,
    Scenery,
    Station,
    panorama,
    rotated,
    scan,
    share_of_returns,
    stations_of,
)
from tourgen.simulation.sea import sea
from tourgen.simulation.stairs import stairs

VERSION = 1
MODELS: Mapping[str, Callable[[], RoomModel]] = {
    "chamber1": chamber1,
    "stairs": stairs,
    "chamber2": chamber2,
}
POINTS = {"chamber1": 1_302_317, "stairs": 900_000, "chamber2": 1_522_404}
FULL_POINTS = {**POINTS, "chamber2": 15_224_042}


@dataclass(frozen=True, slots=True)
class Size:
    """How finely a room is simulated.

    Attributes:
        points: Their exact number.
        texture: Edge of the truth's texture, texels.
        panorama: Height of a station's picture, pixels.
        e57: Whether the E57 is written too.
    """

    points: int
    texture: int = 4096
    panorama: int = 1024
    e57: bool = True


def simulate_room(model: RoomModel, folder: Path, size: Size) -> None:
    """Scan one room and write its files.

    Args:
        model: The room.
        folder: Gets ``scans/`` and ``truth/``; files there are replaced one by one, whole.
        size: How much.
    """
    seed = [VERSION, *model.id.encode()]
    truth = build_truth(model, size.texture, int(np.random.default_rng(seed).integers(2**31)))
    scenery = Scenery(model, truth)
    stations = stations_of(model, np.random.default_rng([*seed, 1]))
    scans = _thinned(_scans(scenery, model, stations, size.points, seed), size.points, seed)
    pictures = (
        [
            panorama(scenery, s, size.panorama, passer_by=k == model.passer_by_station)
            for k, s in enumerate(stations)
        ]
        if size.e57
        else []
    )
    with TemporaryDirectory(dir=folder, prefix=".simulate-") as aside:
        made = Path(aside)
        (made / "scans").mkdir()
        (made / "truth").mkdir()
        order = np.random.default_rng([*seed, 2]).permutation(size.points)
        points = np.concatenate([_world(s, r) for s, r in zip(stations, scans, strict=True)])
        write_ply(
            made / "scans" / f"{model.id}.ply",
            points[order],
            np.concatenate([r.colors for r in scans])[order],
        )
        station = np.repeat(np.arange(len(scans), dtype=np.uint8), [len(r) for r in scans])
        label = np.concatenate([r.label for r in scans])
        write_truth(made / "truth", model, truth, stations, label[order], station[order])
        if size.e57:
            write_e57(made / "scans" / f"{model.id}.e57", model.id, stations, scans, pictures)
        for file in sorted(made.glob("*/*")):
            target = folder / file.relative_to(made)
            target.parent.mkdir(exist_ok=True)
            os.replace(file, target)


def _scans(
    scenery: Scenery, model: RoomModel, stations: Sequence[Station], points: int, seed: list[int]
) -> list[Returns]:
    """A little more than ``points`` returns on the coarsest grid that gives them."""
    per_square_degree = share_of_returns(scenery, list(stations))
    step = float(np.sqrt(per_square_degree / (points * SPARE)))
    while True:
        grid = Grid.of_step(step)
        rng = np.random.default_rng([*seed, 3])
        scans = [
            scan(scenery, s, grid, passer_by=k == model.passer_by_station, rng=rng)
            for k, s in enumerate(stations)
        ]
        if sum(map(len, scans)) >= points:
            return scans
        step *= 0.99


def _thinned(scans: Sequence[Returns], points: int, seed: list[int]) -> list[Returns]:
    """``points`` of all returns, drawn at random, each station's still in grid order."""
    ends = np.cumsum([len(r) for r in scans])
    chosen = np.zeros(ends[-1], dtype=np.bool_)
    chosen[np.random.default_rng([*seed, 4]).permutation(ends[-1])[:points]] = True
    return [r.take(part) for r, part in zip(scans, np.split(chosen, ends[:-1]), strict=True)]


def _world(station: Station, returns: Returns) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """(n, 3) points where the registration puts them."""
    out = np.empty((len(returns), 3), dtype=np.float32)
    for start in range(0, len(returns), 1_000_000):
        part = slice(start, start + 1_000_000)
        local = returns.local[part].astype(np.float64)
        out[part] = rotated(local, station.believed.rotation) + station.believed.position
    return out


def simulate(folder: Path, rooms: Sequence[str], *, full: bool = False, e57: bool = True) -> None:
    """Make the scans that are missing, and say so room by room.

    Args:
        folder: The tour's folder.
        rooms: Ids, of ``MODELS``.
        full: Whether chamber2 gets all its 15,224,042 points instead of a tenth.
        e57: Whether E57 files are written too.
    """
    write_sea(folder)
    counts = FULL_POINTS if full else POINTS
    for room in rooms:
        stamp = folder / "truth" / f"{room}.made"
        words = f"simulator {VERSION}, {counts[room]} points, e57 {'yes' if e57 else 'no'}\n"
        if _is_made(folder, room, stamp, words, e57=e57):
            print(f"{room}: {counts[room]:,} points, made before", flush=True)
            continue
        print(f"{room}: scanning {counts[room]:,} points ...", flush=True)
        begun = time.perf_counter()
        stamp.unlink(missing_ok=True)
        simulate_room(MODELS[room](), folder, Size(counts[room], e57=e57))
        stamp.write_text(words, encoding="utf-8")
        print(f"{room}: done in {time.perf_counter() - begun:.0f} s", flush=True)


def write_sea(folder: Path) -> None:
    """Write the sound of the sea that a note of the demo plays."""
    file = folder / "sounds" / "sea.wav"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(sea())


def _is_made(folder: Path, room: str, stamp: Path, words: str, *, e57: bool) -> bool:
    wanted = [folder / "scans" / f"{room}.ply", folder / "truth" / f"{room}.ply"]
    if e57:
        wanted.append(folder / "scans" / f"{room}.e57")
    return (
        stamp.is_file()
        and stamp.read_text(encoding="utf-8") == words
        and all(f.is_file() for f in wanted)
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m tourgen.simulate", description="Scan the modelled lighthouse."
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--full", action="store_true", help="all 15,224,042 points of chamber2")
    parser.add_argument("--room", action="append", choices=list(MODELS), help="only this one")
    parser.add_argument("--no-e57", action="store_true", help="PLY only")
    given = parser.parse_args(arguments)
    simulate(given.folder, given.room or list(MODELS), full=given.full, e57=not given.no_e57)


if __name__ == "__main__":
    main()
