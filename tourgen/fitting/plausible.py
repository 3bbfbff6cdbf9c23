"""Plausible: whether what was read can be a room, told before hours are spent on it."""

from __future__ import annotations

import numpy as np

from tourgen.errors import InputError
from tourgen.geometry import Float32, Float64
from tourgen.scans import ReadFacts
from tourgen.tour import UNITS, Room

_SAMPLE = 100_000
_STRAYS = 0.01
"""Share of the points at either end of an axis that does not count."""
_NARROWEST_M, _WIDE_M, _WIDEST_M = 0.05, 200.0, 1000.0
_USUAL_M = 6.0
_FLATTEST = 2e-3
"""Standard deviation across over that along: less is a line, or a plane. 2 mm of noise on a wall
of 4 m, or a floor that a level would not find fault with."""
_APART_M = 1.0


def require_room(points: Float32, room: Room, facts: ReadFacts) -> tuple[str, ...]:
    """Refuse what cannot be a room.

    Args:
        points: (n, 3) metres, n at least 1.
        room: Whose points they are.
        facts: How reading went.

    Returns:
        What the publisher should know although a build will succeed, one line each.

    Raises:
        InputError: The scans lie apart; they are too narrow or too wide for a room; they lie on
            a line or on a plane, or most of them repeat others.
    """
    _require_together(room, facts.bounds)
    subject = "scan " + " + ".join(f"`{scan.file}`" for scan in room.scans)
    check = "check the export" + (", `keep` and `remove`" if facts.dropped_cropped else "")
    sample = _sample(points)
    low, high = np.quantile(sample, [_STRAYS, 1 - _STRAYS], axis=0)
    width_m = float((high - low).max())
    other = _other_unit(width_m, room)
    _require_width(width_m, subject, other, check)
    _require_depth(sample, subject, check)
    if len(points) < room.clean.min_points:
        raise InputError(
            f"{subject}: expected at least {room.clean.min_points} points, found {len(points)}, "
            f"{facts.dropped_repeated} at the place of another dropped",
            "check the export, or lower `clean.min_points`",
        )
    if width_m > _WIDE_M and other:
        return (f"{subject}: is {width_m:.0f} m wide; {other}",)
    return ()


def _sample(points: Float32) -> Float64:
    """Some of the points; at random, since scanners write them column by column."""
    if len(points) > _SAMPLE:
        points = points[np.random.default_rng(0).integers(0, len(points), _SAMPLE)]
    return points.astype(np.float64)


def _require_width(width_m: float, subject: str, other_unit: str, check: str) -> None:
    if width_m < _NARROWEST_M:
        found = f"it {1000 * width_m:.3g} mm wide" if width_m else "all points in one spot"
        raise InputError(f"{subject}: expected a room, found {found}", other_unit or check)
    if width_m > _WIDEST_M:
        raise InputError(
            f"{subject}: expected a room of at most {_WIDEST_M:g} m, found it {width_m:.0f} m wide",
            "; else ".join(filter(None, (other_unit, "keep a part of it, by `keep`"))),
        )


def _other_unit(width_m: float, room: Room) -> str:
    """The hint that names the unit in which it would be as wide as rooms are, or ""."""
    if not width_m:
        return ""
    width = {unit: width_m / room.unit_m * metres for unit, metres in UNITS.items()}
    best = min(width, key=lambda unit: abs(np.log(width[unit] / _USUAL_M)))
    if best == room.unit or not _NARROWEST_M <= width[best] <= _WIDE_M:
        return ""
    return f'if its numbers are {best}, write `unit = "{best}"`: {width[best]:.3g} m wide'


def _require_depth(sample: Float64, subject: str, check: str) -> None:
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(sample, rowvar=False)), 0))
    shape = next(
        (
            name
            for name, across in zip(("line", "plane"), spread[1::-1], strict=True)
            if across < _FLATTEST * spread[2]
        ),
        None,
    )
    if shape:
        raise InputError(
            f"{subject}: expected the points of a room, found them all on one {shape}",
            check,
        )


def _require_together(room: Room, bounds: Float64) -> None:
    """Refuse scans that lie apart from the others.

    By their boxes alone, which errs to one side only: those of scans that meet do meet. What
    meets too little to be registered is told by ``register``, where the stations are known.
    """
    used = np.flatnonzero(np.isfinite(bounds[:, 0, 0])).tolist()
    reached, waiting = used[:1], used[1:]
    while waiting:
        gap_m = {(i, j): _gap_m(bounds[i], bounds[j]) for i in reached for j in waiting}
        (one, other), least_m = min(gap_m.items(), key=lambda item: item[1])
        if least_m > _APART_M:
            raise _apart(room, one, other, least_m)
        reached.append(other)
        waiting.remove(other)


def _gap_m(box: Float64, other: Float64) -> float:
    return float(np.linalg.norm(np.maximum(np.maximum(box[0] - other[1], other[0] - box[1]), 0)))


def _apart(room: Room, one: int, other: int, gap_m: float) -> InputError:
    first, second = sorted((one, other))
    return InputError(
        f"scans `{room.scans[first].file}` and `{room.scans[second].file}`: expected them to "
        f"meet, found them {gap_m:.3g} m apart",
        "check their `pose`, or give each a room of its own",
    )
