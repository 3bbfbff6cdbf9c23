"""Which method draws a room, what it is told, and a mesh that was mended elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from sampled import cloud, flat, sphere

from tourgen.errors import InputError, StageError
from tourgen.fitting import surface
from tourgen.geometry import PointCloud
from tourgen.stages.sift import Sifted
from tourgen.stages.spacing import Spacing
from tourgen.tour import Room, Surface

SPACING = Spacing(0.03, 0.03)


def drawn(**keys: object) -> surface.Drawn:
    asked = Surface(detail_mm=30, **keys)
    return surface.drawn(asked, sphere(12_000), SPACING, surface.drawing(asked))


@pytest.mark.parametrize(
    "keys",
    [
        {"method": "auto"},
        {"method": "poisson", "depth": 7, "samples_per_node": 2, "full_depth": 4},
        {"method": "poisson", "point_weight": 0, "linear_fit": True},
        {"method": "ball-pivoting"},
        {"method": "ball-pivoting", "radii_mm": [40, 80], "agree_deg": 60},
        {"method": "signed-distance", "neighbours": 24, "crease_deg": 20, "reach": 2},
        {"method": "crust", "filter_deg": 70},
    ],
    ids=str,
)
def test_each_method_draws_the_sphere_and_is_named(keys: dict) -> None:
    found = drawn(**keys)
    away = np.abs(np.linalg.norm(found.mesh.vertices, axis=1) - 1)
    assert np.quantile(away, 0.95) < 0.01
    assert len(found.mesh.faces) > 1000
    assert str(keys["method"]) in found.told or found.told.startswith("signed-distance on 1")


def test_cells_wider_than_the_points_lie_apart_are_told_with_their_key() -> None:
    asked = Surface(method="signed-distance", detail_mm=400)
    with pytest.raises(StageError) as told:
        surface.drawn(asked, sphere(12_000), SPACING, surface.drawing(asked))
    assert "`surface.detail_mm`" in told.value.hint


@pytest.mark.parametrize("method", ["auto", "poisson", "ball-pivoting"])
def test_an_offset_moves_the_surface_into_the_room(method: str) -> None:
    radius = np.linalg.norm(drawn(method=method, offset_mm=20).mesh.vertices, axis=1)
    assert np.median(radius) == pytest.approx(1.02, abs=0.002)


def test_auto_tells_why() -> None:
    told = drawn(method="auto").told
    assert told.startswith("signed-distance on 100.0% of the area, where the scan is dense")
    assert "points lie 30 mm apart" in told


@pytest.mark.parametrize(
    ("method", "opens"),
    [("auto", True), ("poisson", True), ("ball-pivoting", False), ("crust", False)],
)
def test_only_what_closes_gaps_is_opened_again(method: str, opens: bool) -> None:
    room = Room.model_validate(
        {"id": "r", "scans": ["a.ply"], "surface": {"method": method}}, context=None
    )
    assert (surface.trimming(room).closed is not None) == opens


# ------------------------------------------------------------------ a mended mesh


def mended(folder: Path, name: str, given: PointCloud, **keys: object) -> surface.Drawn:
    room = Room.model_validate({"id": "r", "scans": ["a.ply"], "mesh": name, **keys}, context=None)
    return surface.mended(room, folder, Sifted(given, {}), surface.Mended(name, room.unit, room.up))


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".glb"])
def test_a_mended_mesh_takes_the_place_of_the_surface(tmp_path: Path, suffix: str) -> None:
    ball = trimesh.creation.icosphere(4)
    ball.apply_scale([1, 1, 0.5])
    if suffix == ".glb":  # y-up, as the standard says and every exporter does
        ball.vertices = ball.vertices[:, [0, 2, 1]] * [1, 1, -1]
    ball.export(tmp_path / f"mended{suffix}")
    round_ = sphere(5_000)
    given = cloud(round_.cloud.points * [1, 1, 0.5], round_.normals).cloud
    found = mended(tmp_path, f"mended{suffix}", given)
    assert len(found.mesh.vertices) == 2562
    assert np.ptp(found.mesh.vertices, axis=0) == pytest.approx([2, 2, 1], abs=0.01)
    assert f"mended{suffix}" in found.told


def test_unit_axis_and_origin_of_the_scan_hold_for_the_mesh(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(3)
    ball.apply_scale([1000, 500, 1000])
    ball.apply_translation([0, 0, 300_000])
    ball.export(tmp_path / "mended.ply")
    flat_ = sphere(3_000).cloud
    given = PointCloud(
        np.array([0.0, -300.0, 0.0]), flat_.points * [1, 1, 0.5], flat_.colors, flat_.station
    )
    found = mended(tmp_path, "mended.ply", given.take(np.arange(3000)), unit="mm", up="y")
    assert np.ptp(found.mesh.vertices, axis=0) == pytest.approx([2, 2, 1], abs=0.02)
    assert np.abs(found.mesh.vertices.mean(axis=0)).max() < 0.01


@pytest.mark.parametrize(
    ("write", "name", "said"),
    [
        (lambda path: path.write_bytes(b"ply\nnonsense"), "a.ply", "expected a mesh, found"),
        (lambda path: path.write_text("solid"), "a.obj", "expected triangles at finite places"),
        (lambda path: path.write_text("x"), "a.blend", r"expected a mesh \(.ply, .obj, .stl, .glb"),
        (
            lambda path: trimesh.PointCloud(np.eye(3)).export(path),
            "points.ply",
            "expected triangles|expected a mesh",
        ),
        (
            lambda path: trimesh.creation.icosphere().apply_translation([50, 0, 0]).export(path),
            "far.ply",
            "expected the surface where the scan is, found it .* m off",
        ),
    ],
    ids=["no ply", "empty", "unknown", "points", "elsewhere"],
)
def test_what_is_no_mesh_of_this_room_is_told(
    tmp_path: Path, write: object, name: str, said: str
) -> None:
    write(tmp_path / name)
    with pytest.raises(InputError, match=said):
        mended(tmp_path, name, flat(900).cloud)
