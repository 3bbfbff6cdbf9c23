"""What a build keeps, and what it makes anew."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tourgen.cli import main


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    """What a command prints with --json."""
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def published(folder: Path) -> dict[str, bytes]:
    """Every file of the site but the report, which tells how long things took."""
    site = folder / "site"
    return {
        str(file.relative_to(site)): file.read_bytes()
        for file in site.rglob("*")
        if file.is_file() and file.stem != "report"
    }


def set_detail(folder: Path, room: str, detail_mm: int) -> None:
    file = folder / "tour.toml"
    head, tail = file.read_text(encoding="utf-8").split(f'id = "{room}"')
    tail = tail.replace("detail_mm = 30", f"detail_mm = {detail_mm}", 1)
    file.write_text(f'{head}id = "{room}"{tail}', encoding="utf-8")


def test_a_second_build_runs_nothing(box_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = published(box_copy)
    assert not any(told(capsys, "plan", str(box_copy)).values())
    report = told(capsys, "build", str(box_copy))
    assert report["ran_stages"] == 0
    assert published(box_copy) == before


def test_a_change_reaches_only_what_follows_it(
    box_copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One room's detail: its stages from there on, and the plan says so beforehand."""
    set_detail(box_copy, "right", 40)
    plan = told(capsys, "plan", str(box_copy))
    assert plan["left"] == {}
    assert "detail_mm 30.0 -> 40.0" in " ".join(plan["right"].values())
    assert not {"scan", "sift", "spacing", "stations"} & set(plan["right"])
    report = told(capsys, "build", str(box_copy))
    assert report["rooms"]["left"]["ran"] == []
    assert report["rooms"]["right"]["ran"] == list(plan["right"])


def test_a_touched_scan_is_not_a_changed_scan(
    box_copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (box_copy / "scans/left.ply").touch()
    assert told(capsys, "build", str(box_copy))["ran_stages"] == 0


def test_a_changed_scan_is_read_again(box_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scan = box_copy / "scans/left.ply"
    data = bytearray(scan.read_bytes())
    data[-1] ^= 0xFF  # the colour of the last point
    scan.write_bytes(data)
    plan = told(capsys, "plan", str(box_copy))
    assert "scan" in plan["left"]
    assert plan["right"] == {}


def test_a_killed_build_goes_on(box_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An entry of the cache that was cut short counts as absent, and leads to the same site."""
    before = published(box_copy)
    results = sorted((box_copy / ".tourgen/results").glob("*/result.pickle"))
    smallest = min(results, key=lambda file: file.stat().st_size)
    smallest.write_bytes(smallest.read_bytes()[:-1])
    (box_copy / ".tourgen/results/aside-killed").mkdir()
    told(capsys, "build", str(box_copy))
    assert published(box_copy) == before
    assert not (box_copy / ".tourgen/results/aside-killed").exists()


def test_a_room_alone(box_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """--room builds one; the other must have been built before."""
    set_detail(box_copy, "right", 40)
    report = told(capsys, "build", str(box_copy), "--room", "right")
    assert report["rooms"]["left"]["ran"] == []
    set_detail(box_copy, "left", 50)
    before = published(box_copy)
    assert main(["build", str(box_copy), "--room", "right"]) == 2
    assert "room `left`" in capsys.readouterr().err
    assert published(box_copy) == before
