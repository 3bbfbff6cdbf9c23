"""What a surveyor hands over (PLY, E57), and beside it the truth that only benches open."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_OID, UUID, uuid5

import numpy as np

from tourgen.geometry import Float32, UInt8
from tourgen.simulation.model import RoomModel, TrueRoom
from tourgen.simulation.scanner import LABELS, Returns, Station


def write_ply(path: Path, points: Float32, colors: UInt8) -> None:
    """Binary little endian: float x, y, z and uchar red, green, blue."""
    record = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
    )
    with path.open("wb") as file:
        file.write(header.encode("ascii"))
        for start in range(0, len(points), 1_000_000):
            part = slice(start, start + 1_000_000)
            block = np.empty(len(points[part]), dtype=record)
            block["xyz"], block["rgb"] = points[part], colors[part]
            file.write(block.tobytes())


def write_e57(
    path: Path,
    room: str,
    stations: Sequence[Station],
    scans: Sequence[Returns],
    pictures: Sequence[UInt8],
) -> None:
    """One scan a station with its pose, rows, columns and a spherical picture."""
    import pye57
    from PIL import Image

    with _fixed_guids(room), pye57.E57(str(path), mode="w") as file:
        for number, (station, returns, picture) in enumerate(
            zip(stations, scans, pictures, strict=True)
        ):
            name = f"{room} station {number + 1}"
            rotation = _quaternion(station.believed.rotation)
            data = {
                **{f"cartesian{axis}": returns.local[:, k] for k, axis in enumerate("XYZ")},
                **{
                    f"color{name}": returns.colors[:, k]
                    for k, name in enumerate(("Red", "Green", "Blue"))
                },
                "rowIndex": returns.row,
                "columnIndex": returns.column,
            }
            file.write_scan_raw(
                data, name=name, rotation=rotation, translation=station.believed.position
            )
            jpeg = io.BytesIO()
            Image.fromarray(picture).save(jpeg, "JPEG", quality=88)
            _add_picture(file, number, name, jpeg.getvalue(), picture.shape[:2], rotation, station)


def _add_picture(
    file: Any,
    number: int,
    name: str,
    jpeg: bytes,
    size: tuple[int, ...],
    rotation: Sequence[float],
    station: Station,
) -> None:
    """An image2D node in spherical representation, tied to its scan."""
    from pye57 import libe57

    imf = file.image_file
    node = libe57.StructureNode(imf)
    guid = file.data3d[number]["guid"].value()
    node.set("guid", libe57.StringNode(imf, f"{{{uuid5(NAMESPACE_OID, guid)}}}"))
    node.set("name", libe57.StringNode(imf, f"{name} panorama"))
    node.set("associatedData3DGuid", libe57.StringNode(imf, guid))
    pose, turn, shift = (libe57.StructureNode(imf) for _ in range(3))
    for key, value in zip("wxyz", rotation, strict=True):
        turn.set(key, libe57.FloatNode(imf, float(value)))
    for key, value in zip("xyz", station.believed.position, strict=True):
        shift.set(key, libe57.FloatNode(imf, float(value)))
    pose.set("rotation", turn)
    pose.set("translation", shift)
    node.set("pose", pose)
    sphere = libe57.StructureNode(imf)
    blob = libe57.BlobNode(imf, len(jpeg))
    sphere.set("jpegImage", blob)
    sphere.set("imageHeight", libe57.IntegerNode(imf, size[0]))
    sphere.set("imageWidth", libe57.IntegerNode(imf, size[1]))
    sphere.set("pixelHeight", libe57.FloatNode(imf, np.pi / size[0]))
    sphere.set("pixelWidth", libe57.FloatNode(imf, 2 * np.pi / size[1]))
    node.set("sphericalRepresentation", sphere)
    file.root["images2D"].append(node)
    blob.write(jpeg, 0, len(jpeg))


@contextmanager
def _fixed_guids(seed: str) -> Iterator[None]:
    """Let pye57 number its nodes from ``seed``: its random GUIDs would make every file differ."""
    import pye57.e57 as writer

    rng = np.random.default_rng(list(seed.encode()))
    genuine = writer.uuid
    writer.uuid = _Numbered(rng)
    try:
        yield
    finally:
        writer.uuid = genuine


class _Numbered:
    """Stands in for the ``uuid`` module."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def uuid4(self) -> UUID:
        return UUID(bytes=self._rng.bytes(16), version=4)


def _quaternion(rotation: Any) -> list[float]:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(rotation).as_quat(canonical=True)
    return [float(w), float(x), float(y), float(z)]


def write_truth(
    folder: Path,
    model: RoomModel,
    truth: TrueRoom,
    stations: Sequence[Station],
    label: UInt8,
    station: UInt8,
) -> None:
    """Mesh with uv (PLY), texture (PNG), labels and stations per point (NPZ), facts (JSON)."""
    from PIL import Image

    room = model.id
    _write_mesh(folder / f"{room}.ply", truth, f"{room}.png")
    Image.fromarray(truth.texture).save(folder / f"{room}.png", compress_level=1)
    np.savez(folder / f"{room}.npz", label=label, station=station)
    mirrors = np.array([part.material.mirror for part in model.charts])[truth.mesh.face_chart]
    facts = {
        "labels": list(LABELS),
        "stations": [
            {
                "position": s.true.position.tolist(),
                "believed_position": s.believed.position.tolist(),
                "believed_rotation": s.believed.rotation.tolist(),
                "true_rotation": s.true.rotation.tolist(),
                "gain": s.gain.tolist(),
            }
            for s in stations
        ],
        "passer_by_station": model.passer_by_station,
        "openings": [
            {
                **asdict(place.opening),
                "center": place.center.tolist(),
                "right": place.right.tolist(),
                "up": place.up.tolist(),
                "outward": place.outward.tolist(),
            }
            for place in model.openings
        ],
        "lamps": [asdict(lamp) for lamp in model.lamps],
        "mirror_faces": np.nonzero(mirrors)[0].tolist(),
    }
    (folder / f"{room}.json").write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")


def _write_mesh(path: Path, truth: TrueRoom, texture: str) -> None:
    vertex = np.empty(len(truth.mesh.vertices), dtype=[("xyz", "<f4", 3), ("st", "<f4", 2)])
    vertex["xyz"] = truth.mesh.vertices
    vertex["st"][:, 0], vertex["st"][:, 1] = truth.uv[:, 0], 1 - truth.uv[:, 1]
    face = np.empty(len(truth.mesh.faces), dtype=[("n", "u1"), ("v", "<i4", 3)])
    face["n"], face["v"] = 3, truth.mesh.faces
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment TextureFile {texture}\n"
        f"element vertex {len(vertex)}\n"
        "property float x\nproperty float y\nproperty float z\nproperty float s\nproperty float t\n"
        f"element face {len(face)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode("ascii") + vertex.tobytes() + face.tobytes())
