"""Levels: the room's finest mesh, and the coarse one that shows it at once.

Both are simplified over the whole room (see ``simplify``), the coarse one with more care, since it
is what one sees first and walks in. Where a room has many more faces than are wanted, most of them
go block by block before, with locked borders: a face at work takes half a kilobyte. The levels
between are made tile by tile in ``tiles``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tourgen.geometry import Mesh
from tourgen.stages.halving import halved
from tourgen.stages.mesh_arrays import compact, face_areas, on_grid, weld
from tourgen.stages.simplify import coarsened, simplified

VERSION = 4
_BLOCK_FACES = 1_000_000
_LEFT = 2.0
"""Faces that blocks leave, over those that are wanted in the end."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How many faces.

    Attributes:
        detail_m: The finest level's detail; sets its faces by area.
        face_detail_ratio: Mean edge of a finest face over ``detail_m``. Flat parts get larger
            faces, edges smaller ones.
        root_faces: Faces of the coarse mesh.
        most_faces: Upper bound of the finest level.
    """

    detail_m: float
    face_detail_ratio: float = 3.0
    root_faces: int = 12_000
    most_faces: int = 2_000_000


@dataclass(frozen=True, slots=True)
class Levels:
    """The two ends of the chain."""

    finest: Mesh
    root: Mesh


def levels(mesh: Mesh, settings: Settings) -> Levels:
    """Simplify to the finest and the coarsest level."""
    edge_m = settings.face_detail_ratio * settings.detail_m
    wanted = int(face_areas(mesh).sum() / (edge_m**2 * np.sqrt(3) / 4))
    finest = _finest(mesh, min(max(wanted, settings.root_faces), settings.most_faces))
    if len(finest.faces) <= settings.root_faces:
        return Levels(finest, finest)
    return Levels(finest, on_grid(coarsened(finest, settings.root_faces)))


def _finest(mesh: Mesh, faces: int) -> Mesh:
    if len(mesh.faces) <= faces:
        return on_grid(mesh)
    if len(mesh.faces) > max(_BLOCK_FACES, 2 * _LEFT * faces):
        mesh = _by_blocks(mesh, _LEFT * faces / len(mesh.faces))
    return on_grid(simplified(mesh, faces))


def _by_blocks(mesh: Mesh, share: float) -> Mesh:
    """Leave about a share of the faces."""
    count = -(-len(mesh.faces) // _BLOCK_FACES)
    block = halved(mesh, count)
    return weld(
        [
            simplified(each, int(share * len(each.faces)), preserve_border=True)
            for number in range(count)
            for each in (compact(mesh, block == number),)
        ]
    )
