"""The arrays that travel between stages.

One frame for all: right-handed, z up, metres. A float64 ``origin`` is kept apart from float32
coordinates, so that scans at coordinates of hundreds of kilometres lose nothing; a position in
the scan's own frame is ``origin + coordinate``. Only ``stages/pack`` knows that glTF is y-up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]
UInt8 = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class PointCloud:
    """Coloured points of one room.

    Attributes:
        origin: (3,) float64, metres, scan frame.
        points: (n, 3) float32, metres from ``origin``.
        colors: (n, 3) uint8, sRGB.
        station: (n,) int16, index into the room's stations of the one that measured the point,
            -1 where the scan does not say.
    """

    origin: Float64
    points: Float32
    colors: UInt8
    station: npt.NDArray[np.int16]

    def __len__(self) -> int:
        return len(self.points)

    def take(self, index: npt.NDArray[np.generic]) -> PointCloud:
        """The points that ``index`` (a mask or positions) selects."""
        return PointCloud(self.origin, self.points[index], self.colors[index], self.station[index])

    def joined(self, other: PointCloud) -> PointCloud:
        """The points, then those of another cloud of the same origin."""
        if not len(other):
            return self
        return PointCloud(
            self.origin,
            np.concatenate([self.points, other.points]),
            np.concatenate([self.colors, other.colors]),
            np.concatenate([self.station, other.station]),
        )


@dataclass(frozen=True, slots=True)
class OrientedCloud:
    """Points with unit normals that look into the free space of the room.

    Attributes:
        cloud: n points.
        normals: (n, 3) float32, unit length.
        stations: (s, 3) float64, metres from ``cloud.origin``: where the scanner stood, as given
            or as found; empty where neither was possible.
    """

    cloud: PointCloud
    normals: Float32
    stations: Float64


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles, counter-clockwise seen from the free space of the room.

    Attributes:
        origin: (3,) float64, metres, scan frame.
        vertices: (v, 3) float32, metres from ``origin``.
        faces: (f, 3) int32, indices into ``vertices``.
    """

    origin: Float64
    vertices: Float32
    faces: Int32


@dataclass(frozen=True, slots=True)
class Tile:
    """One node of a room's tile tree.

    Attributes:
        id: Path of child numbers from the root, "r", "r0", "r03".
        mesh: The faces of this tile at this level.
        geometric_error_m: How far this tile's surface may lie from the finest one; 0 at a leaf.
        children: Ids of the tiles that replace this one; empty at a leaf.
    """

    id: str
    mesh: Mesh
    geometric_error_m: float
    children: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class UvMesh:
    """A mesh whose vertices were split along chart borders and carry texture coordinates.

    Attributes:
        mesh: v vertices, f faces.
        uv: (v, 2) float32 in [0, 1]; (0, 0) is the upper left corner of the image, as in glTF.
        chart: (f,) int32, the chart that each face lies in.
        texture_size: Width and height in texels.
        texel_m: Edge of a texel on the surface, metres.
    """

    mesh: Mesh
    uv: Float32
    chart: Int32
    texture_size: tuple[int, int]
    texel_m: float


@dataclass(frozen=True, slots=True)
class TexturedMesh:
    """A mesh with its picture.

    Attributes:
        uv_mesh: Where each face lies in the picture.
        texture: (h, w, 3) uint8, sRGB, row 0 at the top.
    """

    uv_mesh: UvMesh
    texture: UInt8


@dataclass(frozen=True, slots=True)
class Panorama:
    """A spherical picture and where it was taken, whole or a part of the sphere.

    Its middle looks along the picture's x axis, y points left and z up: a pixel's centre at column
    c and row r has azimuth (w / 2 - c - 0.5) * pixel_rad[0] and elevation (h / 2 - r - 0.5) *
    pixel_rad[1].

    Attributes:
        position: (3,) float64, the lens, metres from the room's origin.
        rotation: (3, 3) float64, from the picture's axes to the room's.
        image: (h, w, 3) uint8, sRGB; black where there is no picture.
        pixel_rad: Azimuth and elevation that a pixel spans, radians.
    """

    position: Float64
    rotation: Float64
    image: UInt8
    pixel_rad: tuple[float, float]


@dataclass(frozen=True, slots=True)
class View:
    """A camera.

    Attributes:
        position: (3,) float64, the eye, metres from the room's origin.
        look_at: (3,) float64, metres from the room's origin.
    """

    position: Float64
    look_at: Float64
