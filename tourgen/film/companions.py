"""Companions of a film: a poster, and a short silent loop for a website."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tourgen.film.ffmpeg import BITEXACT, H264, run

_LOOP_S: Final = 6.0
_BLEND_S: Final = 1.0
"""In which the loop's end becomes its start."""

_LOOP_WIDTH: Final = 960
_LOOP_FPS: Final = 30


def write_poster(program: str, folder: Path, film: str, second: float, target: str) -> None:
    """One picture of a film, WebP; errors as of `ffmpeg.run`."""
    taken = ("-ss", f"{second:.3f}", "-i", film, "-frames:v", "1")
    packed = ("-c:v", "libwebp", "-quality", "86", *BITEXACT, target)
    run(program, [*taken, *packed], folder, "poster")


def write_loop(
    program: str, folder: Path, film: str, start_s: float, film_s: float, target: str
) -> None:
    """A piece of a film whose end blends into its start.

    Args:
        program: ffmpeg.
        folder: Of the film and the loop.
        film: Name of the film.
        start_s: Where the piece starts, if the film is long enough.
        film_s: How long the film is.
        target: Name of the loop.

    Raises:
        InputError: The disk is full.
        StageError: ffmpeg failed.
    """
    length = min(_LOOP_S + _BLEND_S, film_s)
    start = max(0.0, min(start_s, film_s - length))
    blend = min(_BLEND_S, length / 3)
    fit = f"fps={_LOOP_FPS},scale='min({_LOOP_WIDTH},iw)':-2,settb=AVTB"
    chain = (
        f"[0:v]trim={start:.3f}:{start + length:.3f},setpts=PTS-STARTPTS,{fit},split[a][b];"
        f"[a]trim={blend:.3f},setpts=PTS-STARTPTS[body];"
        f"[b]trim=end={blend:.3f},setpts=PTS-STARTPTS[head];"
        f"[body][head]xfade=fade:{blend:.3f}:{length - 2 * blend:.3f},format=yuv420p[out]"
    )
    arguments = [
        *("-i", film, "-filter_complex", chain, "-map", "[out]", "-an"),
        *("-c:v", H264, "-preset", "slow", "-crf", "27", "-threads", "4"),
        *BITEXACT,
        *("-movflags", "+faststart", target),
    ]
    run(program, arguments, folder, "loop")
