"""Tiles: cut the finest mesh into a tree, and simplify inside each branch.

Faces are divided by a k-d tree over their centroids, down to leaves of ``leaf_faces``. A branch
takes its children's faces, welds them and simplifies them with its outer border locked. Every
border is thus the same polyline at all levels: tiles of any levels meet exactly, without skirts,
and nothing can poke through thin things. The price is full resolution along the borders of
coarse tiles, a tenth of their faces.

Tried and rejected: levels simplified over the whole room and then cut (cracks of several
millimetres between levels, which skirts hide only from one side, and not at 20 mm rails).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Mesh, Tile
from tourgen.stages.levels import Levels
from tourgen.stages.mesh_arrays import compact, weld

VERSION = 1
_IDS = "0123456789abcdefghijklmnopqrstuvwxyz"


@dataclass(frozen=True, slots=True)
class Settings:
    """How large.

    Attributes:
        leaf_faces: Faces of a leaf, about.
        children: Children of a branch, about.
        branch_ratio: Faces of a branch over those of its children.
    """

    leaf_faces: int = 4_000
    children: int = 8
    branch_ratio: float = 0.15


def tiles(levels: Levels, settings: Settings) -> tuple[Tile, ...]:
    """Build the tree.

    Args:
        levels: The finest mesh and the coarse one.
        settings: See ``Settings``.

    Returns:
        All tiles, parents before children; the first is the root, whose mesh is the coarse one.
    """
    finest = levels.finest
    leaves = int(np.ceil(len(finest.faces) / settings.leaf_faces))
    if leaves == 1:
        return (Tile("r", finest, 0.0, ()),)
    centre = finest.vertices[finest.faces].mean(axis=1)
    everything = np.arange(len(finest.faces))
    branches = _children("r", finest, centre, everything, leaves, settings)
    error_m = max(
        _deviation_m(finest, levels.root), 2 * max(b[0].geometric_error_m for b in branches)
    )
    root = Tile("r", levels.root, error_m, tuple(branch[0].id for branch in branches))
    return (root, *(tile for branch in branches for tile in branch))


def _children(
    parent: str,
    finest: Mesh,
    centre: Float32,
    faces: npt.NDArray[np.int64],
    leaves: int,
    settings: Settings,
) -> list[tuple[Tile, ...]]:
    """The subtrees under a tile; the first tile of each is its top."""
    depth = max(1, round(np.log(leaves) / np.log(settings.children)))
    count = min(leaves, int(np.ceil(leaves ** (1 / depth) - 1e-9)), len(_IDS))
    share = [leaves * (i + 1) // count - leaves * i // count for i in range(count)]
    parts = _split(faces, centre, share)
    return [
        _subtree(parent + _IDS[i], finest, centre, part, share[i], settings)
        for i, part in enumerate(parts)
    ]


def _subtree(
    name: str,
    finest: Mesh,
    centre: Float32,
    faces: npt.NDArray[np.int64],
    leaves: int,
    settings: Settings,
) -> tuple[Tile, ...]:
    if leaves == 1:
        return (Tile(name, compact(finest, faces), 0.0, ()),)
    below = _children(name, finest, centre, faces, leaves, settings)
    tops = [subtree[0] for subtree in below]
    fine = weld([top.mesh for top in tops])
    mesh = _simplify_locked(fine, settings.branch_ratio)
    error_m = max(_deviation_m(fine, mesh), 1e-4) + max(top.geometric_error_m for top in tops)
    top = Tile(name, mesh, error_m, tuple(child.id for child in tops))
    return (top, *(tile for subtree in below for tile in subtree))


def _split(
    faces: npt.NDArray[np.int64], centre: Float32, share: list[int]
) -> list[npt.NDArray[np.int64]]:
    """Bisect along the longest axis until each part holds its share of the faces."""
    if len(share) == 1:
        return [faces]
    half = len(share) // 2
    at = centre[faces]
    axis = int(np.argmax(np.ptp(at, axis=0)))
    cut = len(faces) * sum(share[:half]) // sum(share)
    order = np.argsort(at[:, axis], kind="stable")
    return _split(faces[order[:cut]], centre, share[:half]) + _split(
        faces[order[cut:]], centre, share[half:]
    )


def _simplify_locked(mesh: Mesh, ratio: float) -> Mesh:
    """Simplify without touching the border."""
    import fast_simplification

    vertices, faces = fast_simplification.simplify(
        mesh.vertices,
        mesh.faces,
        target_count=int(len(mesh.faces) * ratio),
        agg=5,
        preserve_border=True,
    )
    return Mesh(mesh.origin, vertices.astype(np.float32), faces.astype(np.int32))


def _deviation_m(fine: Mesh, coarse: Mesh) -> float:
    """How far the fine mesh's vertices lie from the coarse one, 95th percentile."""
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(coarse.vertices, coarse.faces.astype(np.uint32))
    return float(np.quantile(scene.compute_distance(fine.vertices).numpy(), 0.95))
