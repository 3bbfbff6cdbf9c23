"""How well stations come together: ``python tests/peers/registration.py TOUR [GALLERY.e57]``.

The E57 scans of a demo tour, whose poses are off by 1 to 2 mm and 0.01 degrees, are registered as
they are, and once more after the last station was moved by 5 cm and 1 degree. The scans of a
gallery whose poses are exact may follow.

For each two stations: how far apart the place halfway between them comes out of both, and how
much they are turned against each other, by the true poses.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tourgen.geometry import Float64, PointCloud
from tourgen.scans import open_scan, read_room
from tourgen.stages import register
from tourgen.tour import Room, load_tour

GOAL_MM, GOAL_DEG = 2.0, 0.05
MOVED_M, TURNED_DEG = 0.05, 1.0


@dataclass(frozen=True, slots=True)
class Poses:
    """Motions of s stations.

    Attributes:
        rotations: (s, 3, 3), and
        translations: (s, 3) metres: p becomes R p + t.
    """

    rotations: Float64
    translations: Float64

    @classmethod
    def still(cls, count: int) -> Poses:
        """None moves."""
        return cls(np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)))

    def after(self, first: Poses) -> Poses:
        """First those, then these."""
        return Poses(
            self.rotations @ first.rotations,
            np.einsum("sij,sj->si", self.rotations, first.translations) + self.translations,
        )

    def back(self) -> Poses:
        """The opposite motions."""
        turn = self.rotations.transpose(0, 2, 1)
        return Poses(turn, -np.einsum("sij,sj->si", turn, self.translations))


def true_motions(facts: Path) -> tuple[Poses, Float64]:
    """From where the poses put each station's points to where they are; and the stations."""
    stations = json.loads(facts.read_text(encoding="utf-8"))["stations"]
    true, believed = (
        Poses(
            np.array([station[turn] for station in stations]),
            np.array([station[place] for station in stations]),
        )
        for turn, place in (
            ("true_rotation", "position"),
            ("believed_rotation", "believed_position"),
        )
    )
    return true.after(believed.back()), true.translations


def apart(made: Poses, true: Poses, stations: Float64) -> tuple[Float64, Float64]:
    """Millimetres and degrees between each two stations, made against true motions."""
    wrong = made.after(true.back())
    gap, twist = [], []
    for one, other in combinations(range(len(stations)), 2):
        between = (stations[one] + stations[other]) / 2
        here, there = (wrong.rotations[k] @ between + wrong.translations[k] for k in (one, other))
        gap.append(np.linalg.norm(here - there) * 1000)
        turn = wrong.rotations[one] @ wrong.rotations[other].T
        twist.append(np.degrees(Rotation.from_matrix(turn).magnitude()))
    return np.array(gap), np.array(twist)


def displaced(cloud: PointCloud, stations: Float64) -> tuple[PointCloud, Float64, Poses]:
    """The last station moved by 5 cm and 1 degree in some direction."""
    rng = np.random.default_rng(1)
    axis, way = rng.normal(size=(2, 3))
    last = len(stations) - 1
    turn = Rotation.from_rotvec(np.radians(TURNED_DEG) * axis / np.linalg.norm(axis)).as_matrix()
    moves = Poses.still(len(stations))
    moves.rotations[last] = turn
    shift = MOVED_M * way / np.linalg.norm(way)
    moves.translations[last] = stations[last] + shift - turn @ stations[last]
    points, places = cloud.points.copy(), stations.copy()
    mine = cloud.station == last
    points[mine] = points[mine] @ turn.T + moves.translations[last]
    places[last] += shift
    return PointCloud(cloud.origin, points, cloud.colors, cloud.station), places, moves


@dataclass(frozen=True, slots=True)
class Case:
    """The stations of one scan and their truth.

    Attributes:
        name: Of the room.
        cloud: As read.
        given: (s, 3) where the scan puts its stations, metres.
        true: From there to where they are.
        stations: (s, 3) where they are.
    """

    name: str
    cloud: PointCloud
    given: Float64
    true: Poses
    stations: Float64


def modelled(tour: Path, room: Room) -> Case:
    """A room of the demo."""
    cloud, given, _ = read_room((open_scan(tour / "scans" / f"{room.id}.e57"),), room.keep)
    return Case(room.id, cloud, given, *true_motions(tour / "truth" / f"{room.id}.json"))


def exact(scan: Path) -> Case:
    """A scan whose poses are the truth."""
    cloud, given, _ = read_room((open_scan(scan),))
    return Case("gallery", cloud, given, Poses.still(len(given)), given)


def figures(case: Case, move: bool) -> dict[str, float]:
    """What comes of a case as it is, or after one station was moved, before and after."""
    still = Poses.still(len(case.given))
    points, places, moves = (
        displaced(case.cloud, case.given) if move else (case.cloud, case.given, still)
    )
    begun = time.perf_counter()
    made = register.register(points, places, register.Settings())
    found = {"seconds": time.perf_counter() - begun}
    after = Poses(made.rotations, made.translations)
    for when, poses in (("before", still), ("after", after)):
        gap, twist = apart(poses, case.true.after(moves.back()), case.stations)
        found |= {
            f"{when} largest mm": float(gap.max()),
            f"{when} mean mm": float(gap.mean()),
            f"{when} largest deg": float(twist.max()),
            f"{when} mean deg": float(twist.mean()),
        }
    return found


def told(case: Case) -> bool:
    """Print what comes of one scan, as given and displaced; whether the goals are met."""
    reached = True
    for words, move in (("as given", False), ("displaced", True)):
        found = figures(case, move)
        print(f"{case.name}, {words}: {len(case.cloud):,} points, {found['seconds']:.1f} s")
        for when in ("before", "after"):
            print(
                f"  {when:7} {found[f'{when} largest mm']:8.3f} mm largest"
                f" {found[f'{when} mean mm']:8.3f} mean"
                f" {found[f'{when} largest deg']:8.4f} deg largest"
                f" {found[f'{when} mean deg']:8.4f} mean"
            )
        reached &= found["after largest mm"] <= GOAL_MM and found["after largest deg"] <= GOAL_DEG
    return reached


def main() -> int:
    """The command; 1 where a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tour", type=Path, help="a tour's folder, with scans/ and truth/")
    parser.add_argument("gallery", type=Path, nargs="?", help="an E57 with exact poses")
    parser.add_argument("--room", action="append", help="only this room")
    asked = parser.parse_args()
    reached = True
    for room in load_tour(asked.tour).rooms:
        if asked.room and room.id not in asked.room:
            continue
        reached &= told(modelled(asked.tour, room))
    if asked.gallery:
        reached &= told(exact(asked.gallery))
    return 0 if reached else 1


if __name__ == "__main__":
    sys.exit(main())
