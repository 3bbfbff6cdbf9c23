"""Bad input of `tourgen film`: one clear line each, exit code 2, and nothing left behind."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tourgen.cli import main

Change = Callable[[dict[str, Any]], None]
STOP = {"look_at": [0.0, 0.0, 1.2], "text": {}, "seconds": 5}


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """What a film that cannot be made says."""
    assert main(["film", *arguments]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said
    assert said.count("error: ") == 1
    assert "hint: " in said
    return said


@pytest.fixture
def site(box_tour: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(box_tour / "site", tmp_path / "site"))


def change(site: Path, how: Change) -> None:
    file = site / "tour.json"
    tour = json.loads(file.read_text())
    how(tour)
    file.write_text(json.dumps(tour))


@pytest.mark.parametrize(
    ("how", "fault"),
    [
        (lambda tour: tour["stops"].pop(), "guided path: expected at least 2 stops, found 1"),
        (
            lambda tour: tour["stops"][1].update(room="attic"),
            "stop 2: expected a room of the tour, found `attic`",
        ),
        (
            lambda tour: tour["stops"].insert(
                1, {"room": "left", "position": [4.0, 0.0, 1.6], **STOP}
            ),
            "stop 2: expected a way from stop 1 in room `left`, found walls between them",
        ),
    ],
)
def test_a_path_that_cannot_be_filmed(
    site: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], how: Change, fault: str
) -> None:
    change(site, how)
    said = told(capsys, str(site), "-o", str(tmp_path / "a.mp4"), "--size", "320x180")
    assert fault in said
    assert not (tmp_path / "a.mp4").exists()


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["--size", "1921x1080"], "--size: expected even numbers"),
        (["--part", "9-3"], "--part: expected two seconds"),
        (["--language", "de"], "--language: expected one of the tour's, found `de`"),
        (["-o", "film.avi"], "-o: expected a file named *.mp4, found `film.avi`"),
        (["-o", "nowhere/film.mp4"], "-o: expected the folder `nowhere`, found none"),
    ],
)
def test_a_wish_that_cannot_be_met(
    site: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    fault: str,
) -> None:
    said = told(capsys, str(site), "-o", str(tmp_path / "a.mp4"), *arguments)
    assert fault in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["site"]


def test_no_chromium(
    site: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    said = told(capsys, str(site), "-o", str(tmp_path / "a.mp4"))
    assert "film: expected Chromium or Chrome on the path, found none" in said


def test_a_folder_without_a_site(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = told(capsys, str(tmp_path), "-o", str(tmp_path / "a.mp4"))
    assert "expected a tour's site, found none" in said
