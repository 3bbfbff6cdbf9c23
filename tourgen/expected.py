"""What stages are expected to take: seconds, and memory, for a megabyte of scan."""

from __future__ import annotations

SPLIT = " part "
"""Between the name of a stage and the part of a room that a task does of it."""

#: Seconds a megabyte of scan, as the demo's rooms of 13 to 23 MB took on one core; 0.02 for a
#: stage not named.
_SECONDS = {
    "ownership": 0.5, "register": 0.4, "sift": 0.3, "exposure": 0.1, "spacing": 0.05,
    "normals": 0.3, "surface": 1.6, "trim": 0.5, "hygiene": 0.25, "levels": 0.2, "tiles": 0.05,
    "unwrap": 0.7, "floors": 0.25, "colors": 0.25, "bake": 0.4, "inferred": 0.1, "pack": 0.1,
    "poster": 0.1, "measure": 0.15,
}  # fmt: skip
#: Peak megabytes a megabyte of scan, beyond those of a process at rest: a room of 228 MB.
_MEMORY = {"sift": 15, "surface": 30, "trim": 16, "colors": 20, "exposure": 10}
_REST_MB = 300


def stage_of(name: str) -> str:
    """The stage that a task does, or does a part of."""
    return name.split(SPLIT)[0]


def parts_of(name: str) -> int:
    """Into how many tasks its stage is split."""
    _, _, part = name.partition(SPLIT)
    return int(part.split("/")[1]) if part else 1


def expected_s(name: str, scan_mb: float) -> float:
    """Seconds that a task takes on one core."""
    return _SECONDS.get(stage_of(name), 0.02) * scan_mb / parts_of(name)


def expected_mb(name: str, scan_mb: float) -> float:
    """Megabytes of memory that a task takes at its peak."""
    return _REST_MB + _MEMORY.get(stage_of(name), 8) * scan_mb / parts_of(name)
