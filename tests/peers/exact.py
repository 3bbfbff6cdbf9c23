"""What a room lacks for want of points: its surface drawn from the same points without an error.

The points that were kept of the scan are put where the true surface is nearest to them, with its
normals, and drawn by the same stages. What a figure lacks here, no better cleaning, smoothing or
normals could give to these: the beams lie too far apart, or nobody saw the place.
"""

from __future__ import annotations

import os
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from apart import apart
from results import EXACT
from variants import tasks_of

from tourgen.cache import Cache
from tourgen.geometry import Float32, Float64, Int32, OrientedCloud
from tourgen.rays import ray_scene
from tourgen.stages.levels import Levels
from tourgen.tasks import Task
from tourgen.threads import limit_native_threads, use_threads
from tourgen.tour import Tour

_DRAWN = ("surface", "trim", "hygiene", "levels")
_FAR_M = 0.010
"""What lies farther off the truth belongs to no surface, and stays where it is."""
_PART = 1 << 19

Truth = tuple[Float64, Int32]


def exact(tour: Tour, room: str, truth: Truth, scratch: Path) -> Path | str:
    """The finest level of a room from exact points; why not, where it cannot be drawn.

    Args:
        tour: Its cache holds the points.
        room: To be drawn.
        truth: Vertices and faces.
        scratch: Keeps the mesh.
    """
    key = tasks_of(tour, room)["levels"].key[:16]
    file = scratch / "drawn" / room / f"{EXACT}-{key}.npz"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        failed = apart(_draw, tour, room, truth, file)
        if failed:
            return failed
    return file


def _draw(tour: Tour, room: str, truth: Truth, file: Path) -> None:
    limit_native_threads()
    tasks, cache = tasks_of(tour, room), Cache(tour.folder)
    moved: dict[str, Any] = {}

    def result(each: Task[Any]) -> Any:
        if each.name not in moved:
            moved[each.name] = drawn(each) if each.name in _DRAWN else loaded(each)
        return moved[each.name]

    def drawn(each: Task[Any]) -> Any:
        given = [
            tuple(map(result, needed)) if isinstance(needed, tuple) else result(needed)
            for needed in each.arguments
        ]
        run = partial(each.run, *given)
        return run() if each.settings is None else run(each.settings)

    def loaded(each: Task[Any]) -> Any:
        found = cache.load(each.key)
        return exact_points(found, truth) if isinstance(found, OrientedCloud) else found

    with use_threads(os.cpu_count() or 1):
        levels: Levels = result(tasks["levels"])
    mesh = levels.finest
    aside = file.with_name(f".{file.name}")
    np.savez(aside, vertices=mesh.vertices + mesh.origin, faces=mesh.faces)
    aside.rename(file)


def exact_points(oriented: OrientedCloud, truth: Truth) -> OrientedCloud:
    """Points where the true surface is nearest to them, with its normals on the side of theirs."""
    scene = ray_scene(*truth)
    cloud, normals = oriented.cloud, oriented.normals.copy()
    points: Float32 = cloud.points.copy()
    for first in range(0, len(cloud), _PART):
        part = slice(first, first + _PART)
        place = (cloud.points[part] + cloud.origin).astype(np.float32)
        near = scene.compute_closest_points(place)
        on, true = near["points"].numpy(), near["primitive_normals"].numpy()
        close = np.linalg.norm(on - place, axis=1) < _FAR_M
        true *= np.where(np.einsum("ij,ij->i", true, normals[part]) < 0, -1, 1)[:, None]
        true /= np.maximum(np.linalg.norm(true, axis=1, keepdims=True), 1e-9)
        points[part][close] = (on - cloud.origin)[close]
        normals[part][close] = true[close]
    return OrientedCloud(replace(cloud, points=points), normals, oriented.stations)
