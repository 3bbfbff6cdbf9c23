"""The report: what a build did, as plain data for report.json and report.html."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tourgen import __version__
from tourgen.pipeline import RoomResult


def tour_report(rooms: Sequence[RoomResult], seconds: float) -> dict[str, Any]:
    """The report of a build.

    Args:
        rooms: What was built, in the order of the tour.
        seconds: What the build took, cached stages not counted.

    Returns:
        ``rooms`` by id, and for the tour ``seconds``, ``first_view_bytes`` (tileset and root tile
        of the heaviest room), ``total_bytes`` and ``cached_stages``.
    """
    first = [len(room.files["tileset.json"]) + len(room.files["tiles/r.glb"]) for room in rooms]
    return {
        "tourgen": __version__,
        "seconds": round(seconds, 1),
        "first_view_bytes": max(first, default=0),
        "total_bytes": sum(len(data) for room in rooms for data in room.files.values()),
        "cached_stages": sum(len(room.costs) - len(room.ran) for room in rooms),
        "ran_stages": sum(len(room.ran) for room in rooms),
        "rooms": {room.id: _room_report(room) for room in rooms},
    }


def _room_report(room: RoomResult) -> Mapping[str, Any]:
    summary, quality = room.summary, room.quality
    return {
        "points_read": summary.facts.points_read,
        "points_invalid": summary.facts.dropped_invalid,
        "points_cropped": summary.facts.dropped_cropped,
        "points_repeated": summary.facts.dropped_repeated,
        "points_crowded": summary.points_crowded,
        "points_removed": dict(summary.removed),
        "points_used": summary.points_used,
        "stations": summary.stations.round(3).tolist(),
        "station_moved_mm": summary.station_moved_mm.round(2).tolist(),
        "surface": summary.surface,
        "area_m2": round(quality.area_m2, 2),
        "tiles": [level.tiles for level in summary.levels],
        "faces": [level.faces for level in summary.levels],
        "bytes": [level.bytes for level in summary.levels],
        "seconds": {stage: cost.seconds for stage, cost in room.costs.items()},
        "peak_rss_mb": {stage: cost.peak_rss_mb for stage, cost in room.costs.items()},
        "cloud_to_mesh_mm": {
            "p50": quality.cloud_to_mesh_p50_mm,
            "p95": quality.cloud_to_mesh_p95_mm,
        },
        "inferred_area_ratio": round(quality.inferred_area_ratio, 4),
        "ran": list(room.ran),
        "warnings": list(summary.facts.warnings),
    }
