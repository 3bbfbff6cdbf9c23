"""Modelling with charts: regular grids of points that carry paint coordinates and a material.

A chart is at once a piece of mesh, a rectangle of the texture atlas and a grid of light samples.
All functions return lists of charts in metres, z up; counter-clockwise faces look at the viewer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Protocol

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64

Bools = npt.NDArray[np.bool_]
Vector = tuple[float, float, float]
Pair = tuple[float, float]

CELL_M = 0.085


@dataclass(frozen=True, slots=True)
class Material:
    """What a surface looks like in even white light.

    Attributes:
        paint: ((n, 2) paint coordinates in metres, (width, height) of the chart in metres)
            -> (n, 3) linear albedo.
        glow: Light that the surface sends out, in units of the room's brightest daylight.
        mirror: Whether a scanner's beam is thrown back as by a looking glass.
        texel: Edge of its texels, as a share of the room's usual texel.
    """

    paint: Callable[[Float32, Pair], Float32]
    glow: float = 0.0
    mirror: bool = False
    texel: float = 1.0


@dataclass(frozen=True, slots=True)
class Chart:
    """A grid of points.

    Attributes:
        points: (r, c, 3) float64; columns run to the right and rows upwards, seen from the side
            that is in the open.
        paint: (r, c, 2) float64, metres, what the material is asked with.
        material: Its look.
        cells: (r-1, c-1) bool, the cells that exist; the others are holes.
    """

    points: Float64
    paint: Float64
    material: Material
    cells: Bools


class Wall(Protocol):
    """A surface with arc length ``s`` to the right, seen from inside, and height ``z``."""

    def point(self, s: Float64, z: Float64, inward: float = 0.0) -> Float64:
        """(..., 3) points at depth ``inward`` before the wall."""
        ...

    def outward(self, s: float) -> Float64:
        """(3,) unit vector out of the room."""
        ...


@dataclass(frozen=True, slots=True)
class FlatWall:
    """A plane at ``distance`` from the z axis, outward azimuth ``angle`` in radians."""

    angle: float
    distance: float

    def point(self, s: Float64, z: Float64, inward: float = 0.0) -> Float64:
        """See ``Wall.point``."""
        out = self.outward(0.0)
        right = np.array([out[1], -out[0], 0.0])
        at: Float64 = (
            (self.distance - inward) * out
            + np.asarray(s)[..., None] * right
            + np.asarray(z)[..., None] * np.array([0.0, 0.0, 1.0])
        )
        return at

    def outward(self, s: float) -> Float64:  # noqa: ARG002
        """See ``Wall.outward``."""
        return np.array([np.cos(self.angle), np.sin(self.angle), 0.0])


@dataclass(frozen=True, slots=True)
class RoundWall:
    """The inside of a cylinder about ``center``; ``s`` = 0 lies at azimuth ``angle``."""

    center: Pair
    radius: float
    angle: float

    def point(self, s: Float64, z: Float64, inward: float = 0.0) -> Float64:
        """See ``Wall.point``."""
        turn = self.angle - np.asarray(s) / self.radius
        radius = self.radius - inward
        x = self.center[0] + radius * np.cos(turn)
        y = self.center[1] + radius * np.sin(turn)
        return np.stack([x, y, np.broadcast_to(z, x.shape)], axis=-1)

    def outward(self, s: float) -> Float64:
        """See ``Wall.outward``."""
        turn = self.angle - s / self.radius
        return np.array([np.cos(turn), np.sin(turn), 0.0])


@dataclass(frozen=True, slots=True)
class Opening:
    """A hole in a wall.

    Attributes:
        kind: "door", "window" or "porthole".
        s, z: Its middle on the wall, metres.
        width, height: Metres; a porthole is as high as it is wide, and round.
        depth: Of its reveal, metres.
    """

    kind: str
    s: float
    z: float
    width: float
    height: float
    depth: float = 0.3

    @property
    def round(self) -> bool:
        """Whether it is a disc."""
        return self.kind == "porthole"

    @property
    def glazed(self) -> bool:
        """Whether a pane closes it."""
        return self.kind != "door"


def splits(stops: Sequence[float], cell_m: float = CELL_M) -> Float64:
    """Ascending values through every stop, no further apart than ``cell_m``."""
    ordered = np.unique(np.round(stops, 9))
    parts = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / cell_m - 1e-6))), endpoint=False)
        for a, b in pairwise(ordered)
    ]
    return np.concatenate([*parts, ordered[-1:]])


def chart(points: Float64, paint: Float64, material: Material, cells: Bools | None = None) -> Chart:
    """A chart with all its cells unless told otherwise."""
    rows, columns = points.shape[:2]
    full = np.ones((rows - 1, columns - 1), dtype=np.bool_)
    return Chart(points, paint, material, full if cells is None else cells)


def paint_offset(point: Float64) -> Float64:
    """(2,) a shift of the grain that differs from piece to piece and is always the same."""
    spread = float(np.round(point, 4) @ np.array([127.1, 311.7, 74.7]))
    return (
        np.array(
            [np.modf(abs(np.sin(spread)) * 437.58)[0], np.modf(abs(np.cos(spread)) * 917.3)[0]]
        )
        * 40
    )


def sheet(
    corner: Vector | Float64,
    right: Vector | Float64,
    up: Vector | Float64,
    material: Material,
    *,
    grain_up: bool = False,
    own_paint: bool = True,
    cell_m: float = CELL_M,
) -> Chart:
    """A parallelogram.

    Args:
        corner, right, up: Lower left corner and the two edges, metres.
        material: Its look.
        grain_up: Whether the paint's x axis runs up instead of to the right.
        own_paint: Whether paint starts at (0, 0) in the corner (patterns that fit the sheet)
            instead of anywhere in the material (grain).
        cell_m: Largest cell.
    """
    corner, right, up = np.asarray(corner, float), np.asarray(right, float), np.asarray(up, float)
    width, height = float(np.linalg.norm(right)), float(np.linalg.norm(up))
    s, t = splits([0, width], cell_m) / width, splits([0, height], cell_m) / height
    points = corner + s[None, :, None] * right + t[:, None, None] * up
    a, b = np.broadcast_arrays(s[None] * width, t[:, None] * height)
    paint = np.stack([b, a] if grain_up else [a, b], axis=-1)
    return chart(points, paint if own_paint else paint + paint_offset(corner), material)


def box(
    low: Vector,
    high: Vector,
    material: Material,
    *,
    grain: int = 0,
    without: str = "",
    cell_m: float = CELL_M,
) -> list[Chart]:
    """A box whose faces look outwards.

    Args:
        low, high: Corners.
        material: Its look.
        grain: Axis along which the grain runs.
        without: Faces left out, of "+x -x +y -y +z -z".
        cell_m: Largest cell.
    """
    (x0, y0, z0), (x1, y1, z1) = low, high
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    faces: dict[str, tuple[Vector, Vector, Vector, int, int]] = {
        "+x": ((x1, y0, z0), (0, dy, 0), (0, 0, dz), 1, 2),
        "-x": ((x0, y1, z0), (0, -dy, 0), (0, 0, dz), 1, 2),
        "+y": ((x1, y1, z0), (-dx, 0, 0), (0, 0, dz), 0, 2),
        "-y": ((x0, y0, z0), (dx, 0, 0), (0, 0, dz), 0, 2),
        "+z": ((x0, y0, z1), (dx, 0, 0), (0, dy, 0), 0, 1),
        "-z": ((x0, y1, z0), (dx, 0, 0), (0, -dy, 0), 0, 1),
    }
    return [
        sheet(
            corner, right, up, material, grain_up=grain == up_axis, own_paint=False, cell_m=cell_m
        )
        for name, (corner, right, up, _, up_axis) in faces.items()
        if name not in without
    ]


def revolve(
    profile: Sequence[Pair],
    at: Vector,
    material: Material,
    *,
    segments: int = 24,
    cell_m: float = CELL_M,
) -> list[Chart]:
    """A turned piece: the profile of (radius, height), bottom to top, about a vertical axis."""
    corners = np.asarray(profile, float)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    along = splits(list(length), cell_m)
    radius = np.maximum(np.interp(along, length, corners[:, 0]), 1e-3)
    height = np.interp(along, length, corners[:, 1])
    turn = np.linspace(0, 2 * np.pi, segments + 1)
    points = np.stack(
        [
            at[0] + radius[:, None] * np.cos(turn),
            at[1] + radius[:, None] * np.sin(turn),
            np.broadcast_to(at[2] + height[:, None], (len(along), segments + 1)),
        ],
        axis=-1,
    )
    widest = float(radius.max())
    a, b = np.broadcast_arrays(turn[None] * widest, along[:, None])
    return [chart(points, np.stack([b, a], axis=-1) + paint_offset(points[0, 0]), material)]


def tube(path: Float64, radius_m: float, material: Material, *, segments: int = 8) -> list[Chart]:
    """A round bar with flat ends along an (n, 3) path."""
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent, [0.0, 0.0, 1.0])
    flat = np.linalg.norm(side, axis=1) < 1e-6
    side[flat] = [1.0, 0.0, 0.0]
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    top = np.cross(side, tangent)
    turn = np.linspace(0, 2 * np.pi, segments + 1)
    ring = np.cos(turn)[:, None, None] * side + np.sin(turn)[:, None, None] * top
    body = path + radius_m * ring
    first, last = path[:1] + 1e-5 * ring[:, :1], path[-1:] + 1e-5 * ring[:, -1:]
    points = np.concatenate([first, body, last], axis=1)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    length = np.cumsum(np.concatenate([[0.0, radius_m], steps, [radius_m]]))
    a, b = np.broadcast_arrays(length[None], turn[:, None] * radius_m)
    return [chart(points, np.stack([a, b], axis=-1) + paint_offset(path[0]), material)]


def rod(
    start: Vector, end: Vector, radius_m: float, material: Material, *, segments: int = 8
) -> list[Chart]:
    """A straight round bar."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    steps = splits([0, float(np.linalg.norm(b - a))]) / float(np.linalg.norm(b - a))
    return tube(a + steps[:, None] * (b - a), radius_m, material, segments=segments)


def raised_panel(
    low: Pair,
    high: Pair,
    material: Material,
    edge: Material,
    *,
    proud_m: float = 0.014,
    bevel_m: float = 0.028,
) -> list[Chart]:
    """A bevelled panel on the wall plane y = 0, seen from -y: ``low`` and ``high`` in (x, z)."""
    (x0, z0), (x1, z1) = low, high
    outer = np.array([[x0, 0, z0], [x1, 0, z0], [x1, 0, z1], [x0, 0, z1]], float)
    inner = outer + np.array([[1, 0, 1], [-1, 0, 1], [-1, 0, -1], [1, 0, -1]]) * bevel_m
    inner[:, 1] = -proud_m
    charts = [sheet(inner[0], inner[1] - inner[0], inner[3] - inner[0], material)]
    for k in range(4):
        a, b = outer[k], outer[(k + 1) % 4]
        c, d = inner[k], inner[(k + 1) % 4]
        steps = splits([0, float(np.linalg.norm(b - a))]) / float(np.linalg.norm(b - a))
        points = np.stack([a + steps[:, None] * (b - a), c + steps[:, None] * (d - c)])
        length = np.broadcast_to(steps * np.linalg.norm(b - a), points.shape[:2])
        paint = np.stack([length, np.array([[0.0], [bevel_m]]) + 0 * length], axis=-1)
        charts.append(chart(points, paint + paint_offset(a), edge))
    return charts


def place(charts: Sequence[Chart], yaw: float = 0.0, at: Vector = (0.0, 0.0, 0.0)) -> list[Chart]:
    """The charts turned about z by ``yaw`` radians, then moved."""
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return [
        replace(
            part,
            points=np.stack([(part.points * turn[:, k]).sum(axis=-1) for k in range(3)], axis=-1)
            + np.asarray(at),
        )
        for part in charts
    ]


def on_wall(charts: Sequence[Chart], wall: FlatWall, s: float = 0.0) -> list[Chart]:
    """Charts made in a wall's frame (x right, -y into the room, z up), set on that wall."""
    x, y, _ = wall.point(np.array(s), np.array(0.0))
    return place(charts, wall.angle - np.pi / 2, (float(x), float(y), 0.0))


def wall_surface(
    wall: Wall,
    span: Pair,
    rise: Pair,
    material: Material,
    openings: Sequence[Opening] = (),
    *,
    grain_up: bool = True,
) -> list[Chart]:
    """The bare wall with holes where the openings are; a round one is edged by a ring."""
    s_stops, z_stops = list(span), list(rise)
    frames = [(_frame(opening), opening) for opening in openings]
    for (a, b, c, d), _ in frames:
        s_stops += [a, b]
        z_stops += [c, d]
    s, z = splits(s_stops), splits(z_stops)
    grid_s, grid_z = np.meshgrid(s, z)
    middle_s, middle_z = np.meshgrid((s[1:] + s[:-1]) / 2, (z[1:] + z[:-1]) / 2)
    cells = np.ones(middle_s.shape, dtype=np.bool_)
    charts: list[Chart] = []
    for (a, b, c, d), opening in frames:
        cells &= ~((middle_s > a) & (middle_s < b) & (middle_z > c) & (middle_z < d))
        if opening.round:
            charts.append(_ring(wall, opening, material, grain_up=grain_up))
    paint = np.stack([grid_z, grid_s] if grain_up else [grid_s, grid_z], axis=-1)
    return [chart(wall.point(grid_s, grid_z), paint, material, cells), *charts]


def _frame(opening: Opening) -> tuple[float, float, float, float]:
    """The square or rectangle cut from the wall's grid."""
    grow = 1.35 if opening.round else 1.0
    w, h = opening.width * grow / 2, opening.height * grow / 2
    return opening.s - w, opening.s + w, opening.z - h, opening.z + h


def _ring(wall: Wall, opening: Opening, material: Material, *, grain_up: bool) -> Chart:
    turn = np.linspace(0, 2 * np.pi, 41)
    direction = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    square = direction / np.abs(direction).max(axis=1, keepdims=True)
    radius = opening.width / 2
    # The outermost row slips behind the wall, whose edge along an arc is divided otherwise.
    runs = [(square * 1.39, -0.003), (square * 1.34, 0.0), (square * 0.6 + direction * 0.55, 0.0)]
    runs.append((direction, 0.0))
    rows = [
        (radius * flat[:, 0] + opening.s, radius * flat[:, 1] + opening.z, inward)
        for flat, inward in runs
    ]
    points = np.stack([wall.point(s, z, inward) for s, z, inward in rows])
    paint = np.stack([np.stack([z, s] if grain_up else [s, z], axis=-1) for s, z, _ in rows])
    return chart(points, paint, material)


def reveal(wall: Wall, opening: Opening, material: Material, sill: Material) -> list[Chart]:
    """The sides of an opening, from the wall's face outwards to a plane; ``sill`` lies below."""
    out = wall.outward(opening.s)
    middle = wall.point(np.array(opening.s), np.array(opening.z))
    charts: list[Chart] = []
    for k, contour in enumerate(_contour(opening)):
        near = wall.point(contour[:, 0], contour[:, 1])
        reach = opening.depth - ((near - middle) * out).sum(axis=1)
        steps = splits([0.0, 1.0], CELL_M / opening.depth)
        points = near + steps[:, None, None] * reach[None, :, None] * out
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(near, axis=0), axis=1))])
        a, b = np.broadcast_arrays(along[None], steps[:, None] * opening.depth)
        look = sill if k == 0 and not opening.round else material
        charts.append(chart(points, np.stack([a, b], axis=-1) + paint_offset(near[0]), look))
    return charts


def _contour(opening: Opening) -> list[Float64]:
    """Counter-clockwise runs of (s, z), seen from inside; the lower edge first."""
    if opening.round:
        turn = np.linspace(0, 2 * np.pi, 41)
        return [
            np.stack([np.cos(turn), np.sin(turn)], axis=-1) * opening.width / 2
            + np.array([opening.s, opening.z])
        ]
    w, h = opening.width / 2, opening.height / 2
    corners = np.array([[-w, -h], [w, -h], [w, h], [-w, h], [-w, -h]])
    corners += np.array([opening.s, opening.z])
    runs: list[Float64] = []
    for a, b in pairwise(corners):
        length = float(np.linalg.norm(b - a))
        steps = splits([0, length]) / length
        runs.append(a + steps[:, None] * (b - a))
    return runs


def moulding(
    wall: Wall,
    span: Pair,
    profile: Sequence[Pair],
    material: Material,
    *,
    gaps: Sequence[Pair] = (),
) -> list[Chart]:
    """A profile of (inward, height), bottom to top, run along a wall.

    At the corners of a room neighbouring runs pass through each other, which is a mitre.

    Args:
        wall: What it runs along.
        span: From and to, arc length.
        profile: Its section.
        material: Its look.
        gaps: Stretches left out, for openings.
    """
    stops = [*span, *(edge for gap in gaps for edge in gap)]
    s = splits(stops)
    middle = (s[1:] + s[:-1]) / 2
    keep = np.ones(len(middle), dtype=np.bool_)
    for a, b in gaps:
        keep &= ~((middle > a) & (middle < b))
    rows = [wall.point(s, np.full_like(s, z), inward) for inward, z in profile]
    section = np.asarray(profile, float)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(section, axis=0), axis=1))])
    paint = np.stack(np.broadcast_arrays(s[None], length[:, None]), axis=-1)
    points = np.stack(rows)
    cells = np.broadcast_to(keep, (len(profile) - 1, len(keep))).copy()
    return [chart(points, paint + paint_offset(points[0, 0]), material, cells)]


def slab(
    left: Callable[[Float64], Float64],
    right: Callable[[Float64], Float64],
    span: Pair,
    z: float,
    material: Material,
    *,
    faces_up: bool,
) -> list[Chart]:
    """A level surface between two curves x(y): a floor, or a ceiling with ``faces_up`` false."""
    y = splits(list(span))
    x0, x1 = left(y), right(y)
    columns = max(2, int(np.ceil(float((x1 - x0).max()) / CELL_M)))
    share = np.linspace(0, 1, columns + 1)
    x = x0[:, None] + share * (x1 - x0)[:, None]
    points = np.stack(np.broadcast_arrays(x, y[:, None], np.array(z)), axis=-1)
    if not faces_up:
        points = points[:, ::-1]
    return [chart(points, points[..., :2].copy(), material)]
