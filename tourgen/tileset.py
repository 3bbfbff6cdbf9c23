"""tileset.json: the tree of a room's tiles, after OGC 3D Tiles 1.1 (OGC 22-025r4).

A tile's box holds its own content and its children's boxes, so a parent that was simplified to
a smaller extent still encloses them. Errors never grow from parent to child. Viewers refine a
tile when its error, seen from the nearest point of its box, covers more pixels than they
tolerate; indoors the eye stands in the root's box and in a few of its children's, so those are
refined at once and the rest by distance.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from tourgen.errors import StageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tourgen.geometry import Float64, Tile

_PAD_M = 0.001  # more than a step of the quantisation grid


def tileset_json(tiles: Sequence[Tile]) -> bytes:
    """The tileset that refers to ``tiles/<id>.glb`` for each tile.

    Args:
        tiles: One tree in any order; the root is the tile that is no one's child.

    Returns:
        JSON in UTF-8; z up, metres, room frame.

    Raises:
        StageError: Where the tiles are not one tree.
    """
    by_id = {tile.id: tile for tile in tiles}
    children = [child for tile in tiles for child in tile.children]
    roots = sorted(by_id.keys() - set(children))
    if len(roots) != 1 or len(children) != len(tiles) - 1 or not set(children) <= by_id.keys():
        raise StageError(
            f"tileset: expected one tree of {len(tiles)} tiles, "
            f"found {len(roots)} roots and {len(children)} children"
        )
    root, low, high = _node(by_id, roots[0])
    document = {
        "asset": {"version": "1.1"},
        # What is off by while nothing is shown: the whole room.
        "geometricError": max(round(float(np.linalg.norm(high - low)), 3), root["geometricError"]),
        "root": {**root, "refine": "REPLACE"},
    }
    return json.dumps(document, separators=(",", ":")).encode()


def _node(by_id: dict[str, Tile], name: str) -> tuple[dict[str, Any], Float64, Float64]:
    """A tile as JSON, with the corners of its box."""
    tile = by_id[name]
    low = np.floor(tile.mesh.vertices.min(0).astype(np.float64) * 1000) / 1000 - _PAD_M
    high = np.ceil(tile.mesh.vertices.max(0).astype(np.float64) * 1000) / 1000 + _PAD_M
    error = tile.geometric_error_m
    nodes = []
    for child in tile.children:
        node, child_low, child_high = _node(by_id, child)
        low, high = np.minimum(low, child_low), np.maximum(high, child_high)
        error = max(error, node["geometricError"])
        nodes.append(node)
    center, half = (low + high) / 2, (high - low) / 2
    box = [*center, half[0], 0, 0, 0, half[1], 0, 0, 0, half[2]]
    described: dict[str, Any] = {
        "boundingVolume": {"box": [round(float(value), 4) for value in box]},
        "geometricError": error,
        "content": {"uri": f"tiles/{tile.id}.glb"},
    }
    if nodes:
        described["children"] = nodes
    return described, low, high
