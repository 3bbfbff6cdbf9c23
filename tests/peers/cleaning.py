"""How true cleaning is: ``python tests/peers/cleaning.py TOUR [--gallery FOLDER] [--room ID]``.

The scans of the modelled rooms are cleaned as a build does it, without any `keep` or `remove`
box, once from the E57 (the station of each point is known) and once from the merged PLY (it is
not, and stations and owners are found), and the points left are held against the labels that
``tourgen.simulate`` wrote. ``gallery`` is a structured E57 by another simulator, with the true
mesh but without labels; they follow from the mesh: what lies over 0.1 m outside it is a stray,
what else lies over 10 mm and five times the range noise off is mixed. Merged, it is the same
points, shuffled; the stations' places and the points' owners are forgotten, to be found.

share gone         Of each label. Mixed pixels count where they lie over 10 mm off the true surface.
lost, of its area  Of the true area that a station sees and that had a point within 10 mm: what
                   has none after cleaning.
bare before/after  Of the true area that a station sees: what has no point within 10 mm.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import open3d as o3d
from scipy.spatial import cKDTree
from score import Truth, load, spread

from tourgen.fitting.points import CROWDED_MM
from tourgen.geometry import Float64, PointCloud
from tourgen.rays import ray_scene
from tourgen.scans import open_scan, read_room
from tourgen.simulate import VERSION
from tourgen.stages import crowding, ownership, register, sift, stations
from tourgen.tour import load_tour

SURFACE, MIXED, STRAY, GHOST, PASSER_BY = range(5)
NEAR_M = 0.010
GOALS = {
    "e57": {"stray": 0.99, "ghost": 0.99, "passer-by": 0.99, "mixed": 0.80},
    "ply": {"stray": 0.99, "ghost": 0.90, "mixed": 0.60},
}
LOST = 0.005


@dataclass(frozen=True, slots=True)
class Case:
    """One scan with its truth.

    Attributes:
        name: Room and format.
        cloud: As read.
        stations: (s, 3) metres from the cloud's origin; empty where the scan does not tell.
        label: (n,) what each point is.
        off_m: (n,) how far it lies from the true surface.
        wanted: (m, 3) places on the true surface that a station sees.
    """

    name: str
    cloud: PointCloud
    stations: Float64
    label: npt.NDArray[np.uint8]
    off_m: npt.NDArray[np.float32]
    wanted: Float64


def modelled(tour: Path, room: str, suffix: str) -> Case:
    """A room of the demo."""
    cloud, known, _ = read_room([open_scan(tour / "scans" / f"{room}.{suffix}")])
    label = np.load(tour / "truth" / f"{room}.npz")["label"]
    if suffix == "e57":  # each station's points in the order of its grid, which the PLY shuffles
        order = np.random.default_rng([VERSION, *room.encode(), 2]).permutation(len(label))
        label = label[np.argsort(order)]
    else:
        given = {each.id: each.stations for each in load_tour(tour).rooms}[room]
        known = known if given == "auto" else np.array(given, np.float64) - cloud.origin
    truth = Truth(tour / "truth", room)
    points, face = spread(truth.vertices, truth.faces, np.random.default_rng(1))
    wanted = points[truth.seen(points, face)]
    off_m = _off_m(truth.scene, cloud)
    return Case(f"{room}.{suffix}", cloud, known, label, off_m, wanted - cloud.origin)


def gallery(folder: Path, suffix: str) -> Case:
    """The structured scan of a room with windows."""
    cloud, known, _ = read_room([open_scan(folder / "scan_structured.e57")])
    vertices, faces = load(folder / "gt_mesh.ply")
    scene = ray_scene(vertices, faces)
    off_m = _off_m(scene, cloud)
    range_m = np.linalg.norm(cloud.points - known[cloud.station], axis=1)
    noise_m = 0.0015 + 0.0002 * range_m
    label = np.where(off_m > np.maximum(NEAR_M, 5 * noise_m), MIXED, SURFACE)
    label[off_m > 0.1] = MIXED
    low, high = vertices.min(axis=0) - 0.1, vertices.max(axis=0) + 0.1
    label[((cloud.points < low) | (cloud.points > high)).any(axis=1)] = STRAY
    points, _ = spread(vertices, faces, np.random.default_rng(1))
    wanted = points[_seen_from(scene, points, known + cloud.origin)]
    wanted -= cloud.origin
    if suffix == "ply":
        order = np.random.default_rng(2).permutation(len(cloud))
        cloud, label, off_m = cloud.take(order), label[order], off_m[order]
        cloud = replace(cloud, station=np.full_like(cloud.station, -1))
        known = np.empty((0, 3))
    return Case(f"gallery.{suffix}", cloud, known, label.astype(np.uint8), off_m, wanted)


def _off_m(scene: Any, cloud: PointCloud) -> npt.NDArray[np.float32]:
    places = o3d.core.Tensor((cloud.points + cloud.origin).astype(np.float32))
    return np.asarray(scene.compute_distance(places).numpy())


def _seen_from(scene: Any, points: Float64, known: Float64) -> npt.NDArray[np.bool_]:
    seen = np.zeros(len(points), np.bool_)
    for station in known:
        way = points - station
        rays = np.concatenate([np.broadcast_to(station, way.shape), way], axis=1)
        reach = scene.cast_rays(o3d.core.Tensor(rays.astype(np.float32)))["t_hit"].numpy()
        seen |= (reach > 0.999) & (
            way[:, 2] > -np.sin(np.radians(60)) * np.linalg.norm(way, axis=1)
        )
    return seen


@dataclass(frozen=True, slots=True)
class Cleaned:
    """What a build makes of a scan.

    Attributes:
        asked: (n,) positions of the points that did not crowd others, which were cleaned.
        cloud: These points, their stations brought together.
        stations: (s, 3) metres, that it goes by.
        kept: (n,) mask of the points left.
        seconds: Processor time of sifting alone.
    """

    asked: npt.NDArray[np.int64]
    cloud: PointCloud
    stations: Float64
    kept: npt.NDArray[np.bool_]
    seconds: float


def cleaned(case: Case) -> Cleaned:
    """Find what the scan does not tell, register, sift."""
    known, points = case.stations, case.cloud.points
    if not len(known):
        known = stations.find_stations(points, stations.Settings())
    asked = crowding.crowding(points, crowding.Settings(*(each / 1000 for each in CROWDED_MM)))
    cloud = case.cloud.take(asked)
    if (cloud.station < 0).any() and len(known):
        owned = ownership.ownership(points, known, ownership.Settings(), asked)
        known, cloud = owned.stations, replace(cloud, station=owned.station)
    joined = register.register(cloud, known, register.Settings())
    begun = time.process_time()
    sifted = sift.sift(joined.cloud, joined.stations, sift.Settings())
    seconds = time.process_time() - begun
    kept = np.isin(_rows(joined.cloud.points), _rows(sifted.cloud.points))
    return Cleaned(asked, joined.cloud, joined.stations, kept, seconds)


def figures(case: Case, done: Cleaned) -> dict[str, float]:
    """How true the points left are."""
    label, off_m = case.label[done.asked], case.off_m[done.asked]
    wrong = {
        "stray": label == STRAY,
        "ghost": label == GHOST,
        "passer-by": label == PASSER_BY,
        "mixed": (label == MIXED) & (off_m > NEAR_M),
        "mixed, all": label == MIXED,
        "surface": label == SURFACE,
    }
    shares = {name: float((~done.kept[at]).mean()) for name, at in wrong.items() if at.any()}
    before = _gap_m(done.cloud.points, case.wanted) <= NEAR_M
    after = _gap_m(done.cloud.points[done.kept], case.wanted) <= NEAR_M
    return {
        **shares,
        "lost": float((before & ~after).sum() / before.sum()),
        "bare before": float((~before).mean()),
        "bare after": float((~after).mean()),
    }


def _rows(points: npt.NDArray[np.float32]) -> npt.NDArray[np.void]:
    return np.ascontiguousarray(points).view(np.dtype((np.void, 12))).reshape(-1)


def _gap_m(points: npt.NDArray[np.float32], wanted: Float64) -> Float64:
    distance, _ = cKDTree(points).query(wanted, distance_upper_bound=2 * NEAR_M, workers=-1)
    return np.asarray(distance)


def reached(kind: str, found: dict[str, float]) -> bool:
    """Whether a case's goals hold."""
    goals = GOALS[kind]
    return found["lost"] <= LOST and all(
        found[name] >= goal for name, goal in goals.items() if name in found
    )


def cases(given: argparse.Namespace) -> Any:
    """The scans asked for, one after the other."""
    rooms = given.room or sorted(file.stem for file in (given.tour / "truth").glob("*.json"))
    for room in rooms:
        if room != "gallery":
            for suffix in given.format or ("e57", "ply"):
                yield suffix, modelled(given.tour, room, suffix)
    if given.gallery and (not given.room or "gallery" in given.room):
        for suffix in given.format or ("e57", "ply"):
            yield suffix, gallery(given.gallery, suffix)


def main() -> int:
    """The command; 1 where a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tour", type=Path, help="a tour's folder, with scans/ and truth/")
    parser.add_argument("--gallery", type=Path, help="folder of the structured scan and its mesh")
    parser.add_argument("--room", action="append", help="only this room")
    parser.add_argument("--format", action="append", choices=["e57", "ply"], help="only this")
    given = parser.parse_args()
    missed = 0
    for kind, case in cases(given):
        done = cleaned(case)
        found = figures(case, done)
        hit = reached(kind, found)
        missed += not hit
        told = {name: round(value, 5) for name, value in found.items()}
        speed = done.seconds / len(case.cloud) * 1e6
        print(
            f"{case.name}: {'reached' if hit else 'MISSED'}, {len(case.cloud):,} points, "
            f"{len(done.stations)} stations, sifted in {speed:.0f} CPU-s a million, "
            f"{json.dumps(told)}",
            flush=True,
        )
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
