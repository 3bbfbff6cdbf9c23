"""What a modelled room consists of, and its charts joined into one mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tourgen.geometry import Float32, Float64, Int32
from tourgen.simulation.charts import Bools, Chart, Opening, Pair, Vector, Wall


@dataclass(frozen=True, slots=True)
class PlacedOpening:
    """A hole of the room's shell, in the room's frame.

    Attributes:
        opening: Its kind and size.
        center: (3,) middle of its outer plane, metres.
        right, up, outward: (3,) unit vectors.
    """

    opening: Opening
    center: Float64
    right: Float64
    up: Float64
    outward: Float64

    @classmethod
    def of(cls, wall: Wall, opening: Opening) -> PlacedOpening:
        """The opening of a wall."""
        out = wall.outward(opening.s)
        middle = wall.point(np.array(opening.s), np.array(opening.z))
        return cls(
            opening,
            middle + out * opening.depth,
            np.array([out[1], -out[0], 0.0]),
            np.array([0.0, 0.0, 1.0]),
            out,
        )

    def leaves(self, origins: Float64, directions: Float64) -> Bools:
        """(n,) whether each ray passes its outer plane within its rim, outwards."""
        speed = (directions * self.outward).sum(axis=1)
        away = ((self.center - origins) * self.outward).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = away / speed
            at = origins + reach[:, None] * directions - self.center
        a = np.abs((at * self.right).sum(axis=1)) / (self.opening.width / 2)
        b = np.abs((at * self.up).sum(axis=1)) / (self.opening.height / 2)
        inside = np.hypot(a, b) <= 1.02 if self.opening.round else np.maximum(a, b) <= 1.01
        passes: Bools = (speed > 0) & (reach > 0) & inside
        return passes


@dataclass(frozen=True, slots=True)
class Lamp:
    """A small round light.

    Attributes:
        position: Its middle, metres.
        radius_m: Of its globe.
        power: (3,) light, 1 being a window's square metre.
    """

    position: Vector
    radius_m: float
    power: Vector


@dataclass(frozen=True, slots=True)
class RoomModel:
    """A room as it stands, and where it is scanned from.

    Attributes:
        id: Its name.
        charts: All its surfaces.
        openings: The holes of its shell.
        lamps: Its lights.
        stations: (s, 3) float64, where the scanner stands, metres.
        passer_by: Surfaces of the person that only one station sees.
        passer_by_station: That station.
        texture_size: Edge of the texture, texels.
    """

    id: str
    charts: tuple[Chart, ...]
    openings: tuple[PlacedOpening, ...]
    lamps: tuple[Lamp, ...]
    stations: Float64
    passer_by: tuple[Chart, ...]
    passer_by_station: int
    texture_size: int = 4096


@dataclass(frozen=True, slots=True)
class ChartMesh:
    """Charts joined: every chart keeps its own vertices.

    Attributes:
        vertices: (v, 3) float64, metres.
        normals: (v, 3) float64, unit, into the open.
        inner: (v, 3) float64, the vertices drawn a little inwards on their chart.
        faces: (f, 3) int32.
        first: (n + 1,) int32, first vertex of each chart.
        face_chart: (f,) int32, the chart of each face.
    """

    vertices: Float64
    normals: Float64
    inner: Float64
    faces: Int32
    first: Int32
    face_chart: Int32


def join(charts: Sequence[Chart]) -> ChartMesh:
    """One mesh of all charts."""
    first = np.zeros(len(charts) + 1, dtype=np.int32)
    first[1:] = np.cumsum([part.points.shape[0] * part.points.shape[1] for part in charts])
    faces: list[Int32] = []
    owners: list[Int32] = []
    for k, part in enumerate(charts):
        columns = part.points.shape[1]
        i, j = np.nonzero(part.cells)
        a = (i * columns + j + first[k]).astype(np.int32)
        b, c, d = a + 1, a + columns + 1, a + columns
        quad = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
        faces.append(quad.astype(np.int32))
        owners.append(np.full(len(quad), k, dtype=np.int32))
    all_faces, face_chart = np.concatenate(faces), np.concatenate(owners)
    vertices = np.concatenate([part.points.reshape(-1, 3) for part in charts])
    edge_a = vertices[all_faces[:, 1]] - vertices[all_faces[:, 0]]
    edge_b = vertices[all_faces[:, 2]] - vertices[all_faces[:, 0]]
    solid = np.linalg.norm(np.cross(edge_a, edge_b), axis=1) > 1e-12
    return ChartMesh(
        vertices=vertices,
        normals=np.concatenate([_normals(part.points).reshape(-1, 3) for part in charts]),
        inner=np.concatenate([_inner(part.points).reshape(-1, 3) for part in charts]),
        faces=np.ascontiguousarray(all_faces[solid]),
        first=first,
        face_chart=face_chart[solid],
    )


def _normals(points: Float64) -> Float64:
    normal = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    length = np.linalg.norm(normal, axis=2, keepdims=True)
    unit: Float64 = normal / np.maximum(length, 1e-12)
    return unit


def _inner(points: Float64) -> Float64:
    drawn = points.copy()
    for axis in (0, 1):
        view = np.moveaxis(drawn, axis, 0)
        low, high = view[0] + 0.15 * (view[1] - view[0]), view[-1] + 0.15 * (view[-2] - view[-1])
        view[0], view[-1] = low, high
    return drawn


def stretch(part: Chart) -> tuple[Float64, Float64, Pair]:
    """Arc length along columns and rows, scaled to [0, 1], and both lengths in metres."""
    across = np.linalg.norm(np.diff(part.points, axis=1), axis=2).max(axis=0)
    upward = np.linalg.norm(np.diff(part.points, axis=0), axis=2).max(axis=1)
    width, height = float(across.sum()), float(upward.sum())
    s = np.concatenate([[0.0], np.cumsum(across)]) / width
    t = np.concatenate([[0.0], np.cumsum(upward)]) / height
    return s, t, (width, height)


@dataclass(frozen=True, slots=True)
class TrueRoom:
    """Ground truth: a textured mesh.

    Attributes:
        mesh: Its geometry.
        uv: (v, 2) float32, (0, 0) upper left.
        texture: (h, w, 3) uint8, sRGB.
    """

    mesh: ChartMesh
    uv: Float32
    texture: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]
