"""Subtitles: the film's captions as WebVTT, in every language of the tour."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def vtt_of(cues: Sequence[dict[str, Any]], first_s: float, last_s: float) -> str:
    """A WebVTT file.

    Args:
        cues: ``from`` and ``to``, seconds of the film, and ``text``.
        first_s: Where in the film the part starts that the file is for.
        last_s: Where it ends.
    """
    blocks = ["WEBVTT\n"]
    for cue in cues:
        start, end = max(cue["from"], first_s) - first_s, min(cue["to"], last_s) - first_s
        if start < end:
            blocks.append(f"{_clock(start)} --> {_clock(end)}\n{_escaped(cue['text'])}\n")
    return "\n".join(blocks)


def _clock(seconds: float) -> str:
    milliseconds = round(seconds * 1000)
    minutes, rest = divmod(milliseconds, 60_000)
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{rest // 1000:02d}.{rest % 1000:03d}"


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
