"""How a build of many rooms uses two cores: ``python tests/peers/many_rooms.py [--rooms N ...]``.

Tours of the demo's first chamber, each room scanned to some points more than the one before, so
that none comes out of another's cache. Each is built without a cache on one core and on two, and by
one and by two workers of a dask cluster; then once more with nothing changed, and with another
title.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tomllib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from dask_cluster import cluster
from sections import rewrite
from usage import Usage, measured

from tourgen.simulate import MODELS, Size, simulate_room

ROOM = "chamber1"
ROOMS = (1, 2, 4, 8)
POINTS, MORE = 130_000, 100
MOST_S, MOST_MB = 3600.0, 20_000.0
HEADING = "Many rooms"
PREAMBLE = f"""Made by `make bench-rooms`: tours of so many rooms of {POINTS:,} points each (and a
few more, so that no two are alike), built without a cache on one core, and on two, in seconds, and
by one and by two workers of one thread and one core each, of a dask cluster. `times`: the former
over the latter. `same`: whether all four published the same bytes. Then the same command again:
with nothing changed, and after the tour's title was. `MB`: at the peak on two cores, the sum over
processes of proportional memory.
"""
COLUMNS = (
    *("rooms", "one core", "two cores", "times", "MB"),
    *("one worker", "two workers", "times", "same", "unchanged", "title"),
)


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rooms", type=int, action="append", help="of a tour; repeatable")
    parser.add_argument("--scratch", type=Path, default=Path("build/rooms"))
    parser.add_argument("--demo", type=Path, default=Path("sites/lighthouse"))
    parser.add_argument("--write", type=Path, help="write the section of this Markdown file")
    given = parser.parse_args()
    lines = [f"| {' | '.join(COLUMNS)} |", "|" + "---|" * len(COLUMNS)]
    for rooms in given.rooms or ROOMS:
        lines.append(f"| {' | '.join(_compared(rooms, given))} |")
        print(lines[-1], flush=True)
    if given.write:
        rewrite(given.write, HEADING, "\n".join([PREAMBLE, *lines]))
    return 0


def _compared(rooms: int, given: argparse.Namespace) -> tuple[str, ...]:
    """The cells of one row."""
    tour = _tour(rooms, given)
    cores = sorted(os.sched_getaffinity(0))[:2]
    one, by_one = _built(tour, cores[:1])
    two, by_two = _built(tour, cores)
    worker, by_worker = _clustered(tour, cores[:1])
    workers, by_workers = _clustered(tour, cores)
    unchanged = _run(tour, cores)
    title = tour / "tour.toml"
    title.write_text(title.read_text("utf-8").replace("Rooms", "Chambers"), encoding="utf-8")
    named = _run(tour, cores)
    return (
        str(rooms),
        f"{one.wall_s:.0f}",
        f"{two.wall_s:.0f}",
        f"{one.wall_s / two.wall_s:.2f}",
        f"{two.peak_mb:,.0f}",
        f"{worker.wall_s:.0f}",
        f"{workers.wall_s:.0f}",
        f"{worker.wall_s / workers.wall_s:.2f}",
        "yes" if by_one == by_two == by_worker == by_workers else "no",
        f"{unchanged.wall_s:.2f}",
        f"{named.wall_s:.2f}",
    )


def _tour(rooms: int, given: argparse.Namespace) -> Path:
    """A tour of so many rooms, scanned."""
    tour: Path = given.scratch.resolve() / f"{rooms}"
    tour.mkdir(parents=True, exist_ok=True)
    told = tomllib.loads((given.demo / "tour.toml").read_text("utf-8"))
    (room,) = (each for each in told["room"] if each["id"] == ROOM)
    closed = ", ".join(f"{{ min = {box['min']}, max = {box['max']} }}" for box in room["closed"])
    text = ['[tour]\ntitle = "Rooms"\n']
    for number in range(rooms):
        scanned = given.scratch.resolve() / f"scan-{number}"
        if not (scanned / "scans").exists():
            scanned.mkdir(parents=True, exist_ok=True)
            size = Size(points=POINTS + MORE * number, texture=1024, e57=False)
            simulate_room(MODELS[ROOM](), scanned, size)
        text.append(
            f'[[room]]\nid = "room{number}"\nscans = ["../scan-{number}/scans/{ROOM}.ply"]\n'
            f"closed = [{closed}]\n"
        )
    (tour / "tour.toml").write_text("\n".join(text), encoding="utf-8")
    return tour


def _clustered(tour: Path, cores: list[int]) -> tuple[Usage, dict[str, bytes]]:
    """The same by a worker on each of some cores."""
    with cluster(tour.parent, cores) as (address, _):
        return _built(tour, cores, "--cluster", address)


def _built(tour: Path, cores: list[int], *options: str) -> tuple[Usage, dict[str, bytes]]:
    """A build from nothing, and what it published but for its report, which tells seconds."""
    shutil.rmtree(tour / ".tourgen", ignore_errors=True)
    shutil.rmtree(tour / "site", ignore_errors=True)
    usage = _run(tour, cores, *options)
    files = sorted((tour / "site").rglob("*"))
    return usage, {
        str(file.relative_to(tour)): file.read_bytes()
        for file in files
        if file.is_file() and file.stem != "report"
    }


def _run(tour: Path, cores: list[int], *options: str) -> Usage:
    """``tourgen build`` on some cores, as many tasks at once."""
    command = ["taskset", "--cpu-list", ",".join(map(str, cores)), sys.executable, "-m"]
    command += ["tourgen.cli", "build", str(tour)]
    command += options or ["--jobs", str(len(cores))]
    usage = measured(command, most_s=MOST_S, most_mb=MOST_MB, log=tour.with_suffix(".log"))
    if usage.failed:
        raise SystemExit(f"{tour}: {usage.failed}")
    return usage


if __name__ == "__main__":
    sys.exit(main())
