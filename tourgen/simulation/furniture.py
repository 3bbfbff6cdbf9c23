"""What stands in the rooms.

Pieces against a wall are made in the wall's frame: x to the right, the wall at y = 0, the room
towards -y, the floor at z = 0. Free pieces stand about the origin.
"""

from __future__ import annotations

import numpy as np

from tourgen.geometry import Float64
from tourgen.simulation import materials as look
from tourgen.simulation.charts import (
    Chart,
    Material,
    Pair,
    Vector,
    box,
    chart,
    place,
    raised_panel,
    revolve,
    rod,
    sheet,
    slab,
)

RAIL_M = 0.010  # radius of the thin rails


def ellipsoid(center: Vector, radii: Vector, material: Material, segments: int = 16) -> list[Chart]:
    """A ball stretched along the axes."""
    turn = np.linspace(0, 2 * np.pi, segments + 1)
    lift = np.linspace(-np.pi / 2 + 1e-3, np.pi / 2 - 1e-3, segments // 2 + 1)
    ring = np.cos(lift)[:, None]
    points = np.stack(
        [
            center[0] + radii[0] * ring * np.cos(turn),
            center[1] + radii[1] * ring * np.sin(turn),
            np.broadcast_to(center[2] + radii[2] * np.sin(lift)[:, None], (len(lift), len(turn))),
        ],
        axis=-1,
    )
    a, b = np.broadcast_arrays(turn[None] * max(radii[:2]), lift[:, None] * radii[2])
    return [chart(points, np.stack([a, b], axis=-1) + 3.0, material)]


def panelled_front(
    low: Pair,
    high: Pair,
    columns: int,
    rows: int,
    field: Material,
    edge: Material,
    gap_m: float = 0.06,
) -> list[Chart]:
    """Raised panels in even columns and rows over part of the plane y = 0."""
    width = (high[0] - low[0] - gap_m * (columns + 1)) / columns
    height = (high[1] - low[1] - gap_m * (rows + 1)) / rows
    charts: list[Chart] = []
    for i in range(columns):
        for j in range(rows):
            x = low[0] + gap_m + i * (width + gap_m)
            z = low[1] + gap_m + j * (height + gap_m)
            charts += raised_panel((x, z), (x + width, z + height), field, edge)
    return charts


def box_bed(body: Material, field: Material, blanket: Material) -> list[Chart]:
    """A Breton lit clos: a bed in a cupboard behind a gallery of thin rails, 2.0 x 0.95 m."""
    depth, top, bed = 0.95, 2.02, 0.52
    charts = box((-1.0, -depth, 0), (1.0, 0, bed), body, without="-z +y")
    charts += place(
        panelled_front((-0.97, 0.05), (0.97, bed), 3, 1, field, body), at=(0, -depth, 0)
    )
    for x in (-1.0, 0.955):
        charts += box((x, -depth, bed), (x + 0.045, 0, top), body, grain=2, without="-z +y")
    charts += box((-1.06, -depth - 0.06, top), (1.06, 0, top + 0.07), body, without="+y")
    charts += box((-1.03, -depth - 0.03, top - 0.05), (1.03, -depth + 0.02, top), body)
    charts += box((-0.955, -depth, 1.66), (0.955, -depth + 0.04, top), body)
    charts += place(
        panelled_front((-0.95, 1.66), (0.95, top - 0.05), 3, 1, field, body, 0.04),
        at=(0, -depth, 0),
    )
    for low, high in ((bed, 0.84), (1.45, 1.66)):
        rail = high if low == bed else low
        charts += rod(
            (-0.96, -depth + 0.03, rail),
            (0.96, -depth + 0.03, rail),
            RAIL_M,
            look.wood(look.DARK_OAK),
        )
        for x in np.linspace(-0.9, 0.9, 16):
            charts += rod(
                (x, -depth + 0.03, low - 0.005),
                (x, -depth + 0.03, high + 0.005),
                RAIL_M,
                look.wood(look.DARK_OAK),
                segments=6,
            )
    for x in (-0.32, 0.32):
        charts += box(
            (x - 0.03, -depth, 0.5), (x + 0.03, -depth + 0.05, 1.67), body, grain=2, without="+z -z"
        )
    linen = look.cloth((226, 218, 200))
    charts += box((-0.955, -depth + 0.08, bed), (0.955, -0.01, bed + 0.13), linen, without="-z")
    charts += box(
        (-0.95, -depth + 0.075, bed + 0.10), (0.38, -0.012, bed + 0.155), blanket, without="-z"
    )
    charts += box(
        (0.38, -depth + 0.074, bed + 0.10), (0.50, -0.012, bed + 0.165), linen, without="-z"
    )
    charts += ellipsoid((0.73, -0.48, bed + 0.16), (0.17, 0.33, 0.08), linen, 20)
    return charts


def chest(body: Material, field: Material, brass: Material) -> list[Chart]:
    """A chest of six drawers, 1.2 x 0.48 m and 0.86 m high."""
    charts = box((-0.6, -0.48, 0.06), (0.6, 0, 0.82), body, without="+y +z")
    charts += box((-0.57, -0.45, 0), (0.57, 0, 0.06), body, without="+y -z +z")
    charts += box((-0.64, -0.52, 0.82), (0.64, 0, 0.86), body, without="+y")
    charts += place(
        panelled_front((-0.6, 0.06), (0.6, 0.82), 2, 3, field, body, 0.035), at=(0, -0.48, 0)
    )
    for x in (-0.292, 0.292):
        for z in (0.19, 0.44, 0.69):
            charts += ellipsoid((x, -0.51, z), (0.017, 0.02, 0.017), brass, 10)
    return charts


def cupboard(body: Material, field: Material, brass: Material) -> list[Chart]:
    """A two-door cupboard, 1.1 x 0.5 m and 1.95 m high."""
    charts = box((-0.55, -0.5, 0), (0.55, 0, 1.9), body, grain=2, without="+y -z")
    charts += box((-0.6, -0.55, 1.9), (0.6, 0, 1.97), body, without="+y")
    charts += box((-0.57, -0.52, 0), (0.57, 0, 0.08), body, without="+y -z")
    front = panelled_front((-0.55, 0.10), (0.0, 0.85), 1, 1, field, body) + panelled_front(
        (0.0, 0.10), (0.55, 0.85), 1, 1, field, body
    )
    front += panelled_front((-0.55, 0.80), (0.0, 1.9), 1, 1, field, body) + panelled_front(
        (0.0, 0.80), (0.55, 1.9), 1, 1, field, body
    )
    charts += place(front, at=(0, -0.5, 0))
    for x in (-0.035, 0.035):
        charts += ellipsoid((x, -0.52, 0.98), (0.014, 0.02, 0.03), brass, 10)
    return charts


def bookcase(body: Material) -> list[Chart]:
    """Open shelves with books, 1.3 x 0.32 m and 2.1 m high."""
    charts: list[Chart] = []
    for x in (-0.65, 0.61):
        charts += box((x, -0.32, 0), (x + 0.04, 0, 2.06), body, grain=2, without="+y -z")
    charts += box((-0.69, -0.35, 2.06), (0.69, 0, 2.12), body, without="+y")
    shelves = (0.08, 0.50, 0.86, 1.20, 1.52, 1.80)
    leathers = [
        look.plain(c, 0.2)
        for c in (
            (122, 44, 36),
            (44, 66, 58),
            (40, 54, 92),
            (146, 108, 58),
            (84, 58, 40),
            (170, 150, 116),
        )
    ]
    rng = np.random.default_rng(5)
    for z in shelves:
        charts += box((-0.61, -0.31, z - 0.03), (0.61, 0, z), body, without="+y")
        x = -0.60
        while x < 0.52:
            width, height, deep = (
                rng.uniform(0.03, 0.07),
                rng.uniform(0.19, 0.25),
                rng.uniform(0.19, 0.25),
            )
            if rng.random() < 0.12:
                x += 0.1
                continue
            charts += box(
                (x, -deep, z),
                (x + width, -0.01, z + height),
                leathers[int(rng.integers(6))],
                grain=2,
                without="-z +y",
                cell_m=0.13,
            )
            x += width + 0.004
    return charts


def table(body: Material, top: Material, size: Pair) -> list[Chart]:
    """A refectory table about the origin, 0.76 m high, ``size`` its top."""
    a, b = size[0] / 2, size[1] / 2
    charts = box((-a, -b, 0.715), (a, b, 0.76), top, grain=1)
    charts += box(
        (-a + 0.06, -b + 0.06, 0.62), (a - 0.06, b - 0.06, 0.715), body, grain=1, without="+z"
    )
    leg = [
        (0.055, 0.0),
        (0.055, 0.12),
        (0.035, 0.14),
        (0.05, 0.3),
        (0.055, 0.36),
        (0.03, 0.46),
        (0.045, 0.5),
        (0.045, 0.64),
    ]
    for x in (-a + 0.11, a - 0.11):
        for y in (-b + 0.11, b - 0.11):
            charts += revolve(leg, (x, y, 0), body, segments=16)
    charts += box((-a + 0.09, -0.035, 0.11), (a - 0.09, 0.035, 0.17), body)
    for x in (-a + 0.09, a - 0.15):
        charts += box((x, -b + 0.1, 0.10), (x + 0.06, b - 0.1, 0.16), body, grain=1)
    return charts


def round_table(body: Material, top: Material, radius: float) -> list[Chart]:
    """A table on a turned pillar with a moulded rim, 0.76 m high."""

    def edge(y: Float64) -> Float64:
        reach: Float64 = np.sqrt(np.maximum((radius - 0.012) ** 2 - y * y, 1e-4))
        return reach

    span = (-radius + 0.013, radius - 0.013)
    charts = slab(lambda y: -edge(y), edge, span, 0.76, top, faces_up=True)
    charts += revolve(
        [
            (0.001, 0.70),
            (radius - 0.05, 0.70),
            (radius - 0.01, 0.72),
            (radius, 0.735),
            (radius, 0.75),
            (radius - 0.02, 0.76),
            (radius - 0.15, 0.7592),
        ],
        (0, 0, 0),
        body,
        segments=64,
    )
    charts += revolve(
        [
            (0.34, 0.0),
            (0.34, 0.05),
            (0.12, 0.12),
            (0.07, 0.2),
            (0.12, 0.34),
            (0.06, 0.5),
            (0.09, 0.58),
            (0.2, 0.70),
        ],
        (0, 0, 0),
        body,
    )
    return charts


def stool(body: Material, seat: Material) -> list[Chart]:
    """A round stool about the origin, 0.46 m high."""
    charts = revolve(
        [(0.001, 0.40), (0.15, 0.40), (0.17, 0.42), (0.17, 0.45), (0.15, 0.465), (0.001, 0.47)],
        (0, 0, 0),
        seat,
        segments=28,
    )
    for k in range(3):
        turn = 2 * np.pi * k / 3 + 0.4
        c, s = float(np.cos(turn)), float(np.sin(turn))
        charts += rod((0.19 * c, 0.19 * s, -0.005), (0.11 * c, 0.11 * s, 0.41), 0.02, body)
    return charts


def stove(height: float) -> list[Chart]:
    """A round cast-iron stove about the origin with its pipe up to ``height``."""
    iron = look.plain((62, 60, 62), 0.25)
    charts = revolve(
        [
            (0.16, 0.0),
            (0.2, 0.02),
            (0.19, 0.06),
            (0.15, 0.1),
            (0.2, 0.16),
            (0.23, 0.4),
            (0.2, 0.66),
            (0.24, 0.70),
            (0.24, 0.73),
            (0.14, 0.80),
            (0.07, 0.84),
            (0.06, 0.9),
        ],
        (0, 0, 0),
        iron,
        segments=32,
    )
    charts += rod((0, 0, 0.88), (0, 0, height + 0.01), 0.06, iron, segments=16)
    brass = look.plain(look.BRASS, 0.2)
    charts += revolve(
        [(0.2, 0.38), (0.245, 0.385), (0.245, 0.41), (0.2, 0.415)],
        (0, 0, 0),
        brass,
        segments=32,
    )
    charts += box((-0.3, -0.3, 0), (0.3, 0.3, 0.03), look.granite((96, 92, 92)), without="-z")
    return charts


def hanging_lamp(ceiling: float, globe: float) -> list[Chart]:
    """A brass lamp with a glowing globe at height ``globe``, on a rod from the ceiling."""
    brass = look.plain(look.BRASS, 0.15)
    charts = rod((0, 0, globe + 0.2), (0, 0, ceiling), 0.012, brass)
    charts += revolve([(0.001, globe + 0.23), (0.05, globe + 0.23)], (0, 0, 0), brass)
    charts += revolve(
        [
            (0.05, globe + 0.11),
            (0.2, globe + 0.05),
            (0.215, globe + 0.06),
            (0.06, globe + 0.14),
            (0.05, globe + 0.23),
            (0.012, globe + 0.25),
        ],
        (0, 0, 0),
        brass,
        segments=36,
    )
    charts += revolve(
        [(0.001, globe + 0.11), (0.05, globe + 0.105), (0.21, globe + 0.055)],
        (0, 0, 0),
        look.plain((240, 232, 214)),
        segments=36,
    )
    charts += ellipsoid((0, 0, globe), (0.1, 0.1, 0.1), look.plain((255, 244, 214), glow=6.0), 20)
    charts += revolve(
        [(0.001, 0), (0.05, 0), (0.07, 0.01), (0.07, 0.03), (0.012, 0.05)],
        (0, 0, ceiling - 0.045),
        brass,
    )
    return charts


def mirror(width: float, low: float, high: float) -> list[Chart]:
    """A looking glass in a brass frame, on the wall."""
    brass = look.plain(look.BRASS, 0.2)
    w = width / 2
    charts = [sheet((-w, -0.035, low), (width, 0, 0), (0, 0, high - low), look.looking_glass())]
    for x0, x1, z0, z1 in (
        (-w - 0.06, -w, low - 0.06, high + 0.06),
        (w, w + 0.06, low - 0.06, high + 0.06),
        (-w, w, low - 0.06, low),
        (-w, w, high, high + 0.06),
    ):
        charts += box(
            (x0, -0.06, z0), (x1, 0.0, z1), brass, grain=2 if z1 - z0 > 0.2 else 0, without="+y"
        )
    return charts


def plaque(material: Material, z: float) -> list[Chart]:
    """The plate with letters and checkerboards, its middle at height ``z``, in a wooden frame."""
    w, h = look.PLAQUE_SIZE
    charts = [sheet((-w / 2, -0.032, z - h / 2), (w, 0, 0), (0, 0, h), material)]
    frame = look.wood(look.DARK_OAK)
    for x0, x1, z0, z1 in (
        (-w / 2 - 0.03, -w / 2, z - h / 2 - 0.03, z + h / 2 + 0.03),
        (w / 2, w / 2 + 0.03, z - h / 2 - 0.03, z + h / 2 + 0.03),
        (-w / 2, w / 2, z - h / 2 - 0.03, z - h / 2),
        (-w / 2, w / 2, z + h / 2, z + h / 2 + 0.03),
    ):
        charts += box(
            (x0, -0.042, z0), (x1, 0, z1), frame, grain=2 if z1 - z0 > 0.2 else 0, without="+y"
        )
    return charts


def log_book() -> list[Chart]:
    """An open book on a table top at z = 0."""
    charts = box((-0.22, -0.16, 0), (0.22, 0.16, 0.008), look.plain((96, 40, 34)), without="-z")
    for x in (-0.21, 0.005):
        charts += box(
            (x, -0.15, 0.008), (x + 0.205, 0.15, 0.03), look.plain((232, 222, 196)), without="-z +z"
        )
        charts.append(sheet((x, -0.15, 0.03), (0.205, 0, 0), (0, 0.3, 0), look.page()))
    return charts


def candlestick() -> list[Chart]:
    """Brass, with a candle, on a table top at z = 0."""
    brass = look.plain(look.BRASS, 0.2)
    charts = revolve(
        [
            (0.07, 0),
            (0.07, 0.01),
            (0.03, 0.025),
            (0.015, 0.06),
            (0.025, 0.1),
            (0.014, 0.14),
            (0.03, 0.19),
            (0.012, 0.2),
        ],
        (0, 0, 0),
        brass,
    )
    charts += revolve(
        [(0.012, 0.195), (0.012, 0.3), (0.001, 0.305)], (0, 0, 0), look.plain((238, 230, 206))
    )
    return charts


def mug() -> list[Chart]:
    """Enamelled, on a table top at z = 0."""
    white = look.plain((226, 226, 220), 0.04)
    charts = revolve(
        [(0.04, 0), (0.042, 0.09), (0.036, 0.09), (0.034, 0.012), (0.001, 0.012)], (0, 0, 0), white
    )
    charts += rod((0.04, 0, 0.02), (0.075, 0, 0.03), 0.006, white) + rod(
        (0.072, 0, 0.028), (0.072, 0, 0.075), 0.006, white
    )
    charts += rod((0.075, 0, 0.072), (0.04, 0, 0.08), 0.006, white)
    return charts


def telescope() -> list[Chart]:
    """A brass telescope on a wooden tripod about the origin, 1.25 m high."""
    brass, leg = look.plain(look.BRASS, 0.2), look.wood(look.MAHOGANY)
    charts: list[Chart] = []
    for k in range(3):
        turn = 2 * np.pi * k / 3
        c, s = float(np.cos(turn)), float(np.sin(turn))
        charts += rod((0.3 * c, 0.3 * s, -0.005), (0.03 * c, 0.03 * s, 1.16), 0.016, leg)
    charts += revolve([(0.045, 1.12), (0.05, 1.16), (0.02, 1.2), (0.015, 1.25)], (0, 0, 0), brass)
    charts += rod((0.35, 0, 1.31), (-0.40, 0, 1.21), 0.032, brass, segments=14)
    charts += rod((0.36, 0, 1.3113), (0.28, 0, 1.3), 0.042, brass, segments=14)
    charts += rod((-0.39, 0, 1.2113), (-0.48, 0, 1.2), 0.02, brass, segments=14)
    return charts


def person(coat: Material, trousers: Material) -> list[Chart]:
    """Somebody 1.75 m tall about the origin."""
    skin = look.plain((206, 152, 122))
    charts: list[Chart] = []
    for x in (-0.1, 0.1):
        charts += revolve(
            [(0.06, 0.02), (0.065, 0.1), (0.075, 0.5), (0.1, 0.9)], (x, 0, 0), trousers, segments=14
        )
        charts += ellipsoid((x, -0.06, 0.04), (0.055, 0.14, 0.045), look.plain((40, 34, 32)), 12)
        charts += revolve(
            [(0.045, 0.78), (0.05, 1.05), (0.065, 1.38), (0.02, 1.45)],
            (x * 2.6, 0, 0),
            coat,
            segments=12,
        )
        charts += ellipsoid((x * 2.6, -0.01, 0.73), (0.04, 0.05, 0.08), skin, 10)
    charts += revolve(
        [(0.19, 0.8), (0.2, 0.95), (0.18, 1.15), (0.21, 1.38), (0.12, 1.48), (0.06, 1.52)],
        (0, 0, 0),
        coat,
        segments=20,
    )
    charts += ellipsoid((0, -0.01, 1.63), (0.085, 0.1, 0.125), skin, 16)
    charts += revolve(
        [(0.1, 1.68), (0.1, 1.74), (0.001, 1.77)], (0, 0, 0), look.plain((34, 42, 66)), segments=18
    )
    return charts
