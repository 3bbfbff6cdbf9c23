"""Sound track: the sounds of notes, each while the film stays before its note."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tourgen.film.ffmpeg import BITEXACT, run

NEAR_M: Final = 0.5
"""Who looks at a place so near to a note stands before it."""

_FADE_S: Final = 1.2
_RATE: Final = 48_000

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Played:
    """A sound in the film.

    Attributes:
        file: Below the site's folder.
        start_s: When it starts, seconds of the film.
        end_s: When it has faded at the latest.
    """

    file: str
    start_s: float
    end_s: float


def sounds_of(tour: Json, stays: Sequence[Json]) -> list[Played]:
    """The sounds of a film.

    Args:
        tour: What tour.json says.
        stays: Of the viewer's plan: ``stop``, from 0, and ``from`` and ``to``, seconds.
    """
    rooms = {room["id"]: room for room in tour["rooms"]}
    found = []
    for stay in stays:
        stop = tour["stops"][stay["stop"]]
        heard = [note for note in rooms[stop["room"]]["notes"] if note["sound"]]
        note = min(heard, key=lambda note: _apart(note, stop), default=None)
        if note is not None and _apart(note, stop) <= NEAR_M:
            found.append(Played(note["sound"], stay["from"], stay["to"] + _FADE_S))
    return found


def _apart(note: Json, stop: Json) -> float:
    return math.dist(note["at"], stop["look_at"])


def mix_sounds(
    program: str, site: Path, sounds: Sequence[Played], span_s: tuple[float, float], target: Path
) -> None:
    """Write the sound track of a part of the film; silence where nothing sounds.

    Args:
        program: ffmpeg.
        site: The site's folder.
        sounds: All of the film's.
        span_s: First and last second of the part.
        target: An ``.m4a``.

    Raises:
        InputError: The disk is full.
        StageError: ffmpeg cannot read a sound.
    """
    first, last = span_s
    heard = [sound for sound in sounds if sound.start_s < last and sound.end_s > first]
    inputs = ["-f", "lavfi", "-i", f"anullsrc=r={_RATE}:cl=stereo:d={last - first:.6f}"]
    filters, names = [], ["[0:a]"]
    for number, sound in enumerate(heard, 1):
        inputs += ["-i", str(site.resolve() / sound.file)]
        filters.append(_placed(number, sound, first))
        names.append(f"[s{number}]")
    mixed = f"{''.join(names)}amix=inputs={len(names)}:duration=first:normalize=0[out]"
    arguments = [
        *inputs,
        *("-filter_complex", ";".join([*filters, mixed]), "-map", "[out]"),
        *("-c:a", "aac", "-b:a", "160k", *BITEXACT, target.name),
    ]
    run(program, arguments, target.parent, "sound track")


def _placed(number: int, sound: Played, first_s: float) -> str:
    """The filter that puts a sound where it belongs, faded at both ends."""
    skipped = max(0.0, first_s - sound.start_s)
    length = sound.end_s - sound.start_s
    delay = round(max(0.0, sound.start_s - first_s) * 1000)
    return (
        f"[{number}:a]aresample={_RATE},aformat=channel_layouts=stereo,atrim=end={length:.3f},"
        f"afade=t=in:d=0.4,afade=t=out:st={length - _FADE_S:.3f}:d={_FADE_S},"
        f"atrim=start={skipped:.3f},asetpts=PTS-STARTPTS,adelay={delay}:all=1[s{number}]"
    )
