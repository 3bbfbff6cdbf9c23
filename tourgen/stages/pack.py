"""Pack: one tile as a binary glTF with Draco geometry and a WebP picture.

All tiles of a room are quantised on one grid, so that vertices which two tiles share decode to
the same bits and no pinhole shows along the seam. The grid's step is a power of two (2^-12 m,
0.244 mm) and its origin a multiple of it: every position of the grid is then a float32 without
rounding, up to 4 km of room, and a decoder is off by the last bit at most.

glTF is y-up: (x, y, z) of the room is (x, z, -y) here, and nowhere else.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tourgen import __version__
from tourgen.errors import StageError
from tourgen.stages.mesh_arrays import STEP_M

if TYPE_CHECKING:
    from tourgen.geometry import Float32, Float64, Int32, TexturedMesh, UInt8, UvMesh

VERSION = 4

_MOST_BITS = 24  # a float32 holds no more
_TEXELS_OF_STEP = 0.25
_UNSIGNED_BYTE, _UNSIGNED_INT, _FLOAT = 5121, 5125, 5126
_INFERRED = "_INFERRED"
_LINEAR, _LINEAR_MIPMAP_LINEAR, _CLAMP_TO_EDGE = 9729, 9987, 33071


@dataclass(frozen=True, slots=True)
class Grid:
    """The grid that all tiles of a room are quantised on.

    Attributes:
        origin: Its least corner: x, y, z in metres, room frame, multiples of ``STEP_M``.
        bits: There are 2^bits positions along each axis.
    """

    origin: tuple[float, float, float]
    bits: int

    @property
    def range_m(self) -> float:
        """Edge of the cube that the grid fills."""
        return ((1 << self.bits) - 1) * STEP_M


@dataclass(frozen=True, slots=True)
class Settings:
    """How a tile is written.

    Attributes:
        grid: Of the tile's room.
        quality: Of the picture, 1 to 100.
        webp_method: 0 (fast) to 6 (small).
        draco_level: 0 (fast) to 10 (small).
    """

    grid: Grid
    quality: int = 80
    webp_method: int = 6
    draco_level: int = 10


def grid(vertices: Float32) -> Grid:
    """The grid that holds all vertices of a room.

    Args:
        vertices: (v, 3) metres, of all tiles of all levels.

    Raises:
        StageError: Where the room is larger than 4 km.
    """
    low, high = vertices.min(0).astype(np.float64), vertices.max(0).astype(np.float64)
    origin = np.floor(low / STEP_M) * STEP_M
    steps = int(np.ceil((high - origin).max() / STEP_M)) + 1
    bits = steps.bit_length()
    if bits > _MOST_BITS:
        raise StageError(
            f"pack: expected a room of at most {2**_MOST_BITS * STEP_M:.0f} m, "
            f"found {steps * STEP_M:.0f} m",
            "crop strays with `keep`, or check the unit of the scan",
        )
    return Grid((float(origin[0]), float(origin[1]), float(origin[2])), bits)


def pack(textured: TexturedMesh, inferred: UInt8, settings: Settings) -> bytes:
    """A tile as the bytes of a .glb file.

    Args:
        textured: The tile.
        inferred: (v,) 255 for its vertices that are a guess, 0 for those that were measured; in
            the file the attribute ``_INFERRED``, from 0 to 1.
        settings: See there.

    Returns:
        glTF 2.0 with KHR_draco_mesh_compression, KHR_materials_unlit and EXT_texture_webp.

    Raises:
        StageError: Where a vertex lies off the grid, or all faces are smaller than its step.
    """
    mesh = textured.uv_mesh.mesh
    low = np.array(settings.grid.origin)
    if (mesh.vertices < low).any() or (mesh.vertices > low + settings.grid.range_m).any():
        raise StageError(
            f"pack: expected vertices within {settings.grid.range_m:.3f} m of {low.tolist()}, "
            f"found {mesh.vertices.min(0).tolist()} to {mesh.vertices.max(0).tolist()}"
        )
    positions = np.rint(mesh.vertices.astype(np.float64) / STEP_M) * STEP_M
    faces = _with_area(positions, mesh.faces)
    if not len(faces):
        raise StageError("pack: expected a face larger than 0.25 mm, found none")
    geometry = _draco(positions.astype(np.float32), faces, textured.uv_mesh, inferred, settings)
    return _glb(geometry, _webp(textured.texture, settings))


def _with_area(positions: Float64, faces: Int32) -> Int32:
    """The faces whose three corners are three places of the grid."""
    corners = positions[faces]
    apart = (corners != np.roll(corners, 1, axis=1)).any(2).all(1)
    return np.ascontiguousarray(faces[apart])


@dataclass(frozen=True, slots=True)
class _Geometry:
    """What the accessors say of a Draco buffer."""

    data: bytes
    attributes: dict[str, int]  # name in glTF: Draco's unique id
    indices: int
    vertices: int
    low: list[float]
    high: list[float]


def _draco(
    positions: Float32, faces: Int32, uv_mesh: UvMesh, inferred: UInt8, settings: Settings
) -> _Geometry:
    import DracoPy

    grid = settings.grid
    x, y, z = grid.origin
    texels = max(uv_mesh.texture_size)
    used, renumbered = np.unique(faces, return_inverse=True)
    data = DracoPy.encode(
        _y_up(positions[used]),
        renumbered.reshape(-1, 3).astype(np.uint32),
        quantization_bits=grid.bits,
        compression_level=settings.draco_level,
        quantization_range=grid.range_m,
        quantization_origin=np.array([x, z, -(y + grid.range_m)], np.float32),
        tex_coord=uv_mesh.uv[used].astype(np.float64),  # DracoPy takes no other
        tex_coord_quantization_bits=int(np.ceil(np.log2(texels / _TEXELS_OF_STEP))),
        generic_attributes={_INFERRED: inferred[used][:, None]},
    )
    decoded = DracoPy.decode(data)
    ids = {one["attribute_type"]: one["unique_id"] for one in decoded.attributes}
    return _Geometry(
        data,
        {
            "POSITION": ids[DracoPy.AttributeType.POSITION],
            "TEXCOORD_0": ids[DracoPy.AttributeType.TEX_COORD],
            _INFERRED: ids[DracoPy.AttributeType.GENERIC],
        },
        decoded.faces.size,
        len(decoded.points),
        decoded.points.min(0).tolist(),
        decoded.points.max(0).tolist(),
    )


def _y_up(positions: Float32) -> Float32:
    return np.stack([positions[:, 0], positions[:, 2], -positions[:, 1]], axis=1)


def _webp(texture: UInt8, settings: Settings) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(texture).save(
        out, "WEBP", quality=settings.quality, method=settings.webp_method
    )
    return out.getvalue()


def _glb(geometry: _Geometry, webp: bytes) -> bytes:
    import pygltflib as gltf

    draco, unlit, picture = "KHR_draco_mesh_compression", "KHR_materials_unlit", "EXT_texture_webp"
    binary = _padded(geometry.data) + _padded(webp)

    # What is None is left out, where glTF takes for granted what pygltflib would write: words weigh
    # on a small tile. An accessor's offset is an error where it has no buffer view.
    def accessor(kind: str, component: int, count: int, **more: Any) -> gltf.Accessor:
        usual: dict[str, Any] = {"byteOffset": None, "normalized": None}
        told = {"componentType": component, "count": count, "type": kind, **more}
        return gltf.Accessor(**(usual | told))

    document = gltf.GLTF2(
        asset=gltf.Asset(generator=f"tourgen {__version__}"),
        extensionsUsed=[draco, unlit, picture],
        extensionsRequired=[draco, picture],
        scene=0,
        scenes=[gltf.Scene(nodes=[0])],
        nodes=[gltf.Node(mesh=0)],
        meshes=[
            gltf.Mesh(
                primitives=[
                    gltf.Primitive(
                        attributes=gltf.Attributes(POSITION=1, TEXCOORD_0=2, **{_INFERRED: 3}),
                        indices=0,
                        material=0,
                        mode=None,
                        extensions={draco: {"bufferView": 0, "attributes": geometry.attributes}},
                    )
                ]
            )
        ],
        materials=[
            gltf.Material(
                pbrMetallicRoughness=gltf.PbrMetallicRoughness(
                    baseColorFactor=None,
                    baseColorTexture=gltf.TextureInfo(index=0, texCoord=None),
                    metallicFactor=0.0,
                    roughnessFactor=None,
                ),
                emissiveFactor=None,
                alphaMode=None,
                alphaCutoff=None,
                doubleSided=True,  # simplification folds some faces over; culled, they are holes
                extensions={unlit: {}},
            )
        ],
        textures=[gltf.Texture(sampler=0, extensions={picture: {"source": 0}})],
        images=[gltf.Image(bufferView=1, mimeType="image/webp")],
        samplers=[
            gltf.Sampler(
                magFilter=_LINEAR,
                minFilter=_LINEAR_MIPMAP_LINEAR,
                wrapS=_CLAMP_TO_EDGE,
                wrapT=_CLAMP_TO_EDGE,
            )
        ],
        accessors=[
            accessor("SCALAR", _UNSIGNED_INT, geometry.indices),
            accessor("VEC3", _FLOAT, geometry.vertices, min=geometry.low, max=geometry.high),
            accessor("VEC2", _FLOAT, geometry.vertices),
            accessor("SCALAR", _UNSIGNED_BYTE, geometry.vertices, normalized=True),
        ],
        bufferViews=[
            gltf.BufferView(buffer=0, byteOffset=None, byteLength=len(geometry.data)),
            gltf.BufferView(buffer=0, byteOffset=len(_padded(geometry.data)), byteLength=len(webp)),
        ],
        buffers=[gltf.Buffer(byteLength=len(binary))],
    )
    document.set_binary_blob(binary)
    return b"".join(document.save_to_bytes())


def _padded(data: bytes) -> bytes:
    """To the multiple of four that glTF's binary chunk asks for."""
    return data + b"\0" * (-len(data) % 4)
