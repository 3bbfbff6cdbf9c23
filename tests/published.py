"""Reads a published tour as a stranger would: by the rules of 3D Tiles 1.1 and glTF 2.0 alone.

Nothing of tourgen's own is imported here, so that a mistake of the writer is not repeated by
the reader. Draco parts are decoded by Google's own decoder (DracoPy).
"""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import numpy.typing as npt
from PIL import Image

Float64 = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

DRACO = "KHR_draco_mesh_compression"
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_COMPONENTS = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_UP = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], np.float64)
"""From glTF's y up to the z up of 3D Tiles."""


@dataclass(frozen=True)
class Box:
    """An axis-aligned bounding volume, metres."""

    low: Float64
    high: Float64

    def holds(self, other: Box, slack_m: float) -> bool:
        return bool(
            (other.low >= self.low - slack_m).all() and (other.high <= self.high + slack_m).all()
        )


@dataclass(frozen=True)
class Node:
    """A tile as tileset.json tells it."""

    file: Path
    box: Box
    error_m: float
    refine: str
    children: tuple[Node, ...]

    def walk(self) -> Iterator[Node]:
        yield self
        for child in self.children:
            yield from child.walk()

    def leaves(self) -> Iterator[Node]:
        return (node for node in self.walk() if not node.children)


@dataclass(frozen=True)
class Surface:
    """What a tile draws: z up, metres, room frame."""

    vertices: Float64
    faces: Ints
    uv: Float64
    picture: Image.Image


def published_files(site: Path) -> dict[str, bytes]:
    """Every file of a site but the report, which tells how long things took."""
    return {
        str(file.relative_to(site)): file.read_bytes()
        for file in site.rglob("*")
        if file.is_file() and file.stem != "report"
    }


def tour_of(site: Path) -> dict[str, Any]:
    """What the viewer is told of the tour."""
    return dict(json.loads((site / "tour.json").read_text("utf-8")))


def rooms_of(site: Path) -> dict[str, dict[str, Any]]:
    """The rooms of tour.json by id."""
    tour = json.loads((site / "tour.json").read_text(encoding="utf-8"))
    return {room["id"]: room for room in tour["rooms"]}


def arrival(site: Path, room_id: str) -> dict[str, list[float]]:
    """The first view of a room for one who comes through a door: position and look_at."""
    links = (link for room in rooms_of(site).values() for link in room["links"])
    view: dict[str, list[float]] = next(link["arrive"] for link in links if link["to"] == room_id)
    return view


def tileset(file: Path) -> tuple[dict[str, Any], Node]:
    """The document and its root tile."""
    document = json.loads(file.read_text(encoding="utf-8"))
    return document, _node(document["root"], file.parent, document["root"]["refine"])


def _node(tile: dict[str, Any], folder: Path, refine: str) -> Node:
    refine = tile.get("refine", refine)
    numbers = np.array(tile["boundingVolume"]["box"], np.float64)
    centre, reach = numbers[:3], np.abs(numbers[3:].reshape(3, 3)).sum(axis=0)
    children = tuple(_node(child, folder, refine) for child in tile.get("children", ()))
    return Node(
        folder / tile["content"]["uri"],
        Box(centre - reach, centre + reach),
        float(tile["geometricError"]),
        refine,
        children,
    )


def read_glb(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk of a GLB."""
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    chunks, at = {}, 12
    while at < length:
        size, kind = struct.unpack_from("<II", data, at)
        chunks[kind] = data[at + 8 : at + 8 + size]
        at += 8 + size
    return json.loads(chunks[_JSON]), chunks.get(_BIN, b"")


def write_glb(document: dict[str, Any], binary: bytes) -> bytes:
    """The other way round."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    size = 12 + 8 + len(text) + 8 + len(binary)
    head = struct.pack("<4sIIII", b"glTF", 2, size, len(text), _JSON)
    return head + text + struct.pack("<II", len(binary), _BIN) + binary


def without_draco(data: bytes) -> bytes:
    """The same GLB with plain accessors, which still promise what they promised.

    Counts and bounds of the accessors are left as they were written: a validator then holds them
    against what Draco really gives.
    """
    document, binary = read_glb(data)
    views = document["bufferViews"]
    pieces = [_view(document, binary, i) for i in range(len(views))]
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            packed = primitive["extensions"].pop(DRACO)
            if not primitive["extensions"]:
                del primitive["extensions"]
            decoded = DracoPy.decode(pieces[packed["bufferView"]])
            streams = {
                primitive["attributes"][name]: _attribute(decoded, number)
                for name, number in packed["attributes"].items()
            }
            streams[primitive["indices"]] = np.asarray(decoded.faces).reshape(-1)
            pieces[packed["bufferView"]] = b""
            for number, values in streams.items():
                accessor = document["accessors"][number]
                accessor["bufferView"] = len(pieces)
                kind = _COMPONENTS[accessor["componentType"]]
                values = np.ascontiguousarray(values).astype(kind)
                if number == primitive["indices"]:
                    views.append({"buffer": 0, "target": 34963})
                else:
                    values = values.reshape(len(values), -1)
                    gap = -values.shape[1] % (4 // values.itemsize)  # each begins on four bytes
                    values = np.pad(values, ((0, 0), (0, gap)))
                    stride = {"byteStride": values.shape[1] * values.itemsize} if gap else {}
                    views.append({"buffer": 0, "target": 34962, **stride})
                pieces.append(values.tobytes())
    return _repacked(document, pieces)


def _repacked(document: dict[str, Any], pieces: list[bytes]) -> bytes:
    """Lay the pieces one after the other; empty ones are dropped with their views."""
    number, binary = {}, b""
    views = []
    for old, piece in enumerate(pieces):
        if not piece:
            continue
        number[old] = len(views)
        view = document["bufferViews"][old]
        views.append({**view, "byteOffset": len(binary), "byteLength": len(piece)})
        binary += piece + b"\0" * (-len(piece) % 4)
    for holder in (*document["accessors"], *document.get("images", ())):
        if "bufferView" in holder:
            holder["bufferView"] = number[holder["bufferView"]]
    document["bufferViews"] = views
    document["buffers"] = [{"byteLength": len(binary)}]
    for key in ("extensionsUsed", "extensionsRequired"):
        left = [name for name in document.pop(key, ()) if name != DRACO]
        if left:
            document[key] = left
    return write_glb(document, binary)


def surface(data: bytes) -> Surface:
    """What a GLB draws."""
    document, binary = read_glb(without_draco(data))
    corners, faces, uvs, start = [], [], [], 0
    for matrix, mesh in _placed(document):
        for primitive in document["meshes"][mesh]["primitives"]:
            points = _accessor(document, binary, primitive["attributes"]["POSITION"])
            corners.append((points @ matrix[:3, :3].T + matrix[:3, 3]) @ _UP.T)
            uvs.append(_accessor(document, binary, primitive["attributes"]["TEXCOORD_0"]))
            faces.append(_accessor(document, binary, primitive["indices"]).reshape(-1, 3) + start)
            start += len(points)
    image = _view(document, binary, document["images"][0]["bufferView"])
    return Surface(
        np.concatenate(corners),
        np.concatenate(faces).astype(np.int64),
        np.concatenate(uvs),
        Image.open(io.BytesIO(image)),
    )


def _placed(document: dict[str, Any]) -> Iterator[tuple[Float64, int]]:
    """The meshes of the scene with their matrices."""

    def walk(number: int, above: Float64) -> Iterator[tuple[Float64, int]]:
        node = document["nodes"][number]
        matrix = above @ _matrix(node)
        if "mesh" in node:
            yield matrix, node["mesh"]
        for child in node.get("children", ()):
            yield from walk(child, matrix)

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        yield from walk(root, np.eye(4))


def _matrix(node: dict[str, Any]) -> Float64:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    assert "rotation" not in node, "tourgen writes no rotations"
    matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _view(document: dict[str, Any], binary: bytes, number: int) -> bytes:
    view = document["bufferViews"][number]
    start = view.get("byteOffset", 0)
    return binary[start : start + view["byteLength"]]


def _accessor(document: dict[str, Any], binary: bytes, number: int) -> Float64:
    accessor = document["accessors"][number]
    kind = np.dtype(_COMPONENTS[accessor["componentType"]])
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]]
    data = _view(document, binary, accessor["bufferView"])[accessor.get("byteOffset", 0) :]
    values = np.frombuffer(data, kind, accessor["count"] * width).reshape(-1, width)
    return values.astype(np.float64)


def _attribute(decoded: Any, number: int) -> npt.NDArray[Any]:
    found = [each["data"] for each in decoded.attributes if each["unique_id"] == number]
    assert len(found) == 1, f"Draco attribute {number}: expected one, found {len(found)}"
    return np.asarray(found[0])
