"""Film: the guided path of a published tour as a video, drawn by its own viewer.

One frame after the other, each drawn when all tiles are there that it shows, so that the film is
the same on every machine, however slow. What is there stays there: a run that was killed goes on.
"""

from __future__ import annotations

import errno
import math
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from PIL import Image

from tourgen import __version__
from tourgen.errors import Faults, InputError
from tourgen.film.camera import open_camera, require_camera
from tourgen.film.companions import write_loop, write_poster
from tourgen.film.ffmpeg import disk_full, require_ffmpeg
from tourgen.film.progress import FrameBar
from tourgen.film.segments import (
    Segment,
    digest_of,
    encode_segment,
    join_segments,
    segments_of,
    work_folder,
)
from tourgen.film.settings import FilmSettings
from tourgen.film.soundtrack import mix_sounds, sounds_of
from tourgen.film.stops import Json, blocked_faults, read_path
from tourgen.film.subtitles import vtt_of

SUFFIX: Final = ".mp4"

_FILM: Final = "film.mp4"
_POSTER: Final = "film.webp"
_LOOP: Final = "film.loop.mp4"


def make_film(site: Path, output: Path, settings: FilmSettings, bar: FrameBar) -> tuple[Path, ...]:
    """Film a published tour.

    Args:
        site: The site's folder.
        output: The film; poster, loop and captions are written beside it, by its name.
        settings: What is asked for.
        bar: Told of every frame.

    Returns:
        All that was written, the film first.

    Raises:
        MissingTool: A library is not installed.
        InputError: The path cannot be filmed, Chromium or H.264 are not there, the disk is full.
        StageError: Chromium, the viewer or ffmpeg failed.
    """
    _check_output(output)
    tour = read_path(site, settings.language)
    program = require_ffmpeg()
    require_camera()
    try:
        folder = work_folder(output, digest_of(site, [__version__, asdict(settings)]))
        work = _Work(site, folder, program, settings)
        plan, segments = _shoot(work, bar)
        return _published(folder, output, _finish(work, tour, plan, segments))
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise disk_full(output.parent) from error
        if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise InputError(
                f"`{error.filename}`: expected to be allowed to write it, found: {error.strerror}",
                "choose another folder with -o",
            ) from error
        raise


@dataclass(frozen=True, slots=True)
class _Work:
    """What every step of a film needs.

    Attributes:
        site: The site's folder.
        folder: Where everything waits until all is there.
        program: ffmpeg.
        settings: What is asked for.
    """

    site: Path
    folder: Path
    program: str
    settings: FilmSettings


def _check_output(output: Path) -> None:
    if output.suffix != SUFFIX:
        raise InputError(
            f"-o: expected a file named *{SUFFIX}, found `{output}`",
            f"-o {output.with_suffix(SUFFIX)}",
        )
    if not output.parent.is_dir():
        raise InputError(f"-o: expected the folder `{output.parent}`, found none", "make it first")
    if output.is_dir():
        raise InputError(f"-o: expected a file, found the folder `{output}`", "name another")


def _shoot(work: _Work, bar: FrameBar) -> tuple[Json, tuple[Segment, ...]]:
    """Draw and encode what is not there yet."""
    fps = work.settings.fps
    with open_camera(work.site, work.settings) as camera:
        plan = camera.plan
        blocked = blocked_faults(plan["blocked"])
        if blocked:
            raise Faults(tuple(blocked))
        first, last = _frames(plan, work.settings)
        segments = segments_of(first, last, fps)
        lacking = [each for each in segments if not (work.folder / each.name).is_file()]
        bar.resume(last - first - sum(each.last - each.first for each in lacking), last - first)

        def picture(frame: int) -> Image.Image:
            taken = camera.picture(frame / fps)
            bar.advance()
            return taken

        for segment in lacking:
            encode_segment(work.program, work.folder, segment, work.settings, picture)
            bar.segment()
    return plan, segments


def _frames(plan: Json, settings: FilmSettings) -> tuple[int, int]:
    """Number of the first frame, and of the one after the last."""
    count = math.ceil(plan["seconds"] * settings.fps)
    if settings.part is None:
        return 0, count
    first, last = (round(second * settings.fps) for second in settings.part)
    if first >= min(last, count):
        raise InputError(
            f"--part: expected frames within the film's {plan['seconds']:.0f} s, found none",
            "choose seconds that it has, as `--part 0-3`",
        )
    return first, min(last, count)


def _finish(work: _Work, tour: Json, plan: Json, segments: tuple[Segment, ...]) -> list[str]:
    """Join the segments and write what goes with the film; the names of all, the film's first."""
    program, folder, fps = work.program, work.folder, work.settings.fps
    start_s, end_s = segments[0].first / fps, segments[-1].last / fps
    sound = folder / "sound.m4a" if work.settings.sound else None
    if sound:
        mix_sounds(program, work.site, sounds_of(tour, plan["stays"]), (start_s, end_s), sound)
    join_segments(program, folder, segments, sound, _FILM)
    clear_s = plan["clear"] if start_s <= plan["clear"] < end_s else (start_s + end_s) / 2
    write_poster(program, folder, _FILM, clear_s - start_s, _POSTER)
    write_loop(program, folder, _FILM, clear_s - start_s, end_s - start_s, _LOOP)
    captions = {f"film.{language}.vtt": cues for language, cues in plan["cues"].items()}
    for name, cues in captions.items():
        (folder / name).write_text(vtt_of(cues, start_s, end_s), encoding="utf-8")
    return [_FILM, _POSTER, _LOOP, *captions]


def _published(folder: Path, output: Path, names: list[str]) -> tuple[Path, ...]:
    """Move all into its place, and drop the folder where it waited."""
    targets = tuple(output.with_name(output.stem + name.removeprefix("film")) for name in names)
    for name, target in zip(names, targets, strict=True):
        (folder / name).replace(target)
    shutil.rmtree(folder, ignore_errors=True)
    return targets
