"""Segments: a film is made in pieces of two seconds, so that a kill costs no more than one."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Any, Final

from PIL import Image

from tourgen.film.ffmpeg import BITEXACT, H264, fed, run
from tourgen.film.settings import FilmSettings

SEGMENT_S: Final = 2
_CRF: Final = 18
_THREADS: Final = 4
"""A number of its own: what comes out of x264 depends on it."""

_STATE: Final = "film.json"

_COLOUR: Final = (
    "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p,"
    "setparams=range=tv:color_primaries=bt709:color_trc=bt709:colorspace=bt709"
)
"""From the screen's colours to those that players expect of a film of this size."""


@dataclass(frozen=True, slots=True)
class Segment:
    """Some of a film's frames.

    Attributes:
        first: Number of the first frame, counted from the film's start.
        last: Number of the frame after the last one.
    """

    first: int
    last: int

    @property
    def name(self) -> str:
        """Of the file that holds it."""
        return f"{self.first:06d}.mp4"


def segments_of(first: int, last: int, fps: int) -> tuple[Segment, ...]:
    """All segments from one frame to before another."""
    step = SEGMENT_S * fps
    return tuple(Segment(start, min(last, start + step)) for start in range(first, last, step))


def digest_of(site: Path, asked: Any) -> str:
    """Digest of all that a film comes from: every file of the site, and what is asked for."""
    whole = sha256(json.dumps(asked, sort_keys=True).encode())
    for path in sorted(site.rglob("*")):
        if path.is_file():
            with path.open("rb") as file:
                name = path.relative_to(site).as_posix()
                whole.update(f"{name} {file_digest(file, 'sha256').hexdigest()}\n".encode())
    return whole.hexdigest()


def work_folder(output: Path, digest: str) -> Path:
    """The folder beside a film where its segments wait, emptied where they are of another film."""
    folder = output.with_suffix(".parts")
    state = folder / _STATE
    if not state.is_file() or json.loads(state.read_text(encoding="utf-8")) != digest:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        state.write_text(json.dumps(digest), encoding="utf-8")
    return folder


def encode_segment(
    program: str,
    folder: Path,
    segment: Segment,
    settings: FilmSettings,
    picture: Callable[[int], Image.Image],
) -> None:
    """Write one segment, aside first.

    Args:
        program: ffmpeg.
        folder: Where the segments are.
        segment: Which one.
        settings: Size and frames a second.
        picture: A frame, RGB, by its number.

    Raises:
        InputError: The disk is full.
        StageError: ffmpeg or what draws failed.
    """
    aside = folder / f"{segment.name}.new"
    group = SEGMENT_S * settings.fps
    arguments = [
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{settings.width}x{settings.height}"),
        *("-framerate", str(settings.fps), "-i", "pipe:0"),
        *("-vf", _COLOUR),
        *("-c:v", H264, "-preset", "medium", "-crf", str(_CRF), "-threads", str(_THREADS)),
        *("-g", str(group), "-keyint_min", str(group), "-sc_threshold", "0"),
        *BITEXACT,
        *("-f", "mp4", aside.name),
    ]
    with fed(program, arguments, folder, f"film: frames {segment.first} to {segment.last}") as sink:
        for frame in range(segment.first, segment.last):
            sink.write(picture(frame).tobytes())
    aside.replace(folder / segment.name)


def join_segments(
    program: str, folder: Path, segments: tuple[Segment, ...], sound: Path | None, target: str
) -> None:
    """Join all segments to one film, as they are, with its sound track if there is one.

    Raises:
        InputError: The disk is full.
        StageError: ffmpeg failed.
    """
    listed = "".join(f"file '{segment.name}'\n" for segment in segments)
    (folder / "segments.txt").write_text(listed, encoding="utf-8")
    arguments = [
        *("-f", "concat", "-i", "segments.txt"),
        *(("-i", sound.name, "-map", "0:v", "-map", "1:a") if sound else ()),
        *("-c", "copy", *BITEXACT, "-movflags", "+faststart", target),
    ]
    run(program, arguments, folder, "film")
