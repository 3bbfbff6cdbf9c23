"""What a film is asked for, its captions and sounds, and an encoder that is lacking or stopped."""

from __future__ import annotations

import subprocess
import wave
from pathlib import Path

import numpy as np
import pytest
from imageio_ffmpeg import get_ffmpeg_exe
from PIL import Image

from tourgen.errors import InputError, StageError
from tourgen.film.ffmpeg import require_ffmpeg
from tourgen.film.segments import Segment, digest_of, encode_segment, segments_of, work_folder
from tourgen.film.settings import FilmSettings, parse_part, parse_size
from tourgen.film.soundtrack import Played, mix_sounds, sounds_of
from tourgen.film.subtitles import vtt_of

RATE = 48_000


@pytest.mark.parametrize(
    ("text", "size"), [("1920x1080", (1920, 1080)), (" 3840X2160 ", (3840, 2160))]
)
def test_sizes_are_read(text: str, size: tuple[int, int]) -> None:
    assert parse_size(text) == size


@pytest.mark.parametrize(
    ("text", "told", "hint"),
    [
        ("1921x1081", "expected even numbers, as H.264 needs them, found 1921x1081", "1922x1082"),
        ("hd", "expected WIDTHxHEIGHT in pixels, found `hd`", "1920x1080"),
        ("-2x2", "expected WIDTHxHEIGHT in pixels, found `-2x2`", "1920x1080"),
        ("2x2", "expected 320x180 to 7680x4320, found 2x2", "1920x1080"),
    ],
)
def test_sizes_that_are_none_are_told(text: str, told: str, hint: str) -> None:
    with pytest.raises(InputError) as fault:
        parse_size(text)
    assert told in fault.value.message
    assert hint in fault.value.hint


def test_parts_are_read() -> None:
    assert parse_part("12-15.5") == (12, 15.5)
    for wrong in ("15-12", "3-3", "3", "a-b"):
        with pytest.raises(InputError, match="two seconds, the later one last"):
            parse_part(wrong)


def test_segments_hold_every_frame_once() -> None:
    found = segments_of(10, 145, 30)
    assert [(each.first, each.last) for each in found] == [(10, 70), (70, 130), (130, 145)]
    assert len({each.name for each in found}) == 3


def test_segments_of_another_film_are_dropped(tmp_path: Path) -> None:
    folder = work_folder(tmp_path / "a.mp4", "one")
    (folder / "000000.mp4").touch()
    assert (work_folder(tmp_path / "a.mp4", "one") / "000000.mp4").exists()
    assert not (work_folder(tmp_path / "a.mp4", "two") / "000000.mp4").exists()


def test_the_digest_follows_site_and_settings(tmp_path: Path) -> None:
    (tmp_path / "tour.json").write_text("{}")
    before = digest_of(tmp_path, [30])
    assert digest_of(tmp_path, [30]) == before
    assert digest_of(tmp_path, [60]) != before
    (tmp_path / "tour.json").write_text("[]")
    assert digest_of(tmp_path, [30]) != before


def test_captions_are_cut_to_the_part_and_escaped() -> None:
    cues = [
        {"from": 1.0, "to": 3.0, "text": "before"},
        {"from": 3.0, "to": 5.25, "text": "oak & <ash>\nsecond line"},
        {"from": 3725.5, "to": 3800.0, "text": "late"},
    ]
    assert vtt_of(cues, 3.0, 3726.5) == (
        "WEBVTT\n\n00:00:00.000 --> 00:00:02.250\noak &amp; &lt;ash&gt;\nsecond line\n"
        "\n01:02:02.500 --> 01:02:03.500\nlate\n"
    )


def test_sounds_play_where_one_stands_before_their_note() -> None:
    note = {"at": [2.0, 0.0, 1.0], "sound": "rooms/a/notes/1.wav"}
    silent = {"at": [0.0, 0.0, 1.0], "sound": None}
    tour = {
        "rooms": [{"id": "a", "notes": [silent, note]}],
        "stops": [{"room": "a", "look_at": at} for at in ([0, 0, 1], [2, 0.1, 1], [2, 2, 1])],
    }
    stays = [{"stop": i, "from": 10.0 * i, "to": 10.0 * i + 6} for i in range(3)]
    (found,) = sounds_of(tour, stays)
    assert (found.file, found.start_s) == ("rooms/a/notes/1.wav", 10)
    assert 16 < found.end_s < 18


def loudness(track: Path) -> np.ndarray:
    """Of every tenth of a second."""
    command = [get_ffmpeg_exe(), "-v", "error", "-i", str(track), "-f", "s16le", "-ac", "1", "-"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    samples = np.frombuffer(raw, np.int16).astype(float)
    return np.abs(samples[: len(samples) // 4800 * 4800].reshape(-1, 4800)).max(1)


def test_the_sound_track_sounds_where_it_should_and_is_silent_elsewhere(tmp_path: Path) -> None:
    tone = (8000 * np.sin(np.arange(RATE * 10) * 0.06)).astype(np.int16)
    with wave.open(str(tmp_path / "tone.wav"), "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        file.writeframes(tone.tobytes())
    played = [Played("tone.wav", 11.0, 15.0)]
    mix_sounds(require_ffmpeg(), tmp_path, played, (10.0, 18.0), tmp_path / "track.m4a")
    loud = loudness(tmp_path / "track.m4a")
    assert 78 <= len(loud) <= 81
    assert loud[:9].max() < 50
    assert loud[16:36].min() > 4000
    assert loud[53:].max() < 50
    # a part that starts in the midst of it
    mix_sounds(require_ffmpeg(), tmp_path, played, (12.0, 13.0), tmp_path / "part.m4a")
    assert loudness(tmp_path / "part.m4a")[1:-1].min() > 4000


def test_a_sound_that_is_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "noise.wav").write_text("no sound at all")
    with pytest.raises(StageError, match="sound track: ffmpeg: ") as fault:
        mix_sounds(
            require_ffmpeg(), tmp_path, [Played("noise.wav", 0, 2)], (0, 2), tmp_path / "t.m4a"
        )
    assert "\n" not in fault.value.message


def test_an_ffmpeg_without_h264_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho ' V....D mpeg4  MPEG-4 part 2'\n")
    program.chmod(0o755)
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(program))
    with pytest.raises(InputError, match="expected an ffmpeg with libx264"):
        require_ffmpeg()
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "none"))
    with pytest.raises(InputError, match="expected an ffmpeg that runs, found none"):
        require_ffmpeg()


def test_a_disk_that_fills_is_told(tmp_path: Path) -> None:
    segment = Segment(0, 2)

    def grey(_: int) -> Image.Image:
        return Image.new("RGB", (2, 2), "grey")

    (tmp_path / f"{segment.name}.new").symlink_to("/dev/full")
    with pytest.raises(InputError, match="expected room for the film, found none left") as fault:
        encode_segment(require_ffmpeg(), tmp_path, segment, FilmSettings(2, 2), grey)
    assert "goes on where it stopped" in fault.value.hint
    assert not (tmp_path / segment.name).exists()
