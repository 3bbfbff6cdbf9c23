"""Axes of symmetric matrices, against LAPACK's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tourgen.symmetric import axes_of


def axes(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    size, found = np.empty(3), np.empty((3, 3))
    axes_of(*matrix[np.triu_indices(3)].tolist(), size, found)
    return size, found


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), scale=st.sampled_from([1e-12, 1e-3, 1.0, 1e6]))
def test_eigenvalues_and_vectors(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    square = rng.normal(size=(3, 3)) * rng.uniform(0, 1, 3) ** 4
    matrix = scale * (square + square.T)
    size, found = axes(matrix)
    np.testing.assert_allclose(size, np.linalg.eigvalsh(matrix), rtol=1e-9, atol=1e-11 * scale)
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(found @ matrix, size[:, None] * found, atol=1e-10 * scale)


@pytest.mark.parametrize(
    "matrix", [np.zeros((3, 3)), np.eye(3), np.ones((3, 3)), np.diag([3.0, 1.0, 2.0])]
)
def test_matrices_with_equal_eigenvalues(matrix: np.ndarray) -> None:
    size, found = axes(matrix)
    np.testing.assert_allclose(size, np.linalg.eigvalsh(matrix), atol=1e-12)
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-12)
