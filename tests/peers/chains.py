"""The peers' whole chains at the same number of bytes: mesh, decimation, colour.

Each program decimates and colours its own best mesh of a room. The result is weighed as ours is,
geometry by Draco on a grid of 0.25 mm and pictures as WebP, which is better than either program
writes, so that the bytes are spent on the same things. Open3D colours vertices, and gets as many
faces as the bytes hold. PyMeshLab transfers the scan's colours to a texture over its trivial UVs;
a third of the bytes go to faces, and the rest decides the quality of the picture. They are drawn
by ray casting, nine rays a pixel: a better renderer than a browser's.
"""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from drawing import ColorsAt, textured, vertex_colored
from rooms import BenchRoom

from tourgen.geometry import Float32, Float64, Int32, UInt8

GRID_M = 0.00025
UV_BITS = 12
FACES_SHARE = 1 / 3
TEXTURE_PX = 2048
MOST_FACES = 200_000
"""More would get less than 20 texels each."""
FACE_BYTES = 5
"""About what a face weighs, to begin with."""
FULL_SHARE = 0.97
"""So much of the bytes is as good as all."""
TRIES = 8


@dataclass(frozen=True)
class Painted:
    """A coloured mesh and its weight.

    Attributes:
        vertices: (v, 3) metres.
        faces: (f, 3)
        colors_at: Its colours.
        size: Bytes.
    """

    vertices: Float64
    faces: Int32
    colors_at: ColorsAt
    size: int


def vertex_chain(vertices: Float64, faces: Int32, room: BenchRoom, budget: int) -> Painted:
    """Open3D: quadric decimation, each vertex coloured by the scan's four points next to it."""
    import open3d as o3d
    from scipy.spatial import cKDTree

    points, colors = room.cloud()
    tree = cKDTree(points)
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces)
    )

    def of_faces(count: int) -> Painted:
        fewer = mesh.simplify_quadric_decimation(count)
        at, corners = np.asarray(fewer.vertices), np.asarray(fewer.triangles)
        own = np.rint(colors[tree.query(at, k=4)[1]].mean(axis=1)).astype(np.uint8)
        size = len(_draco(at, corners, colors=own))
        return Painted(at, corners, vertex_colored(own, corners), size)

    return _of_most_faces(of_faces, len(faces), budget)


def texture_chain(vertices: Float64, faces: Int32, room: BenchRoom, budget: int) -> Painted:
    """PyMeshLab: quadric decimation, trivial UVs, the scan's colours to a texture."""

    def of_faces(count: int) -> Painted:
        at, corners, uv, _ = _unwrapped(vertices, faces, count)
        size = len(_draco(at, corners, uv=uv))
        return Painted(at, corners, textured(uv, corners, np.zeros((1, 1, 3), np.uint8)), size)

    bare = _of_most_faces(of_faces, min(len(faces), MOST_FACES), int(budget * FACES_SHARE))
    at, corners, uv, texture = _unwrapped(vertices, faces, len(bare.faces), room)

    def of_quality(quality: int) -> Painted:
        packed = _webp(texture, quality)
        size = bare.size + len(packed)
        return Painted(at, corners, textured(uv, corners, _decoded(packed)), size)

    return _of_best_quality(of_quality, budget)


def _of_most_faces(make: Callable[[int], Painted], most: int, budget: int) -> Painted:
    """What as many faces make as fit: bytes grow almost as faces do, so a few tries find them."""
    best, count = None, min(most, budget // FACE_BYTES)
    for _ in range(TRIES):
        tried = make(count)
        fits = tried.size <= budget
        if fits and (best is None or tried.size > best.size):
            best = tried
        if best and (best.size > FULL_SHARE * budget or (fits and count == most)):
            break
        count = min(most, int(count * (1 + FULL_SHARE) / 2 * budget / tried.size))
    if best is None:
        raise RuntimeError(f"expected a mesh of {budget} bytes, found none")
    return best


def _of_best_quality(make: Callable[[int], Painted], budget: int) -> Painted:
    """What the best quality of a picture makes that fits, 1 to 100; halves the range."""
    best, low, high = make(1), 1, 101
    while high - low > 1:
        middle = (low + high) // 2
        tried = make(middle)
        if tried.size <= budget:
            best, low = tried, middle
        else:
            high = middle
    return best


def _unwrapped(
    vertices: Float64, faces: Int32, count: int, painter: BenchRoom | None = None
) -> tuple[Float64, Int32, Float32, UInt8]:
    """Vertices split by face, faces, uv and texture (black without a scan) of ``count`` faces."""
    import pymeshlab
    from PIL import Image

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=count, preservenormal=True)
    meshes.compute_texcoord_parametrization_triangle_trivial_per_wedge(
        textdim=TEXTURE_PX, border=2, method="Space-optimizing"
    )
    mesh = meshes.current_mesh()
    corners = mesh.face_matrix()
    uv = mesh.wedge_tex_coord_matrix().astype(np.float32)
    uv[:, 1] = 1 - uv[:, 1]
    split = np.arange(corners.size, dtype=np.int32).reshape(-1, 3)
    at = mesh.vertex_matrix()[corners.ravel()]
    if painter is None:
        return at, split, uv, np.zeros((1, 1, 3), np.uint8)
    points, colors = painter.cloud()
    meshes.add_mesh(
        pymeshlab.Mesh(
            vertex_matrix=points.astype(np.float64),
            v_color_matrix=np.column_stack([colors / 255, np.ones(len(colors))]),
        )
    )
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "colors.png"
        meshes.transfer_attributes_to_texture_per_vertex(
            sourcemesh=1,
            targetmesh=0,
            textname=picture.name,
            textw=TEXTURE_PX,
            texth=TEXTURE_PX,
            upperbound=pymeshlab.PureValue(0.2),
        )
        meshes.mesh(0).texture(0).save(str(picture))
        texture = np.asarray(Image.open(picture).convert("RGB"))
    return at, split, uv, texture


def _draco(
    vertices: Float64, faces: Int32, *, colors: UInt8 | None = None, uv: Float32 | None = None
) -> bytes:
    import DracoPy

    span = float((vertices.max(axis=0) - vertices.min(axis=0)).max())
    options: dict[str, Any] = {
        "quantization_bits": int(np.ceil(np.log2(span / GRID_M))),
        "compression_level": 10,
    }
    if colors is not None:
        options["colors"] = colors
    if uv is not None:
        options |= {"tex_coord": uv.astype(np.float64), "tex_coord_quantization_bits": UV_BITS}
    packed: bytes = DracoPy.encode(vertices.astype(np.float32), faces.astype(np.uint32), **options)
    return packed


def _webp(picture: UInt8, quality: int) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "WEBP", quality=quality, method=4)
    return stream.getvalue()


def _decoded(packed: bytes) -> UInt8:
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(packed)).convert("RGB"))
