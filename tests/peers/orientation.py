"""How true the normals are: ``python tests/peers/orientation.py TOUR [--room ID] [--given]``.

The merged scans of a demo tour go through sift, thin and normals as in a build, without
stations (``--given``: with those of the truth, not told which point is whose), and the normals
are held against what ``tourgen.simulate`` wrote beside the scans.

The true normal of a point is that of the face that its beam hit first, from the true place of
its station: it looks at the side that was scanned. Only points labelled as surface count. A
thinned point has the truth of the raw point nearest to it.

Seconds are the processor's, of all cores together, so that other work on the machine does not
count: the clock shows as many at the most. Turning is all that follows the tangent planes, the
search for stations included.

right        share of the normals less than 90 degrees from the true one
flat         points with no other true direction (15 degrees) within 50 mm
crease A-B   points whose nearest other true direction (30 degrees) lies A to B mm away
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tourgen.fitting import points as fitting
from tourgen.geometry import Float32, Float64, PointCloud
from tourgen.rays import ray_scene, rays_of
from tourgen.scans import open_scan, read_room
from tourgen.stages import normals, sift, stations
from tourgen.stages.tangent import tangent_planes
from tourgen.tour import Room, load_tour, open_scans

GOAL_RIGHT, GOAL_SECONDS_A_MILLION = 0.995, 10.0
SAMPLE = 150_000
SETTINGS = normals.Settings()
NEAR_M = 0.01
"""So near a point lies to the true one that it stands for."""
BANDS_MM = ((0, 5), (5, 10), (10, 20), (20, 30))
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Truth:
    """Where each raw point truly lies, which way its surface looks, what else is there.

    Attributes:
        points: (n, 3) surface points as scanned.
        normals: (n, 3) of the faces that they lie on, toward their stations.
        seen: (m, 3) even samples of the true surface, and
        seen_normals: (m, 3) theirs.
        stations: (s, 3) true places.
    """

    points: Float32
    normals: Float32
    seen: Float32
    seen_normals: Float32
    stations: Float64


def truth_of(folder: Path, room: str) -> Truth:
    """Follow each point's beam from the true place of its station."""
    import open3d as o3d

    points = _raw_points(folder / "scans" / f"{room}.ply")
    marks = np.load(folder / "truth" / f"{room}.npz")
    facts = json.loads((folder / "truth" / f"{room}.json").read_text(encoding="utf-8"))
    mesh = o3d.io.read_triangle_mesh(str(folder / "truth" / f"{room}.ply"))
    scene = ray_scene(np.asarray(mesh.vertices), np.asarray(mesh.triangles))
    normal = np.zeros_like(points)
    good = np.zeros(len(points), np.bool_)
    for number, station in enumerate(facts["stations"]):
        mine = np.flatnonzero((marks["station"] == number) & (marks["label"] == 0))
        local = (points[mine] - station["believed_position"]) @ np.array(
            station["believed_rotation"]
        )
        way = local @ np.array(station["true_rotation"]).T
        reach = np.linalg.norm(way, axis=1)
        origin = np.broadcast_to(station["position"], way.shape)
        answer = scene.cast_rays(rays_of(origin, way / reach[:, None]))
        found = answer["primitive_normals"].numpy()
        found[np.einsum("ij,ij->i", found, way) > 0] *= -1
        normal[mine] = found
        good[mine] = np.abs(answer["t_hit"].numpy() - reach) < 0.03
    sampled = mesh.sample_points_uniformly(3_000_000, use_triangle_normal=True)
    return Truth(
        points[good],
        normal[good],
        np.asarray(sampled.points).astype(np.float32),
        np.asarray(sampled.normals).astype(np.float32),
        np.array([station["position"] for station in facts["stations"]]),
    )


def _raw_points(path: Path) -> Float32:
    return np.concatenate([chunk.points for chunk in open_scan(path).chunks()]).astype(np.float32)


def prepared(room: Room, folder: Path) -> tuple[PointCloud, Float32]:
    """The cloud that a build estimates normals of, and the cleaned one that stations show in."""
    cloud, _, _ = read_room(open_scans(room, folder), room.keep, room.remove)
    kept = sift.sift(cloud, np.empty((0, 3)), sift.Settings())
    thinning = fitting.Thinning(room.surface.detail_mm, room.clean.thin_mm)
    return fitting.thinned(kept, fitting.spaced(kept), thinning), kept.cloud.points


def figures(points: Float32, found: Float32, truth: Truth) -> dict[str, float]:
    """Hold (n, 3) normals against the truth."""
    mine, true = _matched(points, truth)
    cosine = np.einsum("ij,ij->i", found[mine], true)
    chosen = np.random.default_rng(0).permutation(len(mine))[:SAMPLE]
    error = np.degrees(np.arccos(np.clip(np.abs(cosine[chosen]), 0, 1)))
    flat, crease_mm = _creases(points[mine[chosen]], true[chosen], truth)
    groups = {"flat": flat} | {
        f"crease {low}-{high}": (crease_mm >= low) & (crease_mm < high) for low, high in BANDS_MM
    }
    out = {}
    for name, group in groups.items():
        out[f"{name} median_deg"] = float(np.median(error[group]))
        out[f"{name} p95_deg"] = float(np.quantile(error[group], 0.95))
    out["flat rms_deg"] = float(np.sqrt((error[flat] ** 2).mean()))
    return out


def right(points: Float32, found: Float32, truth: Truth) -> float:
    """The share of (n, 3) normals that look into the open."""
    mine, true = _matched(points, truth)
    return float((np.einsum("ij,ij->i", found[mine], true) > 0).mean())


def _matched(points: Float32, truth: Truth) -> tuple[NDArray[np.int64], Float32]:
    """Which points the truth knows, and their true normals."""
    away, nearest = map(
        np.asarray, cKDTree(truth.points).query(points, distance_upper_bound=NEAR_M, workers=-1)
    )
    mine = np.flatnonzero(np.isfinite(away))
    return mine, truth.normals[nearest[mine]]


def _creases(points: Float32, true: Float32, truth: Truth) -> tuple[Bools, Float64]:
    """Which points lie on flat ground; distance to the next other direction, millimetres."""
    tree = cKDTree(truth.seen)
    flat = np.ones(len(points), np.bool_)
    crease = np.full(len(points), np.inf)
    for start in range(0, len(points), 10_000):
        part = slice(start, start + 10_000)
        around = np.asarray(tree.query_ball_point(points[part], 0.05, workers=-1))
        lists = [np.asarray(each, np.int64) for each in around]
        count = np.array([len(each) for each in lists])
        row, other = np.repeat(np.arange(len(count)), count), np.concatenate(lists)
        cosine = np.abs(np.einsum("ij,ij->i", true[part][row], truth.seen_normals[other]))
        differs = cosine < np.cos(np.radians(15))
        flat[part] = np.bincount(row[differs], minlength=len(count)) == 0
        sharp = cosine < np.cos(np.radians(30))
        away = np.linalg.norm(points[part][row] - truth.seen[other], axis=1)
        np.minimum.at(crease[part], row[sharp], away[sharp])
    return flat, crease * 1000


@dataclass(frozen=True, slots=True)
class Oriented:
    """What comes of one room.

    Attributes:
        points: (n, 3) thinned.
        normals: (n, 3) theirs.
        truth: To hold them against.
        facts: How many points and stations, and what they took.
    """

    points: Float32
    normals: Float32
    truth: Truth
    facts: dict[str, float]


def oriented(folder: Path, room: Room, *, given: bool) -> Oriented:
    """Normals of one room of a tour, without stations or with the true ones."""
    truth = truth_of(folder, room.id)
    cloud, full = prepared(room, folder)
    spent = time.process_time
    start = spent()
    tangent_planes(cloud.points, SETTINGS.first_neighbours, SETTINGS.neighbours)
    planes_s = spent() - start
    stood = truth.stations if given else stations.find_stations(full, stations.Settings())
    found_s = spent() - start - planes_s
    turned = normals.normals(cloud, stood, SETTINGS)
    turned_s = spent() - start - 2 * planes_s
    million = len(cloud) / 1e6
    facts = {
        "points": float(len(cloud)),
        "stations": float(len(stood)),
        "stations seconds": found_s,
        "planes seconds a million": planes_s / million,
        "turning seconds a million": turned_s / million,
        "right": right(cloud.points, turned.normals, truth),
    }
    return Oriented(cloud.points, turned.normals, truth, facts)


def main() -> int:
    """The command; 1 where a room misses its goals."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tour", type=Path, help="a tour's folder, with scans/ and truth/")
    parser.add_argument("--room", action="append", help="only this room")
    parser.add_argument("--given", action="store_true", help="with the true stations")
    given = parser.parse_args()
    reached = True
    for room in load_tour(given.tour).rooms:
        if given.room and room.id not in given.room:
            continue
        done = oriented(given.tour, room, given=given.given)
        facts = done.facts | figures(done.points, done.normals, done.truth)
        print(room.id, *(f"  {name:24} {value:12.4f}" for name, value in facts.items()), sep="\n")
        reached &= facts["right"] >= GOAL_RIGHT
        reached &= facts["turning seconds a million"] <= GOAL_SECONDS_A_MILLION
    return 0 if reached else 1


if __name__ == "__main__":
    sys.exit(main())
