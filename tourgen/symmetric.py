"""Axes of symmetric 3 x 3 matrices, for compiled loops (Jacobi's rotations)."""

from __future__ import annotations

import numpy as np

from tourgen.compiled import compiled
from tourgen.geometry import Float64

_SWEEPS = 12
_DONE = 1e-22
"""Squared size of what is left beside the diagonal, over the diagonal's, to stop at."""


@compiled
def axes_of(
    xx: float, xy: float, xz: float, yy: float, yz: float, zz: float, size: Float64, axes: Float64
) -> None:
    """Eigenvalues and eigenvectors.

    Args:
        xx: Of the matrix, as the others.
        xy: Of the matrix.
        xz: Of the matrix.
        yy: Of the matrix.
        yz: Of the matrix.
        zz: Of the matrix.
        size: (3,) is filled with the eigenvalues, ascending.
        axes: (3, 3) is filled with a unit eigenvector a row.
    """
    a = np.zeros((3, 3))
    a[0, 0], a[1, 1], a[2, 2] = xx, yy, zz
    a[0, 1] = a[1, 0] = xy
    a[0, 2] = a[2, 0] = xz
    a[1, 2] = a[2, 1] = yz
    axes[:] = 0
    for i in range(3):
        axes[i, i] = 1
    for _ in range(_SWEEPS):
        beside = a[0, 1] ** 2 + a[0, 2] ** 2 + a[1, 2] ** 2
        if beside <= _DONE * (a[0, 0] ** 2 + a[1, 1] ** 2 + a[2, 2] ** 2):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] == 0:
                    continue
                theta = (a[q, q] - a[p, p]) / (2 * a[p, q])
                t = 1 / (abs(theta) + np.sqrt(theta * theta + 1))
                if theta < 0:
                    t = -t
                c = 1 / np.sqrt(t * t + 1)
                s = t * c
                for k in range(3):
                    akp, akq = a[k, p], a[k, q]
                    a[k, p], a[k, q] = c * akp - s * akq, s * akp + c * akq
                for k in range(3):
                    apk, aqk = a[p, k], a[q, k]
                    a[p, k], a[q, k] = c * apk - s * aqk, s * apk + c * aqk
                for k in range(3):
                    vp, vq = axes[p, k], axes[q, k]
                    axes[p, k], axes[q, k] = c * vp - s * vq, s * vp + c * vq
    for i in range(3):
        size[i] = a[i, i]
    for i in range(2):  # three values: two passes sort them
        for j in range(2 - i):
            if size[j] > size[j + 1]:
                size[j], size[j + 1] = size[j + 1], size[j]
                for k in range(3):
                    axes[j, k], axes[j + 1, k] = axes[j + 1, k], axes[j, k]
