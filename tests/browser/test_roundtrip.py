"""Other programs read back what was packed."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
import trimesh
from published import surface, without_draco

from tourgen.cache import Cache
from tourgen.geometry import Mesh
from tourgen.pipeline import tour_recipes
from tourgen.tour import load_tour

ROOMS = ("chamber1", "stairs", "chamber2")
NEAR_M = 1e-3
UP = trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0))
"""From glTF's y up to z up."""


def packed(folder: Path, room: str) -> dict[str, Mesh]:
    """The tiles' surfaces as they went into packing, from the cache of the build."""
    cache = Cache(folder)
    (recipe,) = (each for each in tour_recipes(load_tour(folder), cache) if each.room.id == room)
    (tree,) = (each for each in recipe.files.inputs if each.name == "tiles")
    return {tile.id: tile.mesh for tile in cache.load(tree.key)}


def farthest_m(mesh: Mesh, points: np.ndarray) -> float:
    """How far points lie from a surface at most."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh.vertices, mesh.faces.astype(np.uint32))
    return float(scene.compute_distance(points.astype(np.float32)).numpy().max())


def as_mesh(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    return Mesh(np.zeros(3), vertices.astype(np.float32), faces.astype(np.int32))


@pytest.mark.parametrize("room", ROOMS)
def test_every_tile_read_back_is_what_was_packed(tour_folder: Path, room: str) -> None:
    """Both ways: nothing has moved, nothing was left out."""
    tiles = packed(tour_folder, room)
    folder = tour_folder / "site/rooms" / room / "tiles"
    assert {file.stem for file in folder.glob("*.glb")} == set(tiles)
    for name, mesh in tiles.items():
        read = surface((folder / f"{name}.glb").read_bytes())
        assert len(read.faces) == pytest.approx(len(mesh.faces), rel=0.01)
        assert farthest_m(mesh, read.vertices) < NEAR_M
        assert farthest_m(as_mesh(read.vertices, read.faces), mesh.vertices) < NEAR_M


@pytest.mark.parametrize("room", ROOMS)
def test_trimesh_reads_a_tile(tour_folder: Path, room: str) -> None:
    """With a Draco decoder of its own, and without the part decoded: one surface, one picture."""
    mesh = packed(tour_folder, room)["r"]
    data = (tour_folder / "site/rooms" / room / "tiles/r.glb").read_bytes()
    for glb in (data, without_draco(data)):
        scene = trimesh.load_scene(io.BytesIO(glb), file_type="glb")
        read = scene.to_mesh().apply_transform(UP)
        assert farthest_m(mesh, np.asarray(read.vertices)) < NEAR_M
        assert read.visual.uv is not None
        assert np.ptp(read.visual.uv, axis=0).min() > 0.5
