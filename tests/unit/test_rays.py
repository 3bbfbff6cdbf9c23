"""Rays: the faces along them are all that they may meet."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from tourgen.geometry import Mesh
from tourgen.rays import along, ray_scene, rays_of

LENGTH_M = 1.2


@pytest.mark.parametrize("edge_m", [0.05, 3.0])
def test_rays_meet_the_same_among_the_faces_along_them(edge_m: float) -> None:
    room = trimesh.creation.box((4, 3, 2.5)).subdivide_to_size(edge_m)
    mesh = Mesh(np.zeros(3), np.float32(room.vertices), np.int32(room.faces))
    rng = np.random.default_rng(0)
    starts = rng.uniform(-1.2, 1.2, (60, 3))
    ways = rng.normal(0, 1, (60, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    some = along(mesh, starts, ways, LENGTH_M)
    met = [
        ray_scene(each.vertices, each.faces).cast_rays(rays_of(starts, ways))["t_hit"].numpy()
        for each in (mesh, some)
    ]
    near = met[0] < LENGTH_M
    assert near.sum() > 10
    assert (met[0][near] == met[1][near]).all()
    assert (met[1][~near] >= LENGTH_M).all()
    if edge_m < 1:
        assert len(some.faces) < 0.5 * len(mesh.faces)


def test_nothing_lies_along_rays_through_nothing() -> None:
    empty = Mesh(np.zeros(3), np.empty((0, 3), np.float32), np.empty((0, 3), np.int32))
    assert not len(along(empty, np.zeros((1, 3)), np.float64([[0, 0, 1]]), 1.0).faces)
