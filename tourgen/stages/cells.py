"""Small cells of a room, with the points of each sorted by their owners.

An owner is the station that saw a point, or the plane that it lies on: what several of them have
in one cell can be compared.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64
from tourgen.voxels import grouped, voxels

Bool = npt.NDArray[np.bool_]
Int64 = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Cells:
    """Points sorted into groups of one cell and one owner, the groups of a cell in a row.

    Attributes:
        order: (n,) positions of the points, group after group.
        starts: (g,) where each group begins.
        sizes: (g,)
        cell: (g,) number of the group's cell.
        owner: (g,) its owner.
    """

    order: Int64
    starts: Int64
    sizes: Int64
    cell: Int64
    owner: Int64

    def means(self, values: npt.NDArray[np.generic]) -> Float64:
        """(g, k) mean of (n, k) values by group."""
        columns = [
            np.add.reduceat(column[self.order].astype(np.float32), self.starts, dtype=np.float64)
            for column in values.T
        ]
        return np.stack(columns, axis=1) / self.sizes[:, None]

    def members(self, groups: Int64) -> Int64:
        """Positions of the points of some groups, group after group."""
        count = self.sizes[groups]
        before = np.cumsum(count) - count
        at = np.arange(count.sum()) + np.repeat(self.starts[groups] - before, count)
        return np.asarray(self.order[at])

    def of_points(self, values: Bool) -> Bool:
        """(n,) each point's group's value."""
        spread = np.empty(len(self.order), bool)
        spread[self.order] = np.repeat(values, self.sizes)
        return spread


def cells_of(points: Float32, owner: npt.NDArray[np.integer], count: int, cell_m: float) -> Cells:
    """Sort n points of ``count`` owners into cells."""
    if not len(points):
        none = np.zeros(0, np.int64)
        return Cells(none, none, none, none, none)
    key = voxels(points, cell_m)[0] * count + owner
    order, starts = grouped(key)
    cell, of = np.divmod(key[order[starts]], count)
    return Cells(order, starts, np.diff(starts, append=len(key)), cell, of)
