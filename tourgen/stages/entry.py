"""Entry: where a visitor first stands in a room, and what they look at.

Of the places where scanners stood (failing those, of a grid over the room) the one with the
longest open view wins; the visitor looks along it. The eye is 1.6 m above the floor below, and
that floor is near the room's lowest: nobody enters on top of a wardrobe.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tourgen.geometry import Float64, Mesh, View

VERSION = 1
_STEP_M = 0.5


@dataclass(frozen=True, slots=True)
class Settings:
    """The visitor.

    Attributes:
        eye_m: Height of the eye above the floor.
        clearance_m: Free space around the body.
        fan_deg: Width of the view whose depth counts.
    """

    eye_m: float = 1.6
    clearance_m: float = 0.35
    fan_deg: float = 70.0


def entry_view(mesh: Mesh, stations: Float64, settings: Settings) -> View:
    """Choose the first view.

    Args:
        mesh: The room, coarse is enough.
        stations: (s, 3) metres from the mesh's origin; may be empty.
        settings: See ``Settings``.
    """
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh.vertices, mesh.faces.astype(np.uint32))
    places = stations if len(stations) else _grid(mesh)
    eyes = _eyes(scene, places, settings.eye_m)
    lowest_m = np.nanmin(np.where(np.isfinite(eyes[:, 2]), eyes[:, 2], np.nan))
    azimuth = np.radians(np.arange(0, 360, 5.0))
    heading = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)], axis=1)
    width = int(settings.fan_deg / 5) // 2
    best_m, best = -np.inf, View(eyes[0], eyes[0] + heading[0])
    for eye in eyes[eyes[:, 2] < lowest_m + _STEP_M]:
        depth = np.minimum(_cast(scene, np.broadcast_to(eye, heading.shape), heading), 20.0)
        seen = np.mean([np.roll(depth, k) for k in range(-width, width + 1)], axis=0)
        if depth.min() > settings.clearance_m and seen.max() > best_m:
            ahead = heading[int(np.argmax(seen))]
            best_m, best = seen.max(), View(eye, eye + 2 * ahead - np.array([0, 0, 0.2]))
    return best


def _grid(mesh: Mesh) -> Float64:
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    x, y = (np.linspace(low[i], high[i], 12)[1:-1] for i in range(2))
    z = low[2] + min(1.5, (high[2] - low[2]) / 2)
    return np.array([[a, b, z] for a in x for b in y], np.float64)


def _eyes(scene: object, places: Float64, eye_m: float) -> Float64:
    down = np.broadcast_to([0.0, 0.0, -1.0], places.shape)
    drop = _cast(scene, places, down)
    eyes = places.copy()
    eyes[:, 2] += eye_m - drop
    return eyes


def _cast(scene: object, start: Float64, direction: Float64) -> Float64:
    rays = np.concatenate([start, direction], axis=1).astype(np.float32)
    return np.asarray(scene.cast_rays(rays)["t_hit"].numpy(), np.float64)  # type: ignore[attr-defined]
