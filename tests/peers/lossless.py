"""A room before anything of it was compressed, as one GLB: what every viewer is held against.

The leaves of the finest level as the build baked them, out of its cache: plain accessors, one PNG a
tile. From the same file the packers of others start.
"""

from __future__ import annotations

import io
import json
import shutil
import struct
from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from tourgen.cache import Cache
from tourgen.geometry import TexturedMesh
from tourgen.pipeline import tour_recipes
from tourgen.tour import load_tour

_FLOAT, _UNSIGNED_INT = 5126, 5125
_ARRAY, _ELEMENTS = 34962, 34963
_CLAMP, _LINEAR, _MIPMAPS = 33071, 9729, 9987
_JSON, _BINARY = 0x4E4F534A, 0x004E4942


def leaves_of(tour_folder: Path, room: str) -> list[TexturedMesh]:
    """The finest tiles of a built room with their pictures.

    Raises:
        SystemExit: The build's cache does not hold them any more.
    """
    cache = Cache(tour_folder)
    recipes = tour_recipes(load_tour(tour_folder), cache)
    packing = next(each.files for each in recipes if each.room.id == room)
    tree, _, baked = packing.arguments
    parts = [cache.load(part.key) for part in baked] if isinstance(baked, tuple) else []
    tiles = None if isinstance(tree, tuple) else cache.load(tree.key)
    if tiles is None or not parts or None in parts:
        raise SystemExit(f"{room}: expected its tiles in the cache, found none; build it again")
    pictured = zip(tiles, chain(*parts), strict=True)
    return [textured for tile, textured in pictured if not tile.children]


def write_lossless(leaves: Sequence[TexturedMesh], file: Path) -> int:
    """Write one GLB of all tiles; returns how many faces it has."""
    from PIL import Image

    binary = io.BytesIO()
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": list(range(len(leaves)))}],
        "samplers": [
            {"magFilter": _LINEAR, "minFilter": _MIPMAPS, "wrapS": _CLAMP, "wrapT": _CLAMP}
        ],
    }
    for key in ("nodes", "meshes", "materials", "textures", "images", "accessors", "bufferViews"):
        document[key] = []

    def view(data: bytes, **about: int) -> int:
        binary.write(b"\0" * (-binary.tell() % 4))
        place = {"buffer": 0, "byteOffset": binary.tell(), "byteLength": len(data)}
        document["bufferViews"].append(place | about)
        binary.write(data)
        return len(document["bufferViews"]) - 1

    def accessor(values: Any, kind: str, component: int, target: int, **bounds: Any) -> int:
        told = {"componentType": component, "count": len(values), "type": kind, **bounds}
        told["bufferView"] = view(np.ascontiguousarray(values).tobytes(), target=target)
        document["accessors"].append(told)
        return len(document["accessors"]) - 1

    for number, leaf in enumerate(leaves):
        mesh = leaf.uv_mesh.mesh
        x, y, z = mesh.vertices.astype(np.float32).T
        corners = np.stack([x, z, -y], axis=1)
        bounds = {"min": corners.min(0).tolist(), "max": corners.max(0).tolist()}
        attributes = {
            "POSITION": accessor(corners, "VEC3", _FLOAT, _ARRAY, **bounds),
            "TEXCOORD_0": accessor(leaf.uv_mesh.uv.astype(np.float32), "VEC2", _FLOAT, _ARRAY),
        }
        faces = mesh.faces.astype(np.uint32).reshape(-1)
        index = accessor(faces, "SCALAR", _UNSIGNED_INT, _ELEMENTS)
        picture = io.BytesIO()
        Image.fromarray(leaf.texture).save(picture, "PNG")
        image = {"bufferView": view(picture.getvalue()), "mimeType": "image/png"}
        primitive = {"attributes": attributes, "indices": index, "material": number}
        color = {"baseColorTexture": {"index": number}, "metallicFactor": 0}
        unlit: dict[str, Any] = {"KHR_materials_unlit": {}}
        document["images"].append(image)
        document["textures"].append({"sampler": 0, "source": number})
        document["materials"].append(
            {"pbrMetallicRoughness": color, "doubleSided": True, "extensions": unlit}
        )
        document["meshes"].append({"primitives": [primitive]})
        document["nodes"].append({"mesh": number})
    document["buffers"] = [{"byteLength": binary.tell()}]
    file.write_bytes(_glb(document, binary.getvalue()))
    return sum(len(each.uv_mesh.mesh.faces) for each in leaves)


def _glb(document: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary))
    chunks = struct.pack("<II", len(text), _JSON) + text
    return head + chunks + struct.pack("<II", len(binary), _BINARY) + binary


def lossless_site(site: Path, room: str, whole: Path, out: Path) -> None:
    """A copy of a site in which a room consists of one tile: the whole of it, uncompressed."""
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(site, out)
    folder = out / "rooms" / room
    tileset = json.loads((folder / "tileset.json").read_text("utf-8"))
    root = tileset["root"]
    root.pop("children", None)
    root |= {"geometricError": 0, "content": {"uri": "tiles/whole.glb"}}
    shutil.copyfile(whole, folder / "tiles/whole.glb")
    (folder / "tileset.json").write_text(json.dumps(tileset), "utf-8")
