"""What a build keeps, and what it makes anew."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from box_tour import box_scan
from filelock import FileLock
from PIL import Image
from published import published_files
from scan_files import cloud_table, write_ply

from tourgen.cli import main
from tourgen.site import write_site
from tourgen.stages.surface import crust
from tourgen.unchanged import last_report


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    """What a command prints with --json."""
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def set_detail(folder: Path, room: str, detail_mm: int) -> None:
    file = folder / "tour.toml"
    head, tail = file.read_text(encoding="utf-8").split(f'id = "{room}"')
    tail = tail.replace("detail_mm = 30", f"detail_mm = {detail_mm}", 1)
    file.write_text(f'{head}id = "{room}"{tail}', encoding="utf-8")


def test_a_second_build_runs_nothing(box_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = published_files(box_copy / "site")
    assert not any(told(capsys, "plan", str(box_copy)).values())
    report = told(capsys, "build", str(box_copy))
    assert report["ran_stages"] == 0
    assert published_files(box_copy / "site") == before


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


def test_repeats_change_nothing_and_black_is_told(
    box_copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A thousand points at the place of another one; and a program that knows no colours."""
    before = json.loads((box_copy / "site/report.json").read_text("utf-8"))["rooms"]["left"]
    points, _ = box_scan(0)
    points = np.concatenate([points, np.repeat(points[5000:5001], 1000, axis=0)])
    colors = np.zeros((len(points), 3), np.uint8)
    write_ply(box_copy / "scans/left.ply", cloud_table(points, colors))
    capsys.readouterr()
    assert main(["build", str(box_copy)]) == 0
    assert (
        "warning: room `left`: scan `scans/left.ply`: has colours that are all black, "
        "its points are grey"
    ) in capsys.readouterr().out.splitlines()
    after = json.loads((box_copy / "site/report.json").read_text("utf-8"))["rooms"]["left"]
    assert after["points_repeated"] == before["points_repeated"] + 1000
    same = ("stations", "points_used", "surface", "area_m2", "faces", "cloud_to_mesh_mm")
    assert {key: after[key] for key in same} == {key: before[key] for key in same}
    poster = Image.open(box_copy / "site/rooms/left/poster.webp")
    assert np.abs(np.median(np.asarray(poster), axis=(0, 1)) - 160).max() < 5


@pytest.mark.parametrize(
    ("setting", "said", "hint"),
    [
        (
            'method = "crust"',
            "surface: crust: expected at most 1000 points, found ",
            "take auto, poisson, signed-distance or ball-pivoting",
        ),
        (
            'method = "ball-pivoting"\nradii_mm = [900]',
            "surface.radii_mm: expected the first from ",
            "mm apart in the middle",
        ),
        ("detail_mm = 400", "surface.detail_mm: expected 1 to 30", "leave it out"),
    ],
)
def test_a_surface_that_cannot_be_drawn_leaves_the_site_whole(
    box_copy: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    setting: str,
    said: str,
    hint: str,
) -> None:
    monkeypatch.setattr(crust, "Settings", partial(crust.Settings, most_points=1000))
    before = published_files(box_copy / "site")
    tour = (box_copy / "tour.toml").read_text("utf-8")
    detail = "" if "detail_mm" in setting else "detail_mm = 30\n"
    tour = tour.replace("detail_mm = 30\n", f"{detail}{setting}\n", 1)
    (box_copy / "tour.toml").write_text(tour, "utf-8")
    capsys.readouterr()
    assert main(["build", str(box_copy), "--jobs", "1"]) == 2
    output = capsys.readouterr().err
    (line,) = (line for line in output.splitlines() if line.startswith("error: "))
    assert line.startswith(f"error: room `left`: {said}")
    assert hint in output.partition("hint: ")[2]
    assert published_files(box_copy / "site") == before


def test_a_killed_build_goes_on(box_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An entry of the cache that was cut short counts as absent, and leads to the same site."""
    before = published_files(box_copy / "site")
    results = sorted((box_copy / ".tourgen/results").glob("*/result.pickle"))
    smallest = min(results, key=lambda file: file.stat().st_size)
    smallest.write_bytes(smallest.read_bytes()[:-1])
    (box_copy / ".tourgen/results/aside-killed").mkdir()
    told(capsys, "build", str(box_copy))
    assert published_files(box_copy / "site") == before
    assert not (box_copy / ".tourgen/results/aside-killed").exists()


def test_a_room_alone(box_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """--room builds one; the other must have been built before."""
    set_detail(box_copy, "right", 40)
    report = told(capsys, "build", str(box_copy), "--room", "right")
    assert report["rooms"]["left"]["ran"] == []
    set_detail(box_copy, "left", 50)
    before = published_files(box_copy / "site")
    assert main(["build", str(box_copy), "--room", "right"]) == 2
    assert "room `left`" in capsys.readouterr().err
    assert published_files(box_copy / "site") == before


def test_a_flame_graph_is_written_that_asks_nobody_for_anything(box_copy: Path) -> None:
    set_detail(box_copy, "right", 45)
    page = box_copy / "profile.html"
    assert main(["build", str(box_copy), "--profile", str(page)]) == 0
    text = page.read_text("utf-8")
    assert "signed_distance.py" in text
    assert "bake" in text
    assert "fonts.googleapis" not in text
    assert not list(box_copy.glob(".profile-*"))


@pytest.mark.parametrize("spoiled", ["site/index.html", "tour.toml", "scans/left.ply"])
def test_only_an_untouched_tour_is_told_at_once(
    box_copy: Path, capsys: pytest.CaptureFixture[str], spoiled: str
) -> None:
    """Any file that is touched has the stages looked through; none of them runs for that."""
    told(capsys, "build", str(box_copy))
    before = published_files(box_copy / "site")
    assert last_report(box_copy, box_copy / "site")
    assert told(capsys, "build", str(box_copy))["ran_stages"] == 0
    assert last_report(box_copy, box_copy / "elsewhere") is None
    file = box_copy / spoiled
    file.write_bytes(file.read_bytes() + (b"#" if spoiled != "scans/left.ply" else b""))
    os.utime(file, (1e9, 1e9))
    assert last_report(box_copy, box_copy / "site") is None
    assert told(capsys, "build", str(box_copy))["ran_stages"] == 0
    assert published_files(box_copy / "site") == before


def test_a_title_changed_while_a_build_runs_is_found_by_the_next(
    box_copy: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file = box_copy / "tour.toml"
    edited = file.read_text("utf-8").replace('en = "', 'en = "New: ', 1)

    def write_while_edited(*given: Any, **named: Any) -> Any:
        file.write_text(edited, encoding="utf-8")
        return write_site(*given, **named)

    with monkeypatch.context() as patch:
        patch.setattr("tourgen.build.write_site", write_while_edited)
        told(capsys, "build", str(box_copy))
    assert last_report(box_copy, box_copy / "site") is None
    assert "New: " not in (box_copy / "site/index.html").read_text("utf-8")
    told(capsys, "build", str(box_copy))
    assert "New: " in (box_copy / "site/index.html").read_text("utf-8")


def test_what_is_asked_of_an_untouched_tour_is_still_done(
    box_copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told(capsys, "build", str(box_copy))
    assert main(["build", str(box_copy), "--room", "attic"]) == 2
    assert "attic" in capsys.readouterr().err
    (box_copy / "lost.md").symlink_to(box_copy / "nowhere.md")
    assert told(capsys, "build", str(box_copy))["ran_stages"] == 0, "a link to nothing is no fault"
    assert last_report(box_copy, str(box_copy / "site"))


def test_single_files_are_made_of_an_untouched_tour_where_they_are_missing(
    box_copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told(capsys, "build", str(box_copy))
    before = published_files(box_copy / "site")
    report = told(capsys, "build", str(box_copy), "--single-file")
    assert report["ran_stages"] == 0
    assert sorted(report["single_files"]["bytes"]) == [
        "single/rooms/left.html",
        "single/rooms/right.html",
        "single/tour.html",
    ]
    assert last_report(box_copy, box_copy / "site", single_files=True), "they are there now"
    assert main(["build", str(box_copy), "--single-file"]) == 0
    told_lines = capsys.readouterr().out.splitlines()
    size = (box_copy / "site/single/tour.html").stat().st_size / 1e6
    assert f"single file {box_copy}/site/single/tour.html: {size:.1f} MB" in told_lines
    (box_copy / "site/single/tour.html").unlink()
    told(capsys, "build", str(box_copy), "--single-file")
    assert (box_copy / "site/single/tour.html").is_file()
    assert "single_files" not in told(capsys, "build", str(box_copy))
    assert published_files(box_copy / "site") == before


def test_a_disk_that_fills_is_one_clear_line(box_copy: Path, tmp_path: Path) -> None:
    """On a file system of its own, too small for the cache; with room, the build goes on."""
    before = published_files(box_copy / "site")
    shutil.rmtree(box_copy / ".tourgen")
    disk, errors = tmp_path / "disk", tmp_path / "errors"
    disk.mkdir()
    build = f"{sys.executable} -m tourgen.cli build {disk}/tour"
    script = f"""
        mount -t tmpfs -o size=9m tmpfs {disk} && cp -r {box_copy} {disk}/tour || exit 99
        {build} 2>{errors}; code=$?
        cp -r {disk}/tour/site {tmp_path}/left
        mount -o remount,size=200m {disk} && {build} >&2 && cp -r {disk}/tour/site {tmp_path}/mended
        exit $code
    """
    alone = ["unshare", "--mount", *(["--map-root-user"] if os.geteuid() else [])]
    ended = subprocess.run([*alone, "sh", "-c", script], capture_output=True, text=True)
    assert ended.returncode == 1, ended.stderr
    lines = [line for line in errors.read_text("utf-8").splitlines() if "error" in line.lower()]
    assert lines, errors.read_text("utf-8")
    assert all(re.match("error: .*expected room.*, found none left$", line) for line in lines)
    assert published_files(tmp_path / "left") == before
    assert published_files(tmp_path / "mended") == before


def test_two_builds_of_one_tour_do_not_meet(
    box_copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first to end dropped what the other was about to keep."""
    (box_copy / "tour.toml").touch()
    before = published_files(box_copy / "site")
    with FileLock(box_copy / ".tourgen/lock"):
        assert main(["build", str(box_copy)]) == 2
    assert "expected no other build of it, found one that runs" in capsys.readouterr().err
    assert published_files(box_copy / "site") == before
    assert main(["build", str(box_copy)]) == 0
