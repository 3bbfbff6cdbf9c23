"""Viewpoints: where one stands to look at something, on the floor before it.

Of places on rings around the thing those count that have a floor at a person's height below the
eye, room for a body, and a free sight of the thing; the best is as near as one steps to read a
label, before the wall that the thing is on rather than beside it, and toward the room's entry.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float64, Mesh, View
from tourgen.rays import cast, ray_scene

VERSION = 1
_RINGS_M = (1.0, 1.3, 1.7, 2.2, 3.0)
_HEADINGS = np.linspace(0, 2 * np.pi, 24, endpoint=False)
_FALL_M = (0.3, 3.0)
"""How far the floor may lie below the thing, at least and at most."""
_HIDDEN_M = 0.25
"""What stands nearer to the thing than this hides nothing of it: it hangs on it."""
_BODY_M = (0.5, 1.0, 1.5)
_TURNED_M, _FAR_M = 0.8, 0.05
"""What looking at it from behind, and from where the entry is not, count as, in metres too far."""

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Settings:
    """The visitor.

    Attributes:
        eye_m: Height of the eye above the floor.
        clearance_m: Free space around the body.
        away_m: How far away one stands, if one can.
    """

    eye_m: float = 1.6
    clearance_m: float = 0.3
    away_m: float = 1.4


def viewpoints(mesh: Mesh, things: Float64, entry: View, settings: Settings) -> tuple[View, ...]:
    """Find where one stands before each of (n, 3) things; at the entry, turned to it, if nowhere.

    Args:
        mesh: The room.
        things: Metres from the mesh's origin.
        entry: Where one enters.
        settings: See ``Settings``.
    """
    scene = ray_scene(mesh.vertices, mesh.faces)
    return tuple(View(_standing(scene, thing, entry.position, settings), thing) for thing in things)


def _standing(scene: Any, thing: Float64, entry: Float64, settings: Settings) -> Float64:
    ring = np.stack([np.cos(_HEADINGS), np.sin(_HEADINGS), np.zeros(len(_HEADINGS))], axis=1)
    ways = np.concatenate([ring] * len(_RINGS_M))
    away_m = np.repeat(_RINGS_M, len(ring))
    eyes, on_floor = _on_floor(scene, thing + away_m[:, None] * ways, thing, settings.eye_m)
    fit = on_floor & _roomy(scene, eyes, settings) & _seen(scene, eyes, thing)
    if not fit.any():
        return entry
    outward = _outward(scene, thing)
    home = (entry - thing)[:2]
    home = home / max(float(np.linalg.norm(home)), 1e-6)
    cost = (
        np.abs(away_m - settings.away_m)
        + _TURNED_M * (1 - ways[:, :2] @ outward)
        + _FAR_M * (1 - ways[:, :2] @ home)
    )
    return np.asarray(eyes[np.argmin(np.where(fit, cost, np.inf))])


def _on_floor(scene: Any, places: Float64, thing: Float64, eye_m: float) -> tuple[Float64, Mask]:
    """(n, 3) eyes over the floor below places, and where there is one."""
    least, most = _FALL_M
    down = np.broadcast_to([0.0, 0.0, -1.0], places.shape)
    drop, _ = cast(scene, places, down)
    eyes = places.copy()
    eyes[:, 2] = thing[2] - np.where(np.isfinite(drop), drop, 0) + eye_m
    return eyes, (drop > least) & (drop < most)


def _roomy(scene: Any, eyes: Float64, settings: Settings) -> Mask:
    """Where a body fits."""
    around = np.stack([np.cos(_HEADINGS), np.sin(_HEADINGS), np.zeros(len(_HEADINGS))], axis=1)
    free = np.ones(len(eyes), bool)
    for height_m in _BODY_M:
        middle = eyes + np.array([0.0, 0.0, height_m - settings.eye_m])
        starts = np.broadcast_to(middle[:, None], (len(eyes), len(around), 3))
        reach, _ = cast(scene, starts, np.broadcast_to(around, starts.shape))
        free &= reach.min(axis=1) > settings.clearance_m
    return free


def _seen(scene: Any, eyes: Float64, thing: Float64) -> Mask:
    """From where the thing is seen, and not from within something."""
    way = thing - eyes
    distance = np.linalg.norm(way, axis=1)
    reach, front = cast(scene, eyes, way / distance[:, None])
    return np.asarray((reach > distance - _HIDDEN_M) & (front | np.isinf(reach)))


def _outward(scene: Any, thing: Float64) -> Float64:
    """(2,) level and of unit length, away from the nearest surface; zero above or below one."""
    import open3d as o3d

    near = scene.compute_closest_points(o3d.core.Tensor(np.float32(thing[None])))
    normal = near["primitive_normals"].numpy()[0, :2].astype(np.float64)
    length = float(np.linalg.norm(normal))
    return normal / length if length > 0.5 else np.zeros(2)
