"""Three seconds of film, through a door: whole pictures, the same ones after a kill."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from imageio_ffmpeg import get_ffmpeg_exe
from PIL import Image
from scipy.ndimage import binary_dilation
from visitor import Picture, Visit, psnr_db

from tourgen.film.camera import Camera, open_camera
from tourgen.film.settings import FilmSettings

SIZE = (480, 270)
SECONDS, FRAMES = 3, 90
SETTINGS = FilmSettings(width=SIZE[0], height=SIZE[1])
MAGENTA = np.array([255, 0, 255])
LOOKS = 10
"""Pictures of the film that are looked through for holes."""


@pytest.fixture(scope="module")
def cut_s(site: Path) -> float:
    """When the film goes from its first room into the second."""
    with open_camera(site, SETTINGS) as camera:
        return float(camera.plan["cuts"][0])


def command(site: Path, film: Path, cut_s: float) -> list[str]:
    part = f"{cut_s - 1.5:.2f}-{cut_s + SECONDS - 1.5:.2f}"
    asked = ["--size", f"{SIZE[0]}x{SIZE[1]}", "--part", part, "--captions", "--sound"]
    return [sys.executable, "-m", "tourgen.cli", "film", str(site), "-o", str(film), *asked]


def killed_after_a_segment(asked: list[str]) -> None:
    made = subprocess.Popen(asked, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert made.stderr is not None
    with made.stderr:
        assert "60 of 90 frames" in made.stderr.readline()
        os.killpg(made.pid, signal.SIGKILL)
    made.wait()


def finished(asked: list[str]) -> str:
    done = subprocess.run(asked, capture_output=True, text=True, timeout=400)
    assert done.returncode == 0, done.stderr
    return done.stderr


def told(film: Path) -> str:
    """What ffmpeg says of a file's streams."""
    asked = [get_ffmpeg_exe(), "-hide_banner", "-i", str(film)]
    return subprocess.run(asked, capture_output=True, text=True).stderr


def decoded(film: Path) -> list[str]:
    """When each frame is shown, and the digest of its pixels."""
    asked = [get_ffmpeg_exe(), "-v", "error", "-i", str(film), "-map", "0:v", "-f", "framemd5", "-"]
    lines = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.splitlines()
    return [line for line in lines if not line.startswith("#")]


def frames_of(film: Path) -> Picture:
    """All of them, (n, h, w, 3)."""
    asked = [
        get_ffmpeg_exe(),
        "-v",
        "error",
        "-i",
        str(film),
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
    ]
    raw = subprocess.run([*asked, "-"], capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, SIZE[1], SIZE[0], 3)


def test_three_seconds_through_a_door(site: Path, cut_s: float, tmp_path: Path) -> None:
    film, again = tmp_path / "film.mp4", tmp_path / "again.mp4"
    killed_after_a_segment(command(site, film, cut_s))
    assert not film.exists()
    assert "60 of 90 frames are there" in finished(command(site, film, cut_s))
    finished(command(site, again, cut_s))

    beside = {path.name for path in tmp_path.iterdir()}
    made = {"mp4", "webp", "loop.mp4", "en.vtt", "fr.vtt"}
    assert beside == {f"{name}.{kind}" for name in ("film", "again") for kind in made}

    said = told(film)
    assert re.search(r"Video: h264 \(High\) \(avc1.*yuv420p\(tv, bt709, ", said), said
    assert re.search(r"480x270.* 30 fps", said), said
    assert "Audio: aac" in said
    assert "Audio" not in told(film.with_suffix(".loop.mp4"))
    head = film.read_bytes()
    assert 0 < head.index(b"moov") < head.index(b"mdat"), "expected faststart"

    shown = decoded(film)
    assert len(shown) == FRAMES
    times = [int(line.split(",")[2]) for line in shown]
    assert set(np.diff(times)) == {times[1] - times[0]}
    assert decoded(again) == shown
    assert again.read_bytes() == film.read_bytes()

    brightness = frames_of(film).mean(axis=(1, 2, 3))
    assert brightness[:20].min() > 40
    assert brightness.min() < 25
    assert brightness[-20:].min() > 40
    assert film.with_suffix(".en.vtt").read_text().startswith("WEBVTT\n\n00:00:0")
    with Image.open(film.with_suffix(".webp")) as poster:
        assert poster.size == SIZE


def test_no_picture_lacks_a_tile_or_shows_the_void(site: Path) -> None:
    """The void is seen through the scan's own openings alone, as with every tile at its finest."""
    wishes = {"background": "ff00ff"}
    with open_camera(site, SETTINGS, **wishes) as camera:
        times = np.linspace(camera.plan["clear"], camera.plan["seconds"] - 12, LOOKS)
        film = [picture(camera, each) for each in times]
    with open_camera(site, SETTINGS, levels="leaves", **wishes) as camera:
        finest = [picture(camera, each) for each in times]
    for second, one, other in zip(times, film, finest, strict=True):
        openings = binary_dilation(void(other), iterations=3)
        assert (void(one) & ~openings).sum() == 0, f"void at {second:.1f} s"
        assert psnr_db(one, other) > 25, f"coarse at {second:.1f} s"


def test_walls_that_are_made_long_after_their_tile_came(visit: Visit) -> None:
    """A page that waited for them without a pause would stand still for ever."""
    here = visit()
    here.page.add_init_script(
        "const soon = window.requestAnimationFrame;"
        "window.requestAnimationFrame = (draw) => setTimeout(() => soon(draw), 100);"
    )
    here.page.goto(f"{here.origin}/?film&levels=root")
    here.wait("window.tourgen?.film")
    here.wait("window.tourgen.film.plan().then(({ seconds }) => seconds > 10)")


def picture(camera: Camera, second: float) -> Picture:
    return np.asarray(camera.picture(second))


def void(shown: Picture) -> np.ndarray:
    """Where nothing was drawn, edges of what was aside."""
    return np.asarray((np.abs(shown.astype(int) - MAGENTA) < 8).all(axis=2))
