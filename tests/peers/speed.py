"""How long a room takes, and how much memory: ``python tests/peers/speed.py [--points N ...]``.

Whole processes, one after the other in one run: ``tourgen build`` without a cache, and the chains
that are made by hand (``by_hand``), of the demo's first chamber scanned to each number of points.
The chains solve at the two depths whose cells are next to the detail that tourgen chose, wider and
narrower, and end with as many faces; beside the time stands how true each is, so that nobody wins
by doing less. What was measured is kept beside the docs, so that sizes may be run one by one.
"""

from __future__ import annotations

import argparse
import itertools
import json
import shutil
import subprocess
import sys
import tomllib
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from score import Truth, load
from sections import rewrite
from speed_plot import plot
from surface_score import Reference, Samples, surface_figures
from usage import Usage, measured

from tourgen.fitting.lengths import detail_m
from tourgen.geometry import PointCloud
from tourgen.simulate import MODELS, Size, simulate_room
from tourgen.stages.spacing import spacing
from tourgen.stages.surface.poisson import SCALE

ROOM = "chamber1"
POINTS = (130_000, 1_300_000, 15_200_000, 150_000_000)
MOST_S, MOST_MB = 3600.0, 20_000.0
OURS = "tourgen"
BUILDS = {OURS: "", f"{OURS}, poisson": "poisson"}
"""Ours by the surface's method; "" for the default."""
CHAINS = ("meshlab", "open3d")
BEFORE, BEFORE_POINTS = "8f85426", 1_300_000
"""The commit before time was looked at; it builds a scan of so many points in the same run."""
HEADING = "Time and memory"
STAGES = """Where tourgen's time goes: seconds from each stage's start to its end; some run beside
others. With `surface.method = "poisson"` the solve is all of `surface`. A commit stands for
tourgen as it was there, before time was looked at.
"""
PLOT = "pictures/speed.svg"
SHOWN = """The same against points, both axes logarithmic, each chain at its deeper depth:
"""
_LEAST_S = 1.0
AROUND_M = 0.1
PREAMBLE = """Made by `make bench-speed`: whole processes in one run, without a cache. `meshlab`
and `open3d` are what one does by hand (`tests/peers/by_hand.py`): crop, normals, screened Poisson
at the depths whose cells are next to the detail that tourgen chose, cut, quadric decimation to as
many faces, UVs (trivial; xatlas on the whole mesh), colours to a texture of 4096 pixels, export.
tourgen also cleans, registers, closes gaps, opens windows and packs all levels of detail. `times`:
wall time over tourgen's. Memory is the sum over processes of proportional memory. F-score at 5 mm
and the 95th percentile of the distance to the truth tell that nobody wins by doing less.
"""


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, action="append", help="of the scan; repeatable")
    parser.add_argument(
        "--chain", action="append", choices=CHAINS, help="only this one; repeatable"
    )
    parser.add_argument("--scratch", type=Path, default=Path("build/speed"))
    parser.add_argument("--demo", type=Path, default=Path("sites/lighthouse"))
    parser.add_argument("--write", type=Path, help="write the section of this Markdown file")
    given = parser.parse_args()
    for points in given.points or POINTS:
        rows, seconds = compared(points, given)
        print(markdown(rows), flush=True)
        if given.write:
            kept = given.write.parent / "speed"
            kept.mkdir(exist_ok=True)
            told = json.dumps({"rows": rows, "stages": seconds}, indent=1)
            (kept / f"{points}.json").write_text(f"{told}\n", encoding="utf-8")
            _write(kept, given.write)
    return 0


def _write(kept: Path, docs: Path) -> None:
    """Write the docs' section, each size as it was last measured."""
    files = sorted(kept.glob("*.json"), key=lambda file: int(file.stem))
    found = {int(file.stem): json.loads(file.read_text("utf-8")) for file in files}
    rows = [row for each in found.values() for row in each["rows"]]
    stages = {
        f"{points:,}{program.removeprefix(OURS)}": seconds
        for points, each in found.items()
        for program, seconds in each["stages"].items()
    }
    plot(rows, docs.parent / PLOT)
    shown = f"{SHOWN}\n![time and memory against points]({PLOT})"
    text = [PREAMBLE, f"{markdown(rows)}\n", f"{shown}\n", STAGES, stage_table(stages)]
    rewrite(docs, HEADING, "\n".join(text))


def compared(
    points: int, given: argparse.Namespace
) -> tuple[list[dict[str, Any]], dict[str, dict[str, float]]]:
    """A row for each build by tourgen and for each chain; the seconds of our builds' stages."""
    tour = given.scratch.resolve() / f"{points}"
    _scanned(points, tour, given.demo)
    truth = Truth(tour / "truth", ROOM)
    reference = Reference.of(truth)

    def row(name: str, usage: Usage, mesh: Path) -> dict[str, Any]:
        print(f"{points}: {name}: {usage.wall_s:.0f} s, {usage.peak_mb:.0f} MB", flush=True)
        told: dict[str, Any] = {"points": points, "program": name, **asdict(usage)}
        if not usage.failed:
            found = load(mesh)
            told |= surface_figures(*found, Samples.of(*found, truth), reference)
        return told

    def run(name: str, *command: str) -> Usage:
        log = tour / f"{name}.log"
        return measured([sys.executable, *command], most_s=MOST_S, most_mb=MOST_MB, log=log)

    rows, stages, faces = [], {}, 0
    for name, method in BUILDS.items():
        folder = _afresh(tour, method)
        usage = run(name, "-m", "tourgen.cli", "build", str(folder))
        rows.append(row(name, usage, folder / "site/rooms" / ROOM))
        if not usage.failed:
            told = json.loads((folder / "site/report.json").read_text("utf-8"))["rooms"][ROOM]
            stages[name] = told["seconds"]
            faces = faces or told["faces"][-1]
    if points == BEFORE_POINTS:
        folder = _afresh(tour, BEFORE)
        there = _checkout(given.scratch.resolve() / BEFORE)
        command = ["env", f"--chdir={there}", f"PYTHONPATH={there}"]  # else it is today's
        command += [sys.executable, "-m", "tourgen.cli", "build", str(folder)]
        log = tour / f"{BEFORE}.log"
        usage = measured(command, most_s=MOST_S, most_mb=MOST_MB, log=log)
        rows.append(row(f"{OURS}, {BEFORE}", usage, folder / "site/rooms" / ROOM))
        told = json.loads((folder / "site/report.json").read_text("utf-8"))["rooms"][ROOM]
        stages[f"{OURS}, {BEFORE}"] = told["seconds"]
    eye = truth.stations[0]
    low, high = truth.vertices.min(axis=0) - AROUND_M, truth.vertices.max(axis=0) + AROUND_M
    asked = itertools.product(given.chain or CHAINS, _depths(tour, low, high))
    for chain, (depth, cell_m) in asked:
        name = f"{chain}, depth {depth} ({1000 * cell_m:.1f} mm)"
        out = tour / f"{chain}-{depth}"
        shutil.rmtree(out, ignore_errors=True)
        told = [*map(str, (*low, *high))]
        command = [str(Path(__file__).with_name("by_hand.py")), chain]
        command += [str(tour / "scans" / f"{ROOM}.ply"), str(out), "--box", *told]
        command += ["--eye", *map(str, eye), "--depth", str(depth)]
        command += ["--faces", str(faces)]
        rows.append(row(name, run(out.name, *command), out / "mesh.ply"))
    return rows, stages


def _checkout(folder: Path) -> Path:
    """The program as it was at ``BEFORE``, in a folder, its viewer compiled."""
    if not (folder / "static/dist").exists():
        folder.mkdir(parents=True, exist_ok=True)
        archive = subprocess.run(["git", "archive", BEFORE], check=True, stdout=subprocess.PIPE)
        subprocess.run(["tar", "--extract"], check=True, cwd=folder, input=archive.stdout)
        subprocess.run([sys.executable, "hatch_build.py"], check=True, cwd=folder)
    return folder


def _afresh(tour: Path, variant: str) -> Path:
    """A tour's folder without what was built, the surface by the variant's method where it is one;
    the tour itself where none is named."""
    folder = tour / variant
    folder.mkdir(exist_ok=True)
    shutil.rmtree(folder / ".tourgen", ignore_errors=True)
    shutil.rmtree(folder / "site", ignore_errors=True)
    if variant:
        told = (tour / "tour.toml").read_text("utf-8")
        surface = f'[room.surface]\nmethod = "{variant}"\n' if variant in BUILDS.values() else ""
        (folder / "tour.toml").write_text(f"{told}\n{surface}", encoding="utf-8")
        if not (folder / "scans").exists():
            (folder / "scans").symlink_to(tour / "scans")
    return folder


def _scanned(points: int, tour: Path, demo: Path) -> None:
    """A tour of the room alone, scanned to a number of points."""
    if (tour / "tour.toml").exists():
        return
    told = tomllib.loads((demo / "tour.toml").read_text("utf-8"))
    (room,) = (each for each in told["room"] if each["id"] == ROOM)
    closed = ", ".join(f"{{ min = {box['min']}, max = {box['max']} }}" for box in room["closed"])
    tour.mkdir(parents=True, exist_ok=True)
    simulate_room(MODELS[ROOM](), tour, Size(points=points, e57=False))
    (tour / "tour.toml").write_text(
        f'[tour]\ntitle = "Speed"\n\n[[room]]\nid = "{ROOM}"\n'
        f'scans = ["scans/{ROOM}.ply"]\nclosed = [{closed}]\n',
        encoding="utf-8",
    )


def _depths(tour: Path, low: Any, high: Any) -> list[tuple[int, float]]:
    """Depths of the octree with the width of its cells, metres, about tourgen's detail."""
    import open3d as o3d

    points = np.asarray(o3d.io.read_point_cloud(str(tour / f"scans/{ROOM}.ply")).points, np.float32)
    points = points[((points > low) & (points < high)).all(axis=1)]
    nothing = np.zeros((len(points), 3), np.uint8)
    cloud = PointCloud(np.zeros(3), points, nothing, np.full(len(points), -1, np.int16))
    side_m = SCALE * float(np.ptp(points, axis=0).max())
    deepest = int(np.ceil(np.log2(side_m / detail_m(spacing(cloud), None))))
    return [(depth, side_m / 2**depth) for depth in (deepest - 1, deepest)]


def markdown(rows: list[dict[str, Any]]) -> str:
    """One line a run."""
    lines = [
        "| points | program | s | times | processor s | peak MB | faces | F 5 mm | p95 mm |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    ours = {each["points"]: each["wall_s"] for each in rows if each["program"] == OURS}
    for each in rows:
        start = f"| {each['points']:,} | {each['program']} "
        if each["failed"]:
            why = each["failed"].splitlines()[0]
            lines.append(f"{start}| {why} | | | {each['peak_mb']:,.0f} | | | |")
            continue
        lines.append(
            f"{start}| {each['wall_s']:.0f} | {each['wall_s'] / ours[each['points']]:.2f} "
            f"| {each['processor_s']:.0f} | {each['peak_mb']:,.0f} | {each['faces']:,} "
            f"| {each['f_score_5mm']:.3f} | {each['accuracy_p95_mm']:.2f} |"
        )
    return "\n".join(lines)


def stage_table(stages: dict[str, dict[str, float]]) -> str:
    """Seconds of each stage that takes one at least, by the number of points and the method."""
    named = dict.fromkeys(name for seconds in stages.values() for name in seconds)
    names = [
        name for name in named if any(each.get(name, 0) >= _LEAST_S for each in stages.values())
    ]
    return "\n".join(
        [
            "| stage | " + " | ".join(stages) + " |",
            "|---|" + "---|" * len(stages),
            *(
                f"| {name} | "
                + " | ".join(f"{each.get(name, 0):.1f}" for each in stages.values())
                + " |"
                for name in names
            ),
        ]
    )


if __name__ == "__main__":
    sys.exit(main())
