"""What stages are expected to take: seconds, and memory, for a megabyte of scan."""

from __future__ import annotations

from math import pow

SPLIT = " part "
"""Between the name of a stage and the part of a room that a task does of it."""

#: Seconds a megabyte of scan on one core, as the demo's rooms of 20 MB took; 0.02 for a stage not
#: named.
_SECONDS = {
    "stations": 0.015, "ownership": 0.3, "register": 0.22, "sift": 0.24, "exposure": 0.12,
    "spacing": 0.02, "normals": 0.27, "surface": 1.0, "trim": 0.2, "hygiene": 0.09, "levels": 0.2,
    "tiles": 0.04, "unwrap": 0.55, "floors": 0.1, "colors": 0.12, "bake": 0.45, "inferred": 0.05,
    "pack": 0.08, "poster": 0.15, "measure": 0.08,
}  # fmt: skip
#: Seconds below which small scans do not bring them: pictures of one size, and a fixed search.
_LEAST_S = {"ownership": 5.0, "poster": 3.0, "floors": 2.0, "register": 1.0, "exposure": 1.0}
#: Stages that are given the whole scan: those after them see what is left of crowded points.
_OF_THE_WHOLE = {"scan", "stations", "ownership"}
_LEFT_MB = 240.0
#: Stages that grow less than the scan: they draw some of its points, or work on the surface, whose
#: detail has an end.
_SLOWLY_GROWING = {
    "ownership", "surface", "trim", "hygiene", "levels", "tiles", "unwrap", "floors", "bake",
    "pack", "poster", "measure",
}  # fmt: skip
_USUAL_MB, _GROWTH = 20.0, 0.66
#: Stages that leave cores idle: most of their work is of the kind that one thread must do.
_ON_ONE_CORE = {"trim", "hygiene", "levels"}
#: Peak megabytes a megabyte of scan, beyond those of a process at rest: rooms of 228 and 2,250 MB.
_MEMORY = {
    "scan": 2, "stations": 2, "ownership": 2, "sift": 12, "surface": 14, "trim": 10, "levels": 9,
    "colors": 12,
}  # fmt: skip
_REST_MB = 300


def stage_of(name: str) -> str:
    """The stage that a task does, or does a part of."""
    return name.split(SPLIT)[0]


def parts_of(name: str) -> int:
    """Into how many tasks its stage is split."""
    _, _, part = name.partition(SPLIT)
    return int(part.split("/")[1]) if part else 1


def leaves_cores(name: str) -> bool:
    """Whether a task, whatever it is given, mostly works on one core."""
    return stage_of(name) in _ON_ONE_CORE


def expected_s(name: str, scan_mb: float) -> float:
    """Seconds that a task takes on one core."""
    stage = stage_of(name)
    growth = _GROWTH if stage in _SLOWLY_GROWING else 1.0
    times = _given_mb(stage, scan_mb) / _USUAL_MB
    seconds = _SECONDS.get(stage, 0.02) * _USUAL_MB * pow(times, growth)
    return max(seconds, _LEAST_S.get(stage, 0.0)) / parts_of(name)


def expected_mb(name: str, scan_mb: float) -> float:
    """Megabytes of memory that a task takes at its peak."""
    stage = stage_of(name)
    return _REST_MB + _MEMORY.get(stage, 6) * _given_mb(stage, scan_mb) / parts_of(name)


def _given_mb(stage: str, scan_mb: float) -> float:
    """Megabytes of a scan that a stage is given."""
    return scan_mb if stage in _OF_THE_WHOLE else min(scan_mb, _LEFT_MB)
