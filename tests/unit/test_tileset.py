from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surfaces import mesh

from tourgen.errors import StageError
from tourgen.geometry import Tile
from tourgen.tileset import tileset_json


def tile(name: str, corners: object, error_m: float, children: tuple[str, ...] = ()) -> Tile:
    return Tile(name, mesh(corners, [[0, 1, 2]]), error_m, children)


def tree(seed: int, fan: int) -> list[Tile]:
    """Three levels of ``fan`` children; boxes and errors at random, so as to break the rules."""
    rng = np.random.default_rng(seed)

    def some(name: str, depth: int) -> list[Tile]:
        names = tuple(f"{name}{child}" for child in range(fan)) if depth else ()
        error_m = float(rng.random()) if depth else 0.0
        own = tile(name, rng.normal(0, 3, (3, 3)), error_m, names)
        return [own, *(one for child in names for one in some(child, depth - 1))]

    return some("r", 2)


def bounds(node: dict) -> tuple[np.ndarray, np.ndarray]:
    box = np.array(node["boundingVolume"]["box"])
    assert box.shape == (12,)
    half = np.abs(box[3:].reshape(3, 3)).sum(0)
    return box[:3] - half, box[:3] + half


def walk(node: dict) -> Iterator[dict]:
    yield node
    for child in node.get("children", []):
        yield from walk(child)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10_000), fan=st.integers(1, 5))
def test_a_tileset_keeps_the_rules_of_3d_tiles(seed: int, fan: int) -> None:
    tiles = tree(seed, fan)
    document = json.loads(tileset_json(tiles[::-1]))
    assert document["asset"] == {"version": "1.1"}
    assert document["root"]["refine"] == "REPLACE"
    assert document["geometricError"] >= document["root"]["geometricError"] > 0
    by_uri = {f"tiles/{one.id}.glb": one for one in tiles}
    nodes = list(walk(document["root"]))
    assert {node["content"]["uri"] for node in nodes} == by_uri.keys()
    assert len(nodes) == len(tiles)
    for node in nodes:
        low, high = bounds(node)
        own = by_uri[node["content"]["uri"]]
        assert (own.mesh.vertices > low + 0.0005).all()  # with room for quantisation
        assert (own.mesh.vertices < high - 0.0005).all()
        for child in node.get("children", []):
            child_low, child_high = bounds(child)
            assert (child_low >= low - 1e-9).all()
            assert (child_high <= high + 1e-9).all()
            assert child["geometricError"] <= node["geometricError"]
        assert bool(own.children) == ("children" in node)
        if "children" not in node:
            assert node["geometricError"] == 0


@pytest.mark.parametrize(
    "broken",
    [
        [],
        [tile("r", np.eye(3), 0.1, ("r0",))],
        [tile("r", np.eye(3), 0.0), tile("s", np.eye(3), 0.0)],
        [tile("r", np.eye(3), 0.1, ("r",))],
    ],
)
def test_anything_but_one_tree_is_an_error(broken: list[Tile]) -> None:
    with pytest.raises(StageError, match="expected one tree"):
        tileset_json(broken)
