"""Bad input of `tourgen film`: one clear line each, exit code 2, and nothing left behind."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from disks import MB, disk_of

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


def test_no_h264(
    site: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", "/bin/true")
    said = told(capsys, str(site), "-o", str(tmp_path / "a.mp4"))
    assert "film: expected an ffmpeg with libx264, for H.264, found `/bin/true` without" in said


def test_a_disk_that_fills_in_the_middle(site: Path, tmp_path: Path) -> None:
    """With room again, the film goes on where it stopped."""
    with disk_of(16 * MB, tmp_path / "disk") as disk:
        command = [sys.executable, "-m", "tourgen.cli", "film", site, "-o", disk.folder / "a.mp4"]
        asked = [*disk.within, *command, "--size", "320x180", "--part", "3-3.5"]
        with subprocess.Popen(asked, stderr=subprocess.PIPE, text=True) as film:
            while not (disk.seen / "a.parts/000090.mp4").exists():
                assert film.poll() is None
                time.sleep(0.01)
            disk.fill()
            assert film.stderr
            said = film.stderr.read()
        assert film.returncode == 2
        fault = f"error: disk of `{disk.folder}[^`]*`: expected room for the film, found none left$"
        assert len(re.findall(fault, said, re.MULTILINE)) == 1, said
        assert "Traceback" not in said
        assert not (disk.seen / "a.mp4").exists()
        disk.free()
        done = subprocess.run(asked, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert "15 of 15 frames are there" in done.stderr
        assert {file.suffix for file in disk.seen.iterdir()} == {".mp4", ".webp", ".vtt"}
