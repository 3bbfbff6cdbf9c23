"""ffmpeg: found, asked for H.264, and what it complains of said in one line."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Final

from tourgen.errors import InputError, MissingTool, StageError, TourgenError

H264: Final = "libx264"

BITEXACT: Final = ("-fflags", "+bitexact", "-flags", "+bitexact", "-map_metadata", "-1")
"""No versions or dates in what is written: the same film is the same file."""

_FULL: Final = "No space left on device"


def require_ffmpeg() -> str:
    """The ffmpeg that came with imageio-ffmpeg, or that ``IMAGEIO_FFMPEG_EXE`` names.

    Raises:
        MissingTool: The library that brings it is not installed.
        InputError: It is not there, or cannot write H.264.
    """
    if find_spec("imageio_ffmpeg") is None:
        raise MissingTool(
            "film: expected imageio-ffmpeg, found none", 'python3 -m pip install "tourgen[film]"'
        )
    from imageio_ffmpeg import get_ffmpeg_exe

    try:
        program = str(get_ffmpeg_exe())
        asked = [program, "-hide_banner", "-encoders"]
        listed = subprocess.run(asked, capture_output=True, text=True, check=True).stdout
    except (RuntimeError, OSError, subprocess.SubprocessError) as error:
        raise InputError(
            "film: expected an ffmpeg that runs, found none",
            'python3 -m pip install --force-reinstall "imageio-ffmpeg"',
        ) from error
    if not any(H264 in line.split() for line in listed.splitlines()):
        raise InputError(
            f"film: expected an ffmpeg with {H264}, for H.264, found `{program}` without",
            "unset IMAGEIO_FFMPEG_EXE, so that the one of imageio-ffmpeg is taken",
        )
    return program


def run(program: str, arguments: Sequence[str], folder: Path, subject: str) -> None:
    """Run ffmpeg to its end.

    Args:
        program: What runs.
        arguments: Beside those that keep it quiet.
        folder: Where; file names are seen from there.
        subject: What it makes, for its errors.

    Raises:
        InputError: The disk is full.
        StageError: It failed.
    """
    with fed(program, arguments, folder, subject):
        pass


@contextmanager
def fed(program: str, arguments: Sequence[str], folder: Path, subject: str) -> Iterator[IO[bytes]]:
    """Run ffmpeg on what is written to it; arguments and errors as of `run`."""
    command = [program, "-hide_banner", "-loglevel", "error", "-y", *arguments]
    with TemporaryFile() as said:
        process = subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE, stderr=said)
        assert process.stdin is not None
        try:
            yield process.stdin
            process.stdin.close()
        except BrokenPipeError:
            pass  # it ended before its time, and says why
        except BaseException:
            process.kill()
            process.wait()
            raise
        if process.wait():
            said.seek(0)
            raise _fault(said.read().decode(errors="replace"), folder, subject)


def _fault(said: str, folder: Path, subject: str) -> TourgenError:
    if _FULL in said:
        return disk_full(folder)
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    return StageError(f"{subject}: ffmpeg: {lines[0] if lines else 'ended without a word'}")


def disk_full(folder: Path) -> InputError:
    """What is said when nothing more can be written."""
    return InputError(
        f"disk of `{folder}`: expected room for the film, found none left",
        "free some and run the same line again: it goes on where it stopped",
    )
