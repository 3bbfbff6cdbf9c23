"""Settings: what is asked of a film."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from tourgen.errors import InputError

_LEAST: Final = (320, 180)
_MOST: Final = (7680, 4320)


@dataclass(frozen=True, slots=True)
class FilmSettings:
    """What is asked of a film.

    Attributes:
        width: Pixels, even.
        height: Pixels, even.
        fps: Frames a second.
        language: Of titles and captions; "" for the tour's first.
        captions: Whether they are written into the picture, too.
        sound: Whether there is a sound track.
        part: First and last second of what is made; None for all.
    """

    width: int = 1920
    height: int = 1080
    fps: int = 30
    language: str = ""
    captions: bool = False
    sound: bool = False
    part: tuple[float, float] | None = None


def parse_size(text: str) -> tuple[int, int]:
    """Width and height of a picture, pixels.

    Args:
        text: As in ``1920x1080``.

    Raises:
        InputError: It says no size that H.264 can hold.
    """
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text.strip().lower())
    if found is None:
        raise InputError(
            f"--size: expected WIDTHxHEIGHT in pixels, found `{text}`", "--size 1920x1080"
        )
    width, height = int(found[1]), int(found[2])
    if width % 2 or height % 2:
        even = f"{width + width % 2}x{height + height % 2}"
        raise InputError(
            f"--size: expected even numbers, as H.264 needs them, found {width}x{height}",
            f"--size {even}",
        )
    if not (_LEAST[0] <= width <= _MOST[0] and _LEAST[1] <= height <= _MOST[1]):
        raise InputError(
            f"--size: expected {_LEAST[0]}x{_LEAST[1]} to {_MOST[0]}x{_MOST[1]}, "
            f"found {width}x{height}",
            "--size 1920x1080",
        )
    return width, height


def parse_part(text: str) -> tuple[float, float]:
    """First and last second of a part.

    Args:
        text: As in ``12-15.5``.

    Raises:
        InputError: It says no part.
    """
    found = re.fullmatch(r"(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?)", text.strip())
    if found is None or float(found[1]) >= float(found[2]):
        raise InputError(
            f"--part: expected two seconds, the later one last, found `{text}`", "--part 12-15"
        )
    return float(found[1]), float(found[2])
