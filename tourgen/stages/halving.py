"""Halving: faces into parts of a size, near ones together, as a k-d tree does it (Bentley 1975)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tourgen.extent import extent
from tourgen.geometry import Float32, Mesh

Ints = npt.NDArray[np.int64]


def halved(mesh: Mesh, count: int) -> Ints:
    """(f,) number of the part that each face lies in, of ``count`` parts of as many faces each.

    Parts that are near are near in number.
    """
    a, b, c = (mesh.vertices[corner] for corner in mesh.faces.T)
    centre: Float32 = (a + b + c) / np.float32(3)
    label = np.empty(len(centre), np.int64)

    def bisect(faces: Ints, first: int, last: int) -> None:
        if last - first == 1:
            label[faces] = first
            return
        middle = (first + last) // 2
        low, high = extent(centre[faces])
        order = np.argsort(centre[faces, np.argmax(high - low)], kind="stable")
        cut = len(faces) * (middle - first) // (last - first)
        bisect(faces[order[:cut]], first, middle)
        bisect(faces[order[cut:]], middle, last)

    bisect(np.arange(len(centre)), 0, count)
    return label
