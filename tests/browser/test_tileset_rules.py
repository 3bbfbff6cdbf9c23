"""The tilesets keep the rules of 3D Tiles 1.1."""

from __future__ import annotations

from pathlib import Path

import pytest
from published import Box, read_glb, rooms_of, surface, tileset

ROOMS = ("chamber1", "stairs", "chamber2")
HAIR_M = 1e-4
"""What rounding to float32 and to Draco's grid may add, less than half a grid step of 0.25 mm."""


@pytest.fixture(params=ROOMS)
def room_folder(request: pytest.FixtureRequest, site: Path) -> Path:
    return site / "rooms" / request.param


def test_version(room_folder: Path) -> None:
    document, root = tileset(room_folder / "tileset.json")
    assert document["asset"]["version"] == "1.1"
    assert document["geometricError"] >= root.error_m > 0


def test_children_lie_inside_their_parents(room_folder: Path) -> None:
    _, root = tileset(room_folder / "tileset.json")
    outside = [
        child.file.name
        for node in root.walk()
        for child in node.children
        if not node.box.holds(child.box, HAIR_M)
    ]
    assert outside == []


def test_errors_fall_to_zero(room_folder: Path) -> None:
    _, root = tileset(room_folder / "tileset.json")
    for node in root.walk():
        assert all(child.error_m < node.error_m for child in node.children)
    assert {leaf.error_m for leaf in root.leaves()} == {0.0}


def test_every_reference_exists_once(room_folder: Path) -> None:
    _, root = tileset(room_folder / "tileset.json")
    named = sorted(node.file for node in root.walk())
    there = sorted((room_folder / "tiles").glob("*.glb"))
    assert named == there
    assert {node.refine for node in root.walk()} == {"REPLACE"}


def test_content_lies_inside_its_box(room_folder: Path) -> None:
    _, root = tileset(room_folder / "tileset.json")
    for node in root.walk():
        vertices = surface(node.file.read_bytes()).vertices
        assert node.box.holds(Box(vertices.min(axis=0), vertices.max(axis=0)), HAIR_M), node.file


def test_required_extensions_are_told(room_folder: Path) -> None:
    """A client that lacks a decoder must learn so before it draws."""
    for tile in (room_folder / "tiles").glob("*.glb"):
        document, _ = read_glb(tile.read_bytes())
        assert {"KHR_draco_mesh_compression", "EXT_texture_webp"} <= set(
            document["extensionsRequired"]
        )
        assert set(document["extensionsRequired"]) <= set(document["extensionsUsed"])


def test_bounds_of_the_tour_file(site: Path) -> None:
    """tour.json says what the tileset says."""
    for room in rooms_of(site).values():
        _, root = tileset(site / room["tileset"])
        bounds = Box(*(root.box.low * 0 + room["bounds"][key] for key in ("min", "max")))
        assert root.box.holds(bounds, 0.05)
        assert bounds.holds(root.box, 0.05)
