"""The rooms that are judged: their scan, their truth, and the boxes that the publisher drew."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from score import Truth

from tourgen.geometry import Float32, Float64, UInt8

Bools = npt.NDArray[np.bool_]
GALLERY = "gallery_sim"
AROUND_M = 0.1


@dataclass(frozen=True)
class Box:
    """An axis-aligned box, metres.

    Attributes:
        low: (3,)
        high: (3,)
    """

    low: Float64
    high: Float64

    def holds(self, points: Float32) -> Bools:
        """(n,) which points lie within."""
        inside: Bools = ((points >= self.low) & (points <= self.high)).all(axis=1)
        return inside


@dataclass(frozen=True)
class BenchRoom:
    """One room of the bench.

    Attributes:
        id: Its name, also of its files.
        scan: The merged scan.
        truth_folder: Holds ``ID.ply`` and ``ID.json``.
        keep: Nothing outside belongs to the room; none: all does.
        remove: What lies within does not.
    """

    id: str
    scan: Path
    truth_folder: Path
    keep: Box | None
    remove: tuple[Box, ...]

    def truth(self) -> Truth:
        """The true surface."""
        return Truth(self.truth_folder, self.id)

    def facts(self) -> dict[str, Any]:
        """What else the simulator knows."""
        text = (self.truth_folder / f"{self.id}.json").read_text(encoding="utf-8")
        facts: dict[str, Any] = json.loads(text)
        return facts

    def stations(self) -> Float64:
        """(s, 3) where the scanner truly stood, metres."""
        return np.array([station["position"] for station in self.facts()["stations"]])

    def cloud(self) -> tuple[Float32, UInt8]:
        """Points, metres, and sRGB colours of the scan, within the publisher's boxes."""
        points, colors = read_scan(self.scan)
        kept = (
            np.ones(len(points), dtype=np.bool_) if self.keep is None else self.keep.holds(points)
        )
        for box in self.remove:
            kept &= ~box.holds(points)
        return points[kept], colors[kept]

    def cropped(self) -> Float32:
        """The cloud's points in and near the room, as one would crop them by hand."""
        points, _ = self.cloud()
        seen = self.truth().vertices
        room = Box(seen.min(axis=0) - AROUND_M, seen.max(axis=0) + AROUND_M)
        return points[room.holds(points)]


def demo_rooms(tour: Path) -> list[BenchRoom]:
    """The rooms of a simulated tour, as its tour.toml describes them."""
    told = tomllib.loads((tour / "tour.toml").read_text(encoding="utf-8"))
    return [
        BenchRoom(
            room["id"],
            tour / room["scans"][0],
            tour / "truth",
            next(_boxes([room["keep"]])) if "keep" in room else None,
            tuple(_boxes(room.get("remove", []))),
        )
        for room in told["room"]
    ]


def gallery(folder: Path, scratch: Path) -> BenchRoom:
    """The gallery of ``folder``: its truth and merged scan, rewritten as a tour's are."""
    truth = scratch / "truth"
    truth.mkdir(parents=True, exist_ok=True)
    told = json.loads((folder / "stations.json").read_text(encoding="utf-8"))
    facts = {"stations": told["stations"], "mirror_faces": [], "openings": [], "lamps": []}
    (truth / f"{GALLERY}.json").write_text(json.dumps(facts), encoding="utf-8")
    (truth / f"{GALLERY}.ply").write_bytes((folder / "gt_mesh.ply").read_bytes())
    return BenchRoom(GALLERY, folder / "scan_structured.e57", truth, None, ())


def _boxes(told: Sequence[dict[str, Sequence[float]]]) -> Iterator[Box]:
    return (Box(np.array(each["min"], float), np.array(each["max"], float)) for each in told)


def stamp(file: Path) -> str:
    """Of a file's state: its size and time of change."""
    about = file.stat()
    return f"{about.st_size}-{about.st_mtime_ns}"


def read_scan(scan: Path) -> tuple[Float32, UInt8]:
    """Points, metres, and sRGB colours of a PLY, or of all scans of an E57."""
    if scan.suffix == ".ply":
        import open3d as o3d

        cloud = o3d.io.read_point_cloud(str(scan))
        colors = np.rint(np.asarray(cloud.colors) * 255).astype(np.uint8)
        return np.asarray(cloud.points, np.float32), colors
    import pye57

    file = pye57.E57(str(scan))
    points, colors = [], []
    for number in range(file.scan_count):
        data = file.read_scan(number, colors=True, ignore_missing_fields=True)
        points.append(np.stack([data[f"cartesian{axis}"] for axis in "XYZ"], axis=1))
        colors.append(np.stack([data[f"color{name}"] for name in ("Red", "Green", "Blue")], axis=1))
    return np.concatenate(points).astype(np.float32), np.concatenate(colors).astype(np.uint8)
