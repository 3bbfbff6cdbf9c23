"""What was found in a room, as plain data that a later run can read."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from surface_score import Figures

PUBLISHED, EXACT = "published", "exact"
OURS = (PUBLISHED, "auto")
"""Who has to beat the peers; the first that there is."""
DUELS = ("f_score_5mm", "psnr_db")
"""Higher is better; a room is won by these."""


@dataclass(frozen=True)
class Try:
    """One setting of a peer.

    Attributes:
        program: The peer.
        setting: In words.
        f_score_5mm: Of its mesh; None where there is none.
        why: Not; "" where there is one.
    """

    program: str
    setting: str
    f_score_5mm: float | None
    why: str = ""


@dataclass(frozen=True)
class Sheet:
    """Pictures of one camera, side by side.

    Attributes:
        file: Its name.
        names: Who is seen, in reading order.
    """

    file: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class RoomResult:
    """All that was found in a room.

    Attributes:
        room: Its id.
        about: Why it is shown where it is not judged; "" where it is.
        columns: Figures by contestant.
        settings: The setting of each peer's column.
        tries: Every setting of every peer.
        refused: Methods that would not, with their reasons.
        told: What methods say of their surface.
        cleaning: What cleaning did to the scan, by its format.
        checks: Figures of the room that are no contestant's.
        sheets: Of the cameras that are shown.
    """

    room: str
    about: str = ""
    columns: Mapping[str, Figures] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)
    tries: Sequence[Try] = ()
    refused: Mapping[str, str] = field(default_factory=dict)
    told: Mapping[str, str] = field(default_factory=dict)
    cleaning: Mapping[str, Figures] = field(default_factory=dict)
    checks: Figures = field(default_factory=dict)
    sheets: Sequence[Sheet] = ()

    @property
    def own(self) -> str:
        """Our column that is held against the peers."""
        return next(name for name in OURS if name in self.columns)

    @property
    def methods(self) -> list[str]:
        """Our methods that drew a surface from the scan."""
        others = (*self.settings, PUBLISHED, EXACT)
        return [
            name for name, each in self.columns.items() if name not in others and DUELS[0] in each
        ]

    @property
    def peers(self) -> dict[str, Figures]:
        """The peers' columns."""
        return {name: self.columns[name] for name in self.settings}

    @property
    def lost(self) -> list[str]:
        """Where a peer is as good or better, in words."""
        mine = {} if self.about else self.columns[self.own]
        return [
            f"{self.room}: {key}: {self.own} {mine[key]:.4g}, {name} {theirs[key]:.4g}"
            for name, theirs in self.peers.items()
            for key in DUELS
            if key in mine and key in theirs and mine[key] <= theirs[key]
        ]

    @property
    def won(self) -> bool:
        """Whether no peer is as good by F-score at 5 mm or PSNR."""
        return not self.lost


def save(result: RoomResult, file: Path) -> None:
    """Keep a result."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(asdict(result), indent=1), encoding="utf-8")


def saved(file: Path) -> RoomResult:
    """A result that was kept."""
    told = json.loads(file.read_text(encoding="utf-8"))
    told["tries"] = tuple(Try(**each) for each in told["tries"])
    told["sheets"] = tuple(Sheet(each["file"], tuple(each["names"])) for each in told["sheets"])
    return RoomResult(**told)
