"""The two octagonal chambers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tourgen.geometry import Float64
from tourgen.simulation import furniture as piece
from tourgen.simulation import materials as look
from tourgen.simulation.charts import (
    Chart,
    FlatWall,
    Material,
    Opening,
    Pair,
    RoundWall,
    Wall,
    box,
    moulding,
    on_wall,
    place,
    raised_panel,
    reveal,
    revolve,
    sheet,
    slab,
    wall_surface,
)
from tourgen.simulation.model import Lamp, PlacedOpening, RoomModel

EIGHTH = np.pi / 4
Curve = Callable[[Float64], Float64]
DOOR = Opening("door", 0.0, 1.0, 0.85, 2.0)
WINDOW = Opening("window", 0.0, 1.67, 0.90, 1.20)
CORNICE: tuple[Pair, ...] = (
    (0.0, -0.28),
    (0.02, -0.28),
    (0.02, -0.24),
    (0.04, -0.22),
    (0.045, -0.16),
    (0.10, -0.10),
    (0.13, -0.085),
    (0.13, -0.04),
    (0.16, -0.03),
    (0.16, 0.0),
)
SKIRTING: tuple[Pair, ...] = ((0.022, 0.0), (0.022, 0.11), (0.012, 0.13), (0.0, 0.135))
DADO: tuple[Pair, ...] = (
    (0.0, 0.93),
    (0.018, 0.94),
    (0.018, 0.965),
    (0.035, 0.975),
    (0.035, 0.995),
    (0.0, 1.005),
)


def porthole(s: float, z: float, diameter: float = 0.46) -> Opening:
    """A round window in a wall."""
    return Opening("porthole", s, z, diameter, diameter)


@dataclass(frozen=True, slots=True)
class Looks:
    """Materials of a chamber."""

    ground: Material
    upper: Material
    lower: Material
    trim: Material
    reveal: Material
    sill: Material


def panels(half: float, openings: Sequence[Opening], looks: Looks) -> list[Chart]:
    """Raised panels in two tiers beside and below the openings, in the wall's frame."""
    wide = any(not opening.round for opening in openings)
    columns = (
        [(-half + 0.09, -0.61), (0.61, half - 0.09)]
        if wide
        else [(-half + 0.09, -0.40), (-0.33, 0.33), (0.40, half - 0.09)]
    )
    door = any(opening.kind == "door" for opening in openings)
    tiers = [
        (0.20, 0.86, looks.lower, columns if door or not wide else [*columns, (-0.53, 0.53)]),
        (1.08, 2.50, looks.upper, columns),
    ]
    charts: list[Chart] = []
    for low, high, field, spans in tiers:
        for left, right in spans:
            pierced = any(o.round and left < o.s < right and low < o.z < high for o in openings)
            if not pierced:
                charts += raised_panel((left, low), (right, high), field, looks.trim)
    if door:
        charts += raised_panel((-0.53, 2.19), (0.53, 2.50), looks.lower, looks.trim)
    return charts


def casing(opening: Opening, trim: Material) -> list[Chart]:
    """The frame round an opening, in the wall's frame."""
    w, low, high = opening.width / 2, opening.z - opening.height / 2, opening.z + opening.height / 2
    if opening.round:
        brass = look.plain(look.BRASS, 0.15)
        ring = revolve(
            [
                (w + 0.06, -0.04),
                (w + 0.05, 0.03),
                (w + 0.015, 0.042),
                (w - 0.005, 0.03),
                (w - 0.005, -0.02),
            ],
            (0, 0, 0),
            brass,
            segments=40,
        )
        turned = _tipped(ring)
        bolts: list[Chart] = []
        for k in range(8):
            turn = k * EIGHTH + 0.39
            bolts += piece.ellipsoid(
                (float((w + 0.035) * np.cos(turn)), -0.038, float((w + 0.035) * np.sin(turn))),
                (0.01, 0.008, 0.01),
                brass,
                8,
            )
        return place([*turned, *bolts], at=(opening.s, 0, opening.z))
    frame = 0.09
    bottom = 0.0 if opening.kind == "door" else low
    charts = box((-w - frame, -0.035, bottom), (-w, 0, high + frame), trim, grain=2, without="+y")
    charts += box((w, -0.035, bottom), (w + frame, 0, high + frame), trim, grain=2, without="+y")
    charts += box((-w, -0.035, high), (w, 0, high + frame), trim, without="+y -x +x")
    charts += box(
        (-w - frame - 0.03, -0.05, high + frame),
        (w + frame + 0.03, 0, high + frame + 0.03),
        trim,
        without="+y",
    )
    if opening.kind == "window":
        charts += box(
            (-w - frame - 0.03, -0.08, low - 0.05), (w + frame + 0.03, 0, low), trim, without="+y"
        )
        charts += glazing(opening, trim)
    return place(charts, at=(opening.s, 0, 0))


def glazing(opening: Opening, trim: Material) -> list[Chart]:
    """The bars of a window, half way into its reveal."""
    w, low, high = opening.width / 2, opening.z - opening.height / 2, opening.z + opening.height / 2
    y0, y1 = 0.17, 0.20
    charts: list[Chart] = []
    for x, half in ((-w + 0.02, 0.02), (0.0, 0.015), (w - 0.02, 0.02)):
        charts += box((x - half, y0, low), (x + half, y1, high), trim, grain=2, without="-z +z")
    for z, half in (
        (low + 0.02, 0.02),
        (low + 0.4, 0.012),
        (high - 0.4, 0.012),
        (high - 0.02, 0.02),
    ):
        charts += box((-w, y0 + 0.002, z - half), (w, y1 - 0.002, z + half), trim, without="-x +x")
    return charts


def ring_on(wall: RoundWall, opening: Opening, trim: Material) -> list[Chart]:
    """The frame of a porthole, flat against a round wall."""
    out = wall.outward(opening.s)
    x, y, _ = wall.point(np.array(opening.s), np.array(0.0))
    ring = place(casing(opening, trim), at=(-opening.s, 0.0, 0.0))
    return place(ring, float(np.arctan2(out[1], out[0])) - np.pi / 2, (float(x), float(y), 0.0))


def _tipped(charts: Sequence[Chart]) -> list[Chart]:
    """Turned pieces laid on their side: their axis, up, becomes -y."""
    return [
        replace(
            part,
            points=np.stack(
                [part.points[..., 0], -part.points[..., 2], part.points[..., 1]], axis=-1
            ),
        )
        for part in charts
    ]


def flat_side(
    wall: FlatWall, half: float, height: float, openings: Sequence[Opening], looks: Looks
) -> list[Chart]:
    """A panelled wall with its mouldings and openings."""
    charts = wall_surface(wall, (-half, half), (0.0, height), looks.ground, openings)
    charts += on_wall(panels(half, openings, looks), wall)
    charts += mouldings(wall, half, height, openings, looks)
    for opening in openings:
        charts += reveal(wall, opening, looks.reveal, looks.sill)
        charts += on_wall(casing(opening, looks.trim), wall)
    return charts


def mouldings(
    wall: Wall, half: float, height: float, openings: Sequence[Opening], looks: Looks
) -> list[Chart]:
    """Skirting, dado and cornice along a wall, broken by doors."""
    doors = [
        (o.s - o.width / 2 - 0.05, o.s + o.width / 2 + 0.05) for o in openings if o.kind == "door"
    ]
    cornice = [(inward, height + z) for inward, z in CORNICE]
    charts = moulding(wall, (-half, half), SKIRTING, looks.trim, gaps=doors)
    charts += moulding(wall, (-half, half), DADO, looks.trim, gaps=doors)
    return charts + moulding(wall, (-half, half), cornice, looks.trim)


def ceiling_ribs(apothem: float, height: float, trim: Material) -> list[Chart]:
    """Eight ribs from the corners to a turned boss."""
    charts: list[Chart] = []
    reach = apothem / np.cos(np.pi / 8)
    for k in range(8):
        rib = box(
            (0.0, -0.05, height - 0.09), (reach, 0.05, height + 0.01), trim, without="-x +x +z"
        )
        charts += place(rib, (k + 0.5) * EIGHTH)
    charts += revolve(
        [
            (0.001, -0.15),
            (0.06, -0.145),
            (0.1, -0.12),
            (0.22, -0.11),
            (0.24, -0.09),
            (0.3, -0.085),
            (0.3, 0.0),
        ],
        (0, 0, height),
        trim,
        segments=40,
    )
    return charts


def bounds(apothem: float, bulge: RoundWall | None) -> tuple[Curve, Curve]:
    """Left and right edge x(y) of an octagon with a bulge to the west, a little oversized."""
    grown = apothem + 0.03

    def right(y: Float64) -> Float64:
        edge: Float64 = np.minimum(grown, grown * np.sqrt(2) - np.abs(y))
        return edge

    def left(y: Float64) -> Float64:
        edge = -right(y)
        if bulge is None:
            return edge
        arc = bulge.center[0] - np.sqrt(np.maximum((bulge.radius + 0.03) ** 2 - y * y, 0))
        return np.minimum(edge, np.where(np.abs(y) < apothem * np.tan(np.pi / 8), arc, edge))

    return left, right


def octagon(
    apothem: float,
    height: float,
    openings: Mapping[int, tuple[Opening, ...]],
    looks: Looks,
    floor: Material,
    ceiling: Material,
    bulge: RoundWall | None,
) -> tuple[list[Chart], list[PlacedOpening]]:
    """Floor, ceiling, walls; wall ``k`` lies at azimuth k * 45 degrees, a bulge replaces wall 4."""
    half = apothem * float(np.tan(np.pi / 8))
    left, right = bounds(apothem, bulge)
    span = (-apothem - 0.02, apothem + 0.02)
    charts = slab(left, right, span, 0.0, floor, faces_up=True)
    charts += slab(left, right, span, height, ceiling, faces_up=False)
    placed: list[PlacedOpening] = []
    for k in range(8):
        wall: Wall = FlatWall(k * EIGHTH, apothem)
        if not (k == 4 and bulge is not None):
            charts += flat_side(
                FlatWall(k * EIGHTH, apothem), half, height, openings.get(k, ()), looks
            )
        else:
            wall = bulge
        placed += [PlacedOpening.of(wall, opening) for opening in openings.get(k, ())]
    return charts, placed


def chamber1() -> RoomModel:
    """Oak and marquetry: box bed, stove before a tiled round wall, long table, compass floor."""
    apothem, height = 2.85, 2.9
    half = apothem * float(np.tan(np.pi / 8))
    oak, dark, brass = look.wood(look.OAK), look.wood(look.DARK_OAK), look.plain(look.BRASS, 0.2)
    plaster = look.plain((222, 210, 186), 0.06)
    looks = Looks(
        look.wood((158, 108, 62)),
        look.marquetry(),
        look.marquetry(look.DARK_OAK, look.MAPLE, look.OAK, "star"),
        dark,
        oak,
        oak,
    )
    sagitta = 0.30
    radius = (half**2 + sagitta**2) / (2 * sagitta)
    bulge = RoundWall((-apothem - sagitta + radius, 0.0), radius, np.pi)
    arc = radius * float(np.arcsin(half / radius))
    openings = {
        0: (WINDOW,),
        1: (DOOR,),
        3: (),
        4: (porthole(0.62, 1.72, 0.42),),
        5: (DOOR,),
        7: (porthole(-0.745, 1.72),),
    }
    charts, placed = octagon(
        apothem, height, openings, looks, look.compass_floor(apothem, 1.95), plaster, bulge
    )
    charts += round_side(bulge, arc, height, openings[4], looks, plaster)
    charts += ceiling_ribs(apothem, height, dark)

    def wall(k: int) -> FlatWall:
        return FlatWall(k * EIGHTH, apothem)

    bed = piece.box_bed(
        oak,
        look.marquetry(look.MAHOGANY, look.MAPLE, look.DARK_OAK, "star"),
        look.cloth((150, 48, 44), (220, 190, 130), 0.2),
    )
    charts += on_wall(bed, wall(2))
    charts += on_wall(piece.cupboard(dark, look.marquetry(look.OAK), brass), wall(3))
    charts += on_wall(
        piece.chest(look.wood(look.MAHOGANY), look.wood((150, 84, 50)), brass), wall(6)
    )
    charts += on_wall(piece.mirror(0.56, 1.18, 2.0), wall(6))
    text = look.plaque(
        "AR STEREN",
        (
            "Lighthouse of the first order",
            "Built 1907 - 1916 on the rock of Men Tensel",
            "The lamp is lit at dusk and put out at dawn by the keeper of the watch",
        ),
        (40, 20, 10),
    )
    charts += on_wall(piece.plaque(text, 1.62), wall(7), 0.745)
    charts += piece.table(dark, look.planks(look.DARK_OAK, 0.18, 4.0), (0.98, 1.98))
    charts += place(piece.log_book(), 1.3, (0.1, 0.45, 0.76)) + place(
        piece.candlestick(), 0, (-0.1, -0.35, 0.76)
    )
    charts += place(piece.mug(), 0.6, (0.25, -0.6, 0.76)) + place(_books(), 0.4, (-0.2, 0.75, 0.76))
    for x, y in ((0.05, 1.28), (-0.95, 0.35), (0.92, -0.55)):
        charts += place(piece.stool(oak, look.plain((120, 52, 40), 0.15)), x, (x, y, 0))
    charts += place(piece.stove(height), 0, (-2.62, 0.0, 0.0))
    charts += piece.hanging_lamp(height - 0.14, 2.02)
    return RoomModel(
        id="chamber1",
        charts=tuple(charts),
        openings=tuple(placed),
        lamps=(Lamp((0, 0, 2.02), 0.1, (0.9, 0.68, 0.42)),),
        stations=np.array([[-1.55, -1.0, 1.52], [-1.5, 1.05, 1.49], [1.56, 0.02, 1.50]]),
        passer_by=tuple(
            place(
                piece.person(look.cloth((70, 84, 112)), look.cloth((60, 56, 54))),
                -0.9,
                (0.35, -1.75, 0.0),
            )
        ),
        passer_by_station=0,
    )


def _books() -> list[Chart]:
    charts = box((-0.12, -0.09, 0), (0.12, 0.09, 0.04), look.plain((44, 66, 58), 0.2), without="-z")
    charts += place(
        box(
            (-0.11, -0.08, 0.04), (0.11, 0.08, 0.075), look.plain((122, 44, 36), 0.2), without="-z"
        ),
        0.3,
    )
    return charts


def round_side(
    bulge: RoundWall,
    arc: float,
    height: float,
    openings: Sequence[Opening],
    looks: Looks,
    plaster: Material,
) -> list[Chart]:
    """The curved wall: painted tiles below, plaster above, with the room's mouldings."""
    tiled = look.tiles([(226, 226, 216)], 0.12, ornament=True)
    charts = wall_surface(bulge, (-arc, arc), (0.0, 1.32), tiled, grain_up=False)
    charts += wall_surface(bulge, (-arc, arc), (1.32, height), plaster, openings, grain_up=False)
    charts += moulding(
        bulge, (-arc, arc), [(0.0, 1.30), (0.03, 1.31), (0.03, 1.345), (0.0, 1.355)], looks.trim
    )
    cornice = [(inward, height + z) for inward, z in CORNICE]
    charts += moulding(bulge, (-arc, arc), SKIRTING, looks.trim) + moulding(
        bulge, (-arc, arc), cornice, looks.trim
    )
    for opening in openings:
        charts += reveal(bulge, opening, plaster, plaster)
        charts += ring_on(bulge, opening, looks.trim)
    return charts


def chamber2() -> RoomModel:
    """Painted panels over checkered tiles: round table, bookcase, chart desk, telescope."""
    apothem, height = 2.95, 2.9
    mahogany, oak = look.wood(look.MAHOGANY), look.wood(look.OAK)
    green, pale = look.plain((112, 142, 130), 0.07), look.plain((188, 202, 186), 0.06)
    looks = Looks(
        green,
        look.painted_panel((226, 214, 186), (176, 140, 72)),
        look.painted_panel((176, 192, 176), (214, 190, 130)),
        look.plain((84, 116, 108), 0.06),
        look.plain((226, 222, 206)),
        mahogany,
    )
    openings = {
        0: (WINDOW,),
        2: (porthole(0.0, 1.76),),
        3: (DOOR,),
        5: (DOOR,),
        7: (porthole(0.0, 1.76),),
    }
    floor = look.tiles([(222, 208, 180), (150, 78, 56)], 0.24, (150, 140, 126), diagonal=True)
    charts, placed = octagon(
        apothem, height, openings, looks, floor, look.plain((226, 216, 194), 0.05), None
    )
    charts += ceiling_ribs(apothem, height, looks.trim)

    def wall(k: int) -> FlatWall:
        return FlatWall(k * EIGHTH, apothem)

    charts += on_wall(piece.bookcase(mahogany), wall(1))
    charts += on_wall(
        piece.box_bed(
            look.plain((84, 116, 108), 0.06), pale, look.cloth((44, 66, 108), (222, 214, 190), 0.16)
        ),
        wall(4),
    )
    charts += on_wall(piece.mirror(0.6, 1.15, 1.95), wall(6))
    charts += on_wall(_desk(mahogany), wall(6))
    text = look.plaque(
        "AR STEREN",
        (
            "Chamber of the charts",
            "Light seen at 21 miles - white, group of three",
            "Every vessel that passes by day is entered in the log with its hour and its heading",
        ),
        (20, 10, 5),
    )
    charts += on_wall(piece.plaque(text, 1.66), wall(2), -0.745)
    charts += piece.round_table(mahogany, look.marquetry_round(0.9), 0.92)
    charts += place(
        [sheet((-0.42, -0.28, 0.764), (0.84, 0, 0), (0, 0.56, 0), look.sea_chart())],
        0.5,
        (0.1, 0.12, 0),
    )
    charts += place(piece.candlestick(), 0, (-0.5, -0.35, 0.76)) + place(
        piece.mug(), 2.0, (0.5, -0.35, 0.76)
    )
    for x, y in ((0.1, 1.25), (-0.2, -1.3)):
        charts += place(piece.stool(oak, look.plain((60, 84, 104), 0.15)), x, (x, y, 0))
    charts += place(piece.telescope(), 0.2, (2.25, -0.35, 0.0))
    charts += piece.hanging_lamp(height - 0.14, 2.02)
    return RoomModel(
        id="chamber2",
        charts=tuple(charts),
        openings=tuple(placed),
        lamps=(Lamp((0, 0, 2.02), 0.1, (0.9, 0.70, 0.46)),),
        stations=np.array([[-1.5, -0.85, 1.50], [-1.45, 0.85, 1.53], [1.6, 0.0, 1.48]]),
        passer_by=tuple(
            place(
                piece.person(look.cloth((128, 60, 52)), look.cloth((52, 58, 76))),
                2.4,
                (-0.25, 1.9, 0.0),
            )
        ),
        passer_by_station=1,
    )


def _desk(body: Material) -> list[Chart]:
    """A writing desk under the mirror with a chart on it."""
    charts = box((-0.65, -0.55, 0.70), (0.65, 0, 0.745), body, without="+y")
    charts += box((-0.62, -0.52, 0.58), (0.62, 0, 0.70), body, without="+y +z")
    for x in (-0.56, 0.56):
        for y in (-0.47, -0.06):
            charts += revolve(
                [(0.02, 0), (0.03, 0.05), (0.022, 0.1), (0.035, 0.58)], (x, y, 0), body, segments=12
            )
    charts += place(
        [sheet((-0.4, -0.22, 0.749), (0.8, 0, 0), (0, 0.42, 0), look.sea_chart())],
        0.0,
        (-0.05, -0.28, 0),
    )
    charts += place(_books(), 0.2, (0.48, -0.2, 0.745))
    return charts
