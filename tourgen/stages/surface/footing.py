"""Footing: a rod that ends in a shadow stands on what it points at.

The foot of a leg is the part of it that furniture hides from every station: of a telescope's three
legs one ended 0.34 m above the floor. A rod that ends where something could have been seen and was
not ends there, and so does one that ends in what it carries; one that ends in the dark goes on
straight to the next surface, when that is near.
"""

from __future__ import annotations

import numpy as np

from tourgen.geometry import Float64, Mesh
from tourgen.rays import along, ray_scene
from tourgen.stages.free_space import FreeSpace
from tourgen.stages.surface.tubes import Rod

_MOST_M = 0.5
"""Farther than this nothing is known to be what a rod stands on."""
_MOST = 0.5
"""The same, in lengths of the rod."""
_STEP_M = 0.02
_FREE = 0.1
"""The part of the way that may have been seen empty: where the rod was seen to end, beams that
slipped past it tell a place or two."""


def on_footing(rods: tuple[Rod, ...], mesh: Mesh, free: FreeSpace) -> tuple[Rod, ...]:
    """Rods with their ends in shadows carried on.

    Args:
        rods: Metres from the mesh's origin.
        mesh: What they stand on, in front of or between.
        free: What stations know to be empty, from the same origin.
    """
    if not rods:
        return rods
    ends = np.array([end for rod in rods for end in _ends(rod)])
    ways = np.array([way for rod in rods for way in _ways(rod)])
    rays = np.concatenate([ends, ways], axis=1).astype(np.float32)
    near = along(mesh, ends, ways, _MOST_M)
    met = ray_scene(near.vertices, near.faces).cast_rays(rays)
    front = np.einsum("ij,ij->i", met["primitive_normals"].numpy(), ways) < 0
    hit_m = np.where(front, met["t_hit"].numpy(), np.inf).reshape(-1, 2)
    return tuple(
        rod.cut(-_on_m(rod, 0, before, free), rod.length_m + _on_m(rod, 1, after, free))
        for rod, (before, after) in zip(rods, hit_m, strict=True)
    )


def _ends(rod: Rod) -> Float64:
    """(2, 3) the places where it begins and ends."""
    return rod.axis[[0, -1]]


def _ways(rod: Rod) -> Float64:
    """(2, 3) unit directions out of both ends."""
    ways = np.stack([rod.axis[0] - rod.axis[1], rod.axis[-1] - rod.axis[-2]])
    return np.asarray(ways / np.linalg.norm(ways, axis=1, keepdims=True))


def _on_m(rod: Rod, end: int, hit_m: float, free: FreeSpace) -> float:
    """How far a rod goes on beyond one of its ends."""
    if hit_m > min(_MOST_M, _MOST * rod.length_m):
        return 0.0
    steps = np.arange(_STEP_M / 2, hit_m, _STEP_M)
    way = _ends(rod)[end] + steps[:, None] * _ways(rod)[end]
    seen = free.holds(way.astype(np.float32))
    return 0.0 if len(seen) and seen.mean() > _FREE else float(hit_m)
