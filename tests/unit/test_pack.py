from __future__ import annotations

import io
import json
import struct

import DracoPy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from surfaces import box_room, mesh, sheet

from tourgen.errors import StageError
from tourgen.geometry import Mesh, TexturedMesh, UvMesh
from tourgen.stages import unwrap
from tourgen.stages.pack import STEP_M, Settings, grid, pack


def textured(some: Mesh) -> TexturedMesh:
    tile = unwrap.unwrap(some, unwrap.Settings(0.02))
    width, height = tile.texture_size
    x, y = np.meshgrid(np.linspace(0, 255, width), np.linspace(0, 255, height))
    picture = np.stack([x, y, np.full_like(x, 90)], -1).astype(np.uint8)
    return TexturedMesh(tile, picture)


def measured(tile: TexturedMesh) -> np.ndarray:
    """Nothing of it is a guess."""
    return np.zeros(len(tile.uv_mesh.mesh.vertices), np.uint8)


def parts(glb: bytes) -> tuple[dict, bytes]:
    magic, version, length = struct.unpack("<4sII", glb[:12])
    assert (magic, version, length) == (b"glTF", 2, len(glb))
    size, kind = struct.unpack("<I4s", glb[12:20])
    assert kind == b"JSON"
    binary_size, kind = struct.unpack("<I4s", glb[20 + size : 28 + size])
    assert kind == b"BIN\0"
    assert size % 4 == 0
    assert binary_size % 4 == 0
    return json.loads(glb[20 : 20 + size]), glb[28 + size :]


def view(document: dict, binary: bytes, index: int) -> bytes:
    one = document["bufferViews"][index]
    start = one.get("byteOffset", 0)
    return binary[start : start + one["byteLength"]]


def decoded(glb: bytes) -> DracoPy.DracoMesh:
    document, binary = parts(glb)
    primitive = document["meshes"][0]["primitives"][0]
    draco = primitive["extensions"]["KHR_draco_mesh_compression"]
    return DracoPy.decode(view(document, binary, draco["bufferView"]))


def z_up(points: np.ndarray) -> np.ndarray:
    return np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)


def test_what_is_unpacked_lies_within_half_a_step_of_what_was_packed() -> None:
    tile = textured(box_room(2.3, 8, 0.01))
    place = grid(tile.uv_mesh.mesh.vertices)
    result = decoded(pack(tile, measured(tile), Settings(place)))
    source = tile.uv_mesh.mesh
    assert len(result.faces) == len(source.faces)

    def triangles(vertices: np.ndarray, uv: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Each face's corners, in one order whatever the packing did to it."""
        corner = np.concatenate([np.rint(vertices / STEP_M), uv], axis=1)[faces]
        first = np.array([np.lexsort(one.T[2::-1])[0] for one in corner])
        turned = np.stack([np.roll(one, -k, 0) for one, k in zip(corner, first, strict=True)])
        flat = turned[..., :3].reshape(len(faces), -1)
        return turned[np.lexsort(flat.T[::-1])]

    before = triangles(source.vertices.astype(float), tile.uv_mesh.uv, source.faces)
    after = triangles(z_up(result.points).astype(float), result.tex_coord, result.faces)
    assert np.array_equal(after[..., :3], before[..., :3])  # the same places of the grid
    off_grid = np.abs(result.points / STEP_M - np.rint(result.points / STEP_M))
    assert off_grid.max() < 0.01
    texels = np.abs(after[..., 3:] - before[..., 3:]) * tile.uv_mesh.texture_size
    assert texels.max() <= 0.25


@settings(deadline=None, max_examples=30)
@given(
    seed=st.integers(0, 10_000),
    at=st.tuples(*[st.floats(-90, 90)] * 3),
    size_m=st.sampled_from([0.05, 3.0, 40.0]),
)
def test_vertices_that_two_tiles_share_decode_to_the_same_bits(
    seed: int, at: tuple[float, float, float], size_m: float
) -> None:
    rng = np.random.default_rng(seed)
    shared = rng.random((40, 3)) * size_m + at
    tiles = []
    for _ in range(2):
        own = rng.random((20, 3)) * size_m + at
        faces = rng.integers(0, 60, (50, 3))
        faces[:40, 0] = np.arange(40)  # every shared vertex is used
        faces[:40, 1] = 40 + np.arange(40) % 20
        faces[:40, 2] = (np.arange(40) + 1) % 40
        tiles.append(mesh(np.concatenate([shared, own]), faces))
    place = grid(np.concatenate([tile.vertices for tile in tiles]))
    assert place.range_m / (2**place.bits - 1) <= 0.00025
    found = []
    for tile in tiles:
        uv = rng.random((60, 2)).astype(np.float32)
        plain = UvMesh(tile, uv, np.zeros(50, np.int32), (8, 8), 0.05)
        made = TexturedMesh(plain, np.zeros((8, 8, 3), np.uint8))
        packed = pack(made, measured(made), Settings(place))
        found.append({point.tobytes(): point for point in decoded(packed).points})
    common = np.array([found[0][bits] for bits in found[0].keys() & found[1].keys()])
    expected = np.rint(shared.astype(np.float32).astype(float) / STEP_M) * STEP_M
    apart = np.abs(z_up(common)[None] - expected[:, None]).max(2).min(1)
    assert apart.max() <= 0.01 * STEP_M


def test_the_document_leaves_out_what_gltf_takes_for_granted() -> None:
    tile = textured(box_room(1.5, 6, 0.01))
    document, _ = parts(pack(tile, measured(tile), Settings(grid(tile.uv_mesh.mesh.vertices))))
    (material,) = document["materials"]
    assert material.keys() == {"extensions", "pbrMetallicRoughness", "doubleSided"}
    assert material["pbrMetallicRoughness"] == {
        "metallicFactor": 0,
        "baseColorTexture": {"index": 0},
    }
    assert "mode" not in document["meshes"][0]["primitives"][0]
    assert [one.get("normalized") for one in document["accessors"]] == [None, None, None, True]


def test_the_document_says_what_the_buffers_hold() -> None:
    tile = textured(box_room(1.5, 6, 0.01))
    glb = pack(tile, measured(tile), Settings(grid(tile.uv_mesh.mesh.vertices)))
    document, binary = parts(glb)
    result = decoded(glb)
    primitive = document["meshes"][0]["primitives"][0]
    indices, position, coordinate = (
        document["accessors"][at]
        for at in (
            primitive["indices"],
            primitive["attributes"]["POSITION"],
            primitive["attributes"]["TEXCOORD_0"],
        )
    )
    assert indices["count"] == result.faces.size
    assert position["count"] == coordinate["count"] == len(result.points)
    assert position["min"] == result.points.min(0).tolist()
    assert position["max"] == result.points.max(0).tolist()
    assert not any("byteOffset" in one or "bufferView" in one for one in document["accessors"])
    ids = primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"]
    by_id = {one["unique_id"]: one["num_components"] for one in result.attributes}
    assert by_id[ids["POSITION"]] == 3
    assert by_id[ids["TEXCOORD_0"]] == 2
    assert set(document["extensionsRequired"]) <= set(document["extensionsUsed"])
    material = document["materials"][primitive["material"]]
    assert "KHR_materials_unlit" in material["extensions"]
    assert material["doubleSided"]
    source = document["textures"][0]["extensions"]["EXT_texture_webp"]["source"]
    image = Image.open(io.BytesIO(view(document, binary, document["images"][source]["bufferView"])))
    assert image.format == "WEBP"
    assert image.size == tile.uv_mesh.texture_size
    off = np.abs(np.asarray(image, float) - tile.texture)
    assert off.mean() < 4


def test_each_vertex_tells_whether_it_is_a_guess() -> None:
    tile = textured(sheet(1.0, 0.5, 12))
    vertices = tile.uv_mesh.mesh.vertices
    guess = np.where(vertices[:, 0] > 0.6, 255, 0).astype(np.uint8)
    glb = pack(tile, guess, Settings(grid(vertices)))
    document, _ = parts(glb)
    primitive = document["meshes"][0]["primitives"][0]
    accessor = document["accessors"][primitive["attributes"]["_INFERRED"]]
    assert (accessor["type"], accessor["componentType"]) == ("SCALAR", 5121)
    assert accessor["normalized"]
    number = primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"]["_INFERRED"]
    result = decoded(glb)
    told = next(each["data"] for each in result.attributes if each["unique_id"] == number)
    np.testing.assert_array_equal(told.ravel() == 255, result.points[:, 0] > 0.6)
    assert 0 < (told == 255).mean() < 1


def test_up_is_y_in_the_file() -> None:
    tile = textured(sheet(1.0, 0.5, 2))
    points = decoded(pack(tile, measured(tile), Settings(grid(tile.uv_mesh.mesh.vertices)))).points
    assert np.ptp(points, axis=0) == pytest.approx([1.0, 0.0, 0.5], abs=STEP_M)
    assert points[:, 2].max() == pytest.approx(0, abs=1e-6)


def test_faces_smaller_than_a_step_are_left_out() -> None:
    plane = sheet(1.0, 1.0, 2)
    vertices = np.concatenate([plane.vertices, plane.vertices[:1] + 1e-5])
    speck = mesh(vertices, np.concatenate([plane.faces, [[0, len(plane.vertices), 1]]]))
    tile = textured(speck)
    result = decoded(pack(tile, measured(tile), Settings(grid(vertices))))
    assert len(result.faces) == len(plane.faces)


def test_a_vertex_off_the_grid_is_an_error() -> None:
    tile = textured(sheet(1.0, 1.0, 2))
    place = grid(tile.uv_mesh.mesh.vertices[:2])
    with pytest.raises(StageError, match="expected vertices within"):
        pack(tile, measured(tile), Settings(place))


def test_nothing_but_specks_is_an_error() -> None:
    tile = textured(mesh([[0, 0, 0], [1e-5, 0, 0], [0, 1e-5, 0]], [[0, 1, 2]]))
    with pytest.raises(StageError, match=r"larger than 0\.25 mm"):
        pack(tile, measured(tile), Settings(grid(tile.uv_mesh.mesh.vertices)))


def test_a_room_of_many_kilometres_is_an_error() -> None:
    with pytest.raises(StageError, match="at most 4096 m, found 9000 m"):
        grid(np.array([[0, 0, 0], [9000, 0, 0]], np.float32))
