"""Blocks: the zero set of a distance where a room has too many cells to be held at once.

The grid is cut into blocks of cells. In each the surface is grown, drawn and simplified, its border
as it is; what it enters beyond a border is grown on from there. Both sides of a border have the
same corners with the same distances, so the same vertices, and are welded without a seam.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Mesh
from tourgen.sorting import distinct
from tourgen.stages.mesh_arrays import weld
from tourgen.stages.simplify import simplified
from tourgen.stages.surface.growing import grown, union, without
from tourgen.stages.surface.marching_cubes import AXIS_BITS, Keys

EDGE_BITS = 9
"""A block is 512 cells wide: where half of it is walls, a million faces."""
_NO_KEYS: Keys = np.empty(0, np.int64)
_NOTHING: tuple[Keys, Float32] = (_NO_KEYS, np.empty(0, np.float32))


def drawn_by_blocks(
    distance: Callable[[Keys], Float32],
    draw: Callable[[Keys, Float32], Mesh],
    seeds: Keys,
    most_m: float,
    share: float,
    edge_bits: int = EDGE_BITS,
) -> Mesh:
    """Draw a surface block by block.

    Args:
        distance: Of (n,) corners, metres; see ``growing.grown``.
        draw: The surface of some corners with their distances; see ``marching_cubes``.
        seeds: Cells to begin with.
        most_m: See ``growing.grown``.
        share: Of the faces, those that are left.
        edge_bits: Edge of a block, binary digits of a count of cells.
    """
    known = _by_block(distinct(seeds), edge_bits)
    waiting, parts = set(known), dict[int, Mesh]()
    while waiting:
        block = min(waiting)
        waiting.discard(block)

        def within(cells: Keys, block: int = block) -> npt.NDArray[np.bool_]:
            return np.asarray(blocks_of(cells, edge_bits) == block)

        found = grown(distance, known[block], *_NOTHING, most_m, within)
        mesh = draw(found.key, found.value)
        parts[block] = (
            simplified(mesh, int(share * len(mesh.faces)), preserve_border=True)
            if share < 1 and len(mesh.faces)
            else mesh
        )
        for other, cells in _by_block(found.outside, edge_bits).items():
            before = known.get(other, _NO_KEYS)
            new = without(cells, before)
            if len(new):
                known[other] = union(before, new)
                waiting.add(other)
    return weld([parts[block] for block in sorted(parts)])


def blocks_of(cells: Keys, edge_bits: int) -> Keys:
    """(n,) a number for the block that each cell lies in."""
    axis = ((1 << AXIS_BITS) - 1) >> edge_bits << edge_bits
    return cells & (axis << 2 * AXIS_BITS | axis << AXIS_BITS | axis)


def _by_block(cells: Keys, edge_bits: int) -> dict[int, Keys]:
    """Sorted cells by the block they lie in."""
    if not len(cells):
        return {}
    block = blocks_of(cells, edge_bits)
    order = np.argsort(block, kind="stable")
    numbers, first = np.unique(block[order], return_index=True)
    return dict(zip(numbers.tolist(), np.split(cells[order], first[1:]), strict=True))
