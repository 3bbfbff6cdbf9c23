"""Entry: where a visitor first stands in a room, and what they look at.

Of the places where scanners stood (failing those, of a grid over the room) the one with the
longest open view wins; the visitor looks along it. The eye is 1.6 m above the floor below, and
that floor is near the room's lowest: nobody enters on top of a wardrobe.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tourgen.geometry import Float64, Mesh, View
from tourgen.rays import cast, ray_scene

VERSION = 2
_STEP_M = 0.5
_IN_THE_OPEN = 0.8  # inside a solid, one sees backs
_ENCLOSED = 0.7  # in a doorway, one sees half the sky


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
    scene = ray_scene(mesh.vertices, mesh.faces)
    for least_around in (_ENCLOSED, 0.05):  # scans of a part of a room are open on most sides
        for places in (stations, _grid(mesh)):
            eyes = _eyes(scene, places, settings.eye_m)
            views = [v for eye in eyes if (v := _longest(scene, eye, least_around, settings))]
            if views:
                return max(views, key=lambda view: view[0])[1]
    middle = np.asarray(mesh.vertices.mean(axis=0), np.float64)
    return View(middle, middle + np.array([1.0, 0.0, 0.0]))


def _longest(
    scene: Any, eye: Float64, least_around: float, settings: Settings
) -> tuple[float, View] | None:
    """The longest view from a place and its length; None where one cannot stand.

    Args:
        scene: The room.
        eye: (3,) metres.
        least_around: Share of the directions in which there must be a surface.
        settings: See ``Settings``.
    """
    azimuth, elevation = np.meshgrid(
        np.radians(np.arange(0, 360, 5.0)), np.radians([0.0, -40, -25, -10, 15]), indexing="ij"
    )
    heading = np.stack(
        [
            np.cos(azimuth) * np.cos(elevation),
            np.sin(azimuth) * np.cos(elevation),
            np.sin(elevation),
        ],
        axis=-1,
    )
    ways = heading.reshape(-1, 3)
    depth, front = cast(scene, np.broadcast_to(eye, ways.shape), ways)
    depth[np.isinf(depth)] = 0  # out of a door: nothing to see
    depth, front = depth.reshape(azimuth.shape), front.reshape(azimuth.shape)
    hit = depth > 0
    level = depth[:, 0][hit[:, 0]]
    if hit.mean() < least_around or level.min(initial=np.inf) < settings.clearance_m:
        return None
    if front[hit].mean() < _IN_THE_OPEN:
        return None
    width = int(settings.fan_deg / 5) // 2
    fan = range(-width, width + 1)
    seen = np.mean([np.roll(depth.mean(axis=1), k) for k in fan], axis=0)
    ahead = (int(np.argmax(seen)) + np.array(fan)) % len(depth)
    met = eye + (heading[ahead] * depth[ahead, :, None])[hit[ahead]]
    return float(seen.max()), View(eye, met.mean(axis=0))


def _grid(mesh: Mesh) -> Float64:
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    x, y = (np.linspace(low[i], high[i], 12)[1:-1] for i in range(2))
    z = low[2] + min(1.5, (high[2] - low[2]) / 2)
    return np.array([[a, b, z] for a in x for b in y], np.float64)


def _eyes(scene: Any, places: Float64, eye_m: float) -> Float64:
    """Eyes over the floor below each place, where that floor is near the lowest."""
    drop, _ = cast(scene, places, np.broadcast_to([0.0, 0.0, -1.0], places.shape))
    found = np.isfinite(drop)
    eyes = places[found]
    eyes[:, 2] += eye_m - drop[found]
    return np.asarray(eyes[eyes[:, 2] < eyes[:, 2].min(initial=np.inf) + _STEP_M])
