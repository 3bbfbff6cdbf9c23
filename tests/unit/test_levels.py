"""The coarse level is what one sees first: openings stay open, and what is thin stays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from tourgen.geometry import Mesh
from tourgen.rays import cast, ray_scene
from tourgen.stages.levels import Levels, Settings, levels
from tourgen.stages.mesh_arrays import compact

STEP_M = 0.004
PANE_M, BAR_M = 0.30, 0.06


def glazed_wall() -> Mesh:
    """A wall of 2.2 m by 1.5 m with 24 panes, with a scan's noise, of about 200,000 faces."""
    wide, high = 550, 375
    y, x = np.mgrid[: high + 1, : wide + 1]
    noise = np.random.default_rng(0).normal(0, 0.0004, x.shape)
    vertices = np.stack([x * STEP_M, noise, y * STEP_M], axis=-1).reshape(-1, 3)
    corner = (y[:-1, :-1] * (wide + 1) + x[:-1, :-1]).ravel()
    below = np.stack([corner, corner + 1, corner + wide + 2], axis=1)
    above = np.stack([corner, corner + wide + 2, corner + wide + 1], axis=1)
    faces = np.concatenate([below, above])
    middle = vertices[faces].mean(axis=1)
    mesh = Mesh(np.zeros(3), vertices.astype(np.float32), faces.astype(np.int32))
    return compact(mesh, ~in_pane(middle[:, 0], middle[:, 2]))


def in_pane(x: npt.NDArray[np.float64], z: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    apart = PANE_M + BAR_M
    inside: npt.NDArray[np.bool_] = (x % apart > BAR_M) & (z % apart > BAR_M)
    return inside


@pytest.fixture(scope="module")
def ends() -> Levels:
    return levels(glazed_wall(), Settings(0.003, root_faces=2000))


def test_the_coarse_level_has_the_faces_asked_for(ends: Levels) -> None:
    assert 1900 < len(ends.root.faces) <= 2000 < len(ends.finest.faces)


def test_panes_stay_open_in_the_coarse_level(ends: Levels) -> None:
    z, x = np.mgrid[0.01:1.49:0.004, 0.01:2.19:0.004]
    start = np.stack([x, np.full_like(x, -1.0), z], axis=-1)
    ahead = np.broadcast_to(np.array([0.0, 1.0, 0.0]), start.shape)
    met = np.isfinite(cast(ray_scene(ends.root.vertices, ends.root.faces), start, ahead)[0])
    assert (met == in_pane(x, z)).mean() < 0.01
