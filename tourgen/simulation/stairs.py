"""The spiral stair: granite steps about a newel in a round shaft."""

from __future__ import annotations

import numpy as np

from tourgen.geometry import Float32, Float64
from tourgen.simulation import furniture as piece
from tourgen.simulation import materials as look
from tourgen.simulation.charts import (
    Chart,
    Material,
    Opening,
    RoundWall,
    box,
    chart,
    place,
    reveal,
    revolve,
    rod,
    splits,
    tube,
    wall_surface,
)
from tourgen.simulation.model import Lamp, PlacedOpening, RoomModel
from tourgen.simulation.rooms import ring_on

RADIUS = 1.10
NEWEL = 0.20
RISERS = 33
PER_TURN = 14
CLIMB = 6.0
RISE = CLIMB / RISERS
TREAD = 2 * np.pi / PER_TURN
THICK = 0.08  # least height of stone under a tread
TOP = CLIMB + 2.45
LANDING = 3 * TREAD  # the top landing's share of the turn
CLOSED = 0.75 * 2 * np.pi  # below this much of the first turn the stair is solid down to the floor
END = (RISERS - 1) * TREAD
SCONCES = (0.6, 4.4, 6.0, 9.2, 10.8, 13.6)  # angles up the stair at which wall lamps hang


def sector(
    turn0: float, turn1: float, z: float, material: Material, *, faces_up: bool = True
) -> list[Chart]:
    """A level piece of the ring between newel and wall."""
    turn = splits([turn0, turn1], 0.08)
    radius = splits([NEWEL - 0.01, RADIUS + 0.01])
    points = np.stack(
        [
            radius[None] * np.cos(turn)[:, None],
            radius[None] * np.sin(turn)[:, None],
            np.full((len(turn), len(radius)), z),
        ],
        axis=-1,
    )
    if not faces_up:
        points = points[:, ::-1]
    return [chart(points, points[..., :2] + np.array([z * 7.3, z * 3.1]), material)]


def upright(
    turn: float, low: float, high: float, material: Material, *, forward: bool
) -> list[Chart]:
    """A radial face from newel to wall; ``forward`` looks up the stair."""
    radius = splits([NEWEL - 0.01, RADIUS + 0.01])
    z = splits([low, high])
    points = np.stack(
        [
            np.broadcast_to(radius * np.cos(turn), (len(z), len(radius))),
            np.broadcast_to(radius * np.sin(turn), (len(z), len(radius))),
            np.broadcast_to(z[:, None], (len(z), len(radius))),
        ],
        axis=-1,
    )
    paint = np.stack(np.broadcast_arrays(radius[None] + turn * 3, z[:, None]), axis=-1)
    if forward:
        points, paint = points[:, ::-1], paint[:, ::-1]
    return [chart(points, paint, material)]


def soffit(material: Material) -> list[Chart]:
    """The screw-shaped underside, from where it leaves the floor to the top landing."""
    turn = splits([CLOSED, END], 0.08)
    radius = splits([NEWEL - 0.01, RADIUS + 0.01])[::-1]
    z = turn / TREAD * RISE - THICK
    points = np.stack(
        [
            radius[None] * np.cos(turn)[:, None],
            radius[None] * np.sin(turn)[:, None],
            np.broadcast_to(z[:, None], (len(turn), len(radius))),
        ],
        axis=-1,
    )
    a, b = np.broadcast_arrays(radius[None], turn[:, None] * 0.65)
    return [chart(points, np.stack([b, a], axis=-1), material)]


def flight(tread: Material, riser: Material, under: Material) -> list[Chart]:
    """All steps, the top landing, and the stone below."""
    charts: list[Chart] = []
    for k in range(RISERS):
        last = k == RISERS - 1
        turn0, turn1 = k * TREAD, k * TREAD + (LANDING if last else TREAD)
        z = (k + 1) * RISE
        charts += sector(turn0 - 0.02, turn1, z, tread)
        charts += upright(turn0 - 0.02, z - 0.04, z, tread, forward=False)
        charts += sector(turn0 - 0.02, turn0 + 0.01, z - 0.04, tread, faces_up=False)
        charts += upright(turn0, z - RISE, z - 0.04, riser, forward=False)
    charts += soffit(under)
    charts += upright(CLOSED, 0.0, CLOSED / TREAD * RISE - THICK, under, forward=True)
    charts += sector(END, END + LANDING, CLIMB - RISE - THICK + 0.06, under, faces_up=False)
    charts += upright(END, CLIMB - RISE - THICK, CLIMB - RISE - THICK + 0.06, under, forward=True)
    charts += upright(END + LANDING, CLIMB - RISE - THICK + 0.06, CLIMB, under, forward=True)
    return charts


def handrail(brass: Material) -> list[Chart]:
    """A brass rail along the wall, on brackets."""
    turn = np.arange(0.35, END + 0.2, 0.09)
    radius = RADIUS - 0.065
    lift = np.minimum(turn / TREAD * RISE, CLIMB - RISE) + 0.95
    path = np.stack([radius * np.cos(turn), radius * np.sin(turn), lift], axis=-1)
    charts = tube(path, 0.02, brass, segments=10)
    for start in range(3, len(path), 9):
        x, y, z = (float(v) for v in path[start])
        grow = (RADIUS + 0.01) / radius
        charts += rod((x, y, z - 0.012), (x * grow, y * grow, z - 0.05), 0.008, brass, segments=6)
    return charts


def balustrade(brass: Material) -> list[Chart]:
    """Thin rails at the open end of the top landing."""
    turn = END + LANDING - 0.03

    def at(radius: float, z: float) -> tuple[float, float, float]:
        return float(radius * np.cos(turn)), float(radius * np.sin(turn)), z

    charts: list[Chart] = []
    for z in (CLIMB + 0.12, CLIMB + 0.95):
        charts += rod(
            at(NEWEL - 0.02, z), at(RADIUS + 0.01, z), 0.012 if z < CLIMB + 0.5 else 0.02, brass
        )
    for radius in np.arange(NEWEL + 0.09, RADIUS - 0.02, 0.1):
        charts += rod(
            at(float(radius), CLIMB - 0.01),
            at(float(radius), CLIMB + 0.96),
            0.010,
            brass,
            segments=6,
        )
    return charts


def stairs() -> RoomModel:
    """The shaft with its stair: 33 risers of 182 mm, 14 to the turn, up to a landing at 6 m."""
    start = np.pi + 0.5  # so that the lower door looks due west
    plaster = look.plain((220, 212, 194), 0.10)
    painted = look.climbing_band(
        (132, 160, 150), (224, 214, 194), (74, 96, 90), _pitch, PER_TURN * RISE, 1.25, CLIMB + 1.25
    )
    dado = look.tiles([(196, 206, 196), (178, 194, 186)], 0.15, (212, 206, 192))
    granite, riser = look.granite((164, 156, 146)), look.granite((142, 136, 130))
    brass, oak = look.plain(look.BRASS, 0.2), look.wood(look.DARK_OAK)
    wall = RoundWall((0.0, 0.0), RADIUS, 0.0)

    def arc(turn: float) -> float:
        """Arc length of an azimuth counted up the stair from the first riser."""
        turned = (turn + np.pi) % (2 * np.pi) - np.pi
        return float(-turned * RADIUS)

    bottom = Opening("door", arc(-0.50), 1.0, 0.85, 2.0)
    top = Opening("door", arc(END + LANDING / 2), CLIMB + 1.0, 0.85, 2.0)
    # No light stands over or under a door: wall and reveal are then divided alike and meet.
    lights = [
        Opening("porthole", arc(turn), turn / TREAD * RISE + 1.55, 0.40, 0.40)
        for turn in (1.75, 7.7, 10.2)
    ]
    openings = [bottom, top, *lights]
    span = (-np.pi * RADIUS, np.pi * RADIUS)
    charts = wall_surface(wall, span, (0.0, TOP), painted, openings, grain_up=False)
    for opening in openings:
        charts += reveal(wall, opening, plaster, granite)
        if opening.round:
            charts += ring_on(wall, opening, oak)
    charts += flight(granite, riser, plaster)
    charts += sector(-(2 * np.pi - CLOSED), 0.0, 0.0, dado)
    charts += revolve(
        [(NEWEL, -0.01), (NEWEL, CLIMB + 1.05)],
        (0, 0, 0),
        look.stone((170, 160, 148), 0.30, 2 * np.pi * NEWEL / 3),
        segments=40,
    )
    charts += revolve(
        [(NEWEL, 0), (NEWEL + 0.03, 0.01), (NEWEL + 0.03, 0.06), (0.16, 0.09), (0.001, 0.10)],
        (0, 0, CLIMB + 1.04),
        oak,
        segments=40,
    )
    charts += piece.ellipsoid((0, 0, CLIMB + 1.22), (0.09, 0.09, 0.09), brass, 20)
    charts += _roof(plaster)
    charts += handrail(brass) + balustrade(brass)
    charts += _lantern()
    sconces = [_sconce_place(turn) for turn in SCONCES]
    for turn, at in zip(SCONCES, sconces, strict=True):
        charts += place(_sconce(), turn, at)
    turned = place(charts, start)
    placed = [
        PlacedOpening.of(RoundWall((0.0, 0.0), RADIUS, start), opening) for opening in openings
    ]
    person = place(
        piece.person(look.cloth((54, 70, 96)), look.cloth((70, 62, 52))),
        0.0,
        (-0.5, 0.42, 0.0),
    )
    return RoomModel(
        id="stairs",
        charts=tuple(turned),
        openings=tuple(placed),
        lamps=(
            Lamp((0.0, 0.0, TOP - 0.35), 0.09, (0.5, 0.38, 0.24)),
            *(
                Lamp(
                    (
                        x * np.cos(start) - y * np.sin(start),
                        x * np.sin(start) + y * np.cos(start),
                        z,
                    ),
                    0.05,
                    (0.13, 0.10, 0.065),
                )
                for x, y, z in sconces
            ),
        ),
        stations=_stations(start),
        passer_by=tuple(person),
        passer_by_station=0,
    )


def _pitch(s: Float32) -> Float32:
    """Height of the stair at an arc length of the wall, counted from the first riser."""
    return (-s / np.float32(RADIUS * TREAD) * np.float32(RISE)).astype(np.float32)


def _stations(start: float) -> Float64:
    """In the lower doorway, on every fourth step close to the wall, and on the top landing.

    Three stations, as in the chambers, see under a third of the treads: between -60 degrees and
    the step at eye height a station has about six of them. These ten see 91 %.
    """
    turns = [-0.5, *((k + 0.5) * TREAD for k in range(0, 32, 4)), END + 0.6]
    radii = [1.3, *([0.8] * 8), 0.66]
    floors = [0.0, *((k + 1) * RISE for k in range(0, 32, 4)), CLIMB]
    return np.array(
        [
            [radius * np.cos(start + turn), radius * np.sin(start + turn), floor + 1.5]
            for turn, radius, floor in zip(turns, radii, floors, strict=True)
        ]
    )


def _roof(plaster: Material) -> list[Chart]:
    """A shallow dome."""
    lift = np.linspace(0, 1, 12)
    profile = [
        (
            float(RADIUS * np.cos(t * np.pi / 2) + 0.001),
            float(TOP - 0.01 + 0.3 * np.sin(t * np.pi / 2)),
        )
        for t in lift
    ]
    dome = revolve(profile, (0, 0, 0), plaster, segments=64)
    return [chart(part.points[:, ::-1], part.paint, part.material) for part in dome]


def _sconce_place(turn: float) -> tuple[float, float, float]:
    z = float(max(np.floor(turn / TREAD) + 1, 0) * RISE + 1.72)
    return float((RADIUS - 0.13) * np.cos(turn)), float((RADIUS - 0.13) * np.sin(turn)), z


def _sconce() -> list[Chart]:
    """A small wall lamp whose globe is the origin, the wall towards +x."""
    brass = look.plain(look.BRASS, 0.2)
    charts = piece.ellipsoid(
        (0, 0, 0), (0.05, 0.05, 0.05), look.plain((255, 244, 214), glow=6.0), 14
    )
    charts += revolve(
        [(0.001, -0.09), (0.012, -0.09), (0.03, -0.06), (0.034, -0.035)],
        (0, 0, 0),
        brass,
        segments=14,
    )
    charts += rod((0.0, 0.0, -0.085), (0.14, 0.0, -0.12), 0.009, brass)
    return charts + box((0.105, -0.03, -0.19), (0.14, 0.03, -0.05), brass)


def _lantern() -> list[Chart]:
    brass = look.plain(look.BRASS, 0.2)
    charts = rod((0, 0, TOP - 0.25), (0, 0, TOP + 0.3), 0.012, brass)
    charts += revolve(
        [
            (0.001, TOP - 0.298),
            (0.1, TOP - 0.30),
            (0.11, TOP - 0.28),
            (0.03, TOP - 0.22),
            (0.012, TOP - 0.2),
        ],
        (0, 0, 0),
        brass,
    )
    return charts + piece.ellipsoid(
        (0, 0, TOP - 0.35), (0.09, 0.09, 0.09), look.plain((255, 244, 214), glow=6.0), 18
    )
