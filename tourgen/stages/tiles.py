"""Tiles: cut the finest mesh into a tree, and simplify inside each branch.

Faces are divided by a k-d tree over their centroids, down to leaves of ``leaf_faces``. A branch
takes its children's faces, welds them and simplifies them with its outer border locked. Every
border is thus the same polyline at all levels: tiles of any levels meet exactly, without skirts,
and nothing can poke through thin things. The price is full resolution along the borders: 470 to
1,190 border vertices in branches of about 4,160 faces (a hall of 27 m at 20 mm).

Not tried: levels simplified over the whole room and then cut, whose tiles would need skirts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Mesh, Tile
from tourgen.rays import ray_scene
from tourgen.stages.halving import halved
from tourgen.stages.levels import Levels
from tourgen.stages.mesh_arrays import (
    compact,
    components,
    face_adjacency,
    face_areas,
    on_grid,
    weld,
)
from tourgen.stages.simplify import simplified

VERSION = 5
ROOT_TEXELS = 500_000
"""Of the root's picture, about, at any size of the room."""
_ISLAND_FACES = 60
_IDS = "0123456789abcdefghijklmnopqrstuvwxyz"


@dataclass(frozen=True, slots=True)
class Settings:
    """How large.

    Attributes:
        leaf_faces: Faces of a leaf, about.
        children: Children of a branch, about.
        branch_ratio: Faces of a branch over those of its children.
        texel_m: Edge of a leaf's texels, at the finest.
    """

    leaf_faces: int = 4_000
    children: int = 8
    branch_ratio: float = 0.15
    texel_m: float = 0.004


def tiles(levels: Levels, settings: Settings) -> tuple[Tile, ...]:
    """Build the tree.

    Args:
        levels: The finest mesh and the coarse one.
        settings: See ``Settings``.

    Returns:
        All tiles, parents before children; the first is the root, whose mesh is the coarse one.
        One alone where that shows all that leaves would, faces and texels.
    """
    finest = levels.finest
    count = int(np.ceil(len(finest.faces) / settings.leaf_faces))
    root_texel_m = float(np.sqrt(face_areas(levels.root).sum() / ROOT_TEXELS))
    is_all = len(levels.root.faces) == len(finest.faces) and root_texel_m <= settings.texel_m
    if count == 1 or is_all:
        return (Tile("r", finest, 0.0, ()),)
    leaves = _leaf_meshes(finest, count)
    branches = _children("r", leaves, settings)
    error_m = max(
        _deviation_m(finest, levels.root),
        2 * max(b[0].geometric_error_m for b in branches),
        root_texel_m,  # a root with every face is coarse nonetheless
    )
    root = Tile("r", levels.root, error_m, tuple(branch[0].id for branch in branches))
    return (root, *(tile for branch in branches for tile in branch))


def _leaf_meshes(finest: Mesh, count: int) -> list[Mesh]:
    """Leaves that are near are near in the list."""
    label = _without_islands(halved(finest, count), finest)
    return [compact(finest, faces) for i in range(count) if (faces := label == i).any()]


def _without_islands(label: npt.NDArray[np.int64], mesh: Mesh) -> npt.NDArray[np.int64]:
    """Hand pieces of a few faces to the neighbour that they share most edges with.

    A straight cut through a jagged mesh leaves such pieces on both its sides; each would be a
    chart of its own.
    """
    pairs = face_adjacency(mesh.faces)
    same = label[pairs[:, 0]] == label[pairs[:, 1]]
    piece = components(pairs[same], len(label))
    small = np.bincount(piece) < _ISLAND_FACES
    across = np.concatenate([pairs[~same], pairs[~same][:, ::-1]])
    across = across[small[piece[across[:, 0]]] & ~small[piece[across[:, 1]]]]
    key, edges = np.unique(
        np.stack([piece[across[:, 0]], label[across[:, 1]]]), axis=1, return_counts=True
    )
    moved_to = np.full(len(small), -1)
    order = np.argsort(edges, kind="stable")  # the last write is the neighbour of most edges
    moved_to[key[0, order]] = key[1, order]
    target = moved_to[piece]
    return np.where(target >= 0, target, label)


def _children(parent: str, leaves: list[Mesh], settings: Settings) -> list[tuple[Tile, ...]]:
    """The subtrees under a tile; the first tile of each is its top."""
    depth = max(1, round(np.log(len(leaves)) / np.log(settings.children)))
    count = min(len(leaves), int(np.ceil(len(leaves) ** (1 / depth) - 1e-9)), len(_IDS))
    bounds = [len(leaves) * i // count for i in range(count + 1)]
    return [
        _subtree(parent + _IDS[i], leaves[bounds[i] : bounds[i + 1]], settings)
        for i in range(count)
    ]


def _subtree(name: str, leaves: list[Mesh], settings: Settings) -> tuple[Tile, ...]:
    if len(leaves) == 1:
        return (Tile(name, leaves[0], 0.0, ()),)
    below = _children(name, leaves, settings)
    tops = [subtree[0] for subtree in below]
    fine = weld([top.mesh for top in tops])
    mesh = on_grid(
        simplified(fine, int(len(fine.faces) * settings.branch_ratio), preserve_border=True)
    )
    error_m = max(_deviation_m(fine, mesh), 1e-4) + max(top.geometric_error_m for top in tops)
    top = Tile(name, mesh, error_m, tuple(child.id for child in tops))
    return (top, *(tile for subtree in below for tile in subtree))


def _deviation_m(fine: Mesh, coarse: Mesh) -> float:
    """How far the fine mesh's vertices lie from the coarse one, 95th percentile."""
    scene = ray_scene(coarse.vertices, coarse.faces)
    return float(np.quantile(scene.compute_distance(fine.vertices).numpy(), 0.95))
