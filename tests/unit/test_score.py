"""The score tells a true mesh from a shifted, a rough and an incomplete one."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from tourgen.simulation.charts import box


@pytest.fixture(scope="module")
def score() -> ModuleType:
    path = Path(__file__).parents[1] / "peers" / "score.py"
    spec = importlib.util.spec_from_file_location("score", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def truth(score: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> object:
    import open3d as o3d

    from tourgen.simulation import materials as look
    from tourgen.simulation.model import join

    room = join(box((-2, -2, 0), (2, 2, 2.5), look.wood(), cell_m=0.5))
    folder = tmp_path_factory.mktemp("truth")
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(room.vertices), o3d.utility.Vector3iVector(room.faces[:, ::-1])
    )
    o3d.io.write_triangle_mesh(str(folder / "box.ply"), mesh)
    facts = {"stations": [{"position": [0, 0, 1.5]}], "mirror_faces": []}
    (folder / "box.json").write_text(json.dumps(facts), encoding="utf-8")
    return score.Truth(folder, "box")


def test_the_truth_itself_is_perfect(score: ModuleType, truth: object) -> None:
    figures = score.score(truth.vertices, truth.faces, truth)
    assert figures["accuracy_p95_mm"] < 0.01
    assert figures["completeness_10mm"] == 1
    blind = np.pi * (1.5 * np.tan(np.radians(30))) ** 2 / (2 * 16 + 4 * 10)
    assert 1 - figures["mesh_share_counted"] == pytest.approx(blind, abs=0.003)


def test_a_grown_mesh_is_that_far_off(score: ModuleType, truth: object) -> None:
    grown = truth.vertices + 0.005 * np.sign(truth.vertices - [0, 0, 1.25])
    figures = score.score(grown, truth.faces, truth)
    assert figures["accuracy_median_mm"] == pytest.approx(5, abs=0.2)
    assert figures["completeness_10mm"] == 1


def test_what_is_missing_is_missed(score: ModuleType, truth: object) -> None:
    middle = truth.vertices[truth.faces].mean(axis=1)
    part = truth.faces[middle[:, 2] < 2.49]
    figures = score.score(truth.vertices, part, truth)
    seen = 72 - np.pi * (1.5 * np.tan(np.radians(30))) ** 2
    assert figures["completeness_10mm"] == pytest.approx(1 - 16 / seen, abs=0.01)
    assert figures["accuracy_p95_mm"] < 0.01
