"""What was asked of the reconstruction, figure by figure, and whether it holds.

The numbers of the lines are those of "Shows" in the issue that asked for the bench.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

from cleaning import GOALS, LOST
from orientation import GOAL_RIGHT, GOAL_SECONDS_A_MILLION
from registration import GOAL_DEG, GOAL_MM
from results import RoomResult
from surface_score import Figures

ORACLE, PANORAMAS = "oracle", "panoramas"
LINES = {
    1: "surface",
    2: "cleaning",
    3: "pictures",
    4: "normals",
    5: "stations",
    6: "gaps",
    7: "planes, edges",
    8: "panoramas",
    9: "plaque",
}


@dataclass(frozen=True)
class Aim:
    """A figure and what it has to be.

    Attributes:
        line: Of what was asked.
        figure: Its name.
        least: At least this.
        most: At most this.
        beats: Better than every peer's, too.
        rooms: Only in these; none: wherever it is measured.
    """

    line: int
    figure: str
    least: float | None = None
    most: float | None = None
    beats: bool = False
    rooms: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The goal."""
        limit = ([f"≥ {self.least:g}"] if self.least is not None else []) + (
            [f"≤ {self.most:g}"] if self.most is not None else []
        )
        return ", ".join(limit + (["better than peers"] if self.beats else []))


AIMS = (
    Aim(1, "accuracy_median_mm", most=1.5),
    Aim(1, "accuracy_p95_mm", most=5),
    Aim(1, "recall_10mm", least=0.99),
    Aim(1, "f_score_5mm", beats=True),
    *(
        Aim(2, f"{kind}: {label} gone", least=share)
        for kind, shares in GOALS.items()
        for label, share in shares.items()
    ),
    *(Aim(2, f"{kind}: lost", most=LOST) for kind in GOALS),
    Aim(3, "psnr_db", least=28, beats=True),
    Aim(3, "ssim", least=0.9),
    Aim(3, "psnr_below_oracle_db", most=2),
    Aim(3, "seam_max", most=2),
    Aim(4, "normals_right", least=GOAL_RIGHT),
    Aim(4, "turning_s_a_million", most=GOAL_SECONDS_A_MILLION),
    Aim(5, "stations_apart_mm", most=GOAL_MM),
    Aim(5, "stations_apart_deg", most=GOAL_DEG),
    Aim(6, "disc_worst_closed_share", least=0.99),
    Aim(6, "opening_worst_free_share", least=0.95),
    Aim(6, "inferred_share_off", most=0.02),
    *(
        aim
        for place in ("walls", "floor", "table")
        for aim in (
            Aim(7, f"{place}_rms_mm", most=1, beats=True),
            Aim(7, f"{place}_normals_deg", most=2, beats=True),
        )
    ),
    Aim(7, "crease_p90_mm", most=4, beats=True),
    Aim(7, "rails_broken", most=0),
    Aim(8, "panoramas_gain_db", least=3),
    Aim(9, "squares_40mm_right", least=1, rooms=("chamber1",)),
    Aim(9, "squares_20mm_right", least=1, rooms=("chamber2",)),
)


@dataclass(frozen=True)
class Verdict:
    """A figure of one room against its aim.

    Attributes:
        value: Ours.
        rival: The best peer's, where it is held against one.
        holds: Whether it is reached.
    """

    value: float
    rival: float | None
    holds: bool


def verdict(aim: Aim, result: RoomResult) -> Verdict | None:
    """How a room stands to an aim; None where it is not asked or not measured there."""
    value = figures_of(result).get(aim.figure)
    if value is None or (aim.rooms and result.room not in aim.rooms):
        return None
    holds = (aim.least is None or value >= aim.least) and (aim.most is None or value <= aim.most)
    rivals = [each[aim.figure] for each in result.peers.values() if aim.figure in each]
    if not (aim.beats and rivals):
        return Verdict(value, None, holds)
    rival = max(rivals) if aim.most is None else min(rivals)
    better = value > rival if aim.most is None else value < rival
    return Verdict(value, rival, holds and better)


def figures_of(result: RoomResult) -> Figures:
    """All figures of a room that aims may name."""
    columns = result.columns
    mine = columns[result.own]
    found = {**mine, **result.checks}
    for kind, shares in result.cleaning.items():
        found |= {f"{kind}: {name} gone": share for name, share in shares.items()}
        found[f"{kind}: lost"] = shares["lost"]
    if "inferred_reported" in found:
        found["inferred_share_off"] = abs(found["inferred_reported"] - found["inferred_share"])
    if "psnr_db" in mine:
        if ORACLE in columns:
            found["psnr_below_oracle_db"] = columns[ORACLE]["psnr_db"] - mine["psnr_db"]
        if PANORAMAS in columns:
            found["panoramas_gain_db"] = columns[PANORAMAS]["psnr_db"] - mine["psnr_db"]
    return found


def aims_table(results: Sequence[RoomResult]) -> str:
    """One row an aim, one column a room: our figure, whether it holds, the best peer's."""
    judged = [result for result in results if not result.about]
    lines = [
        f"| | figure | asked | {' | '.join(each.room for each in judged)} |",
        f"|---|---|---|{'---|' * len(judged)}",
    ]
    for aim in AIMS:
        cells = [_cell(verdict(aim, result)) for result in judged]
        if any(cells):
            asked = f"{aim.line} {LINES[aim.line]} | {aim.figure} | {aim.words}"
            lines.append(f"| {asked} | {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def short_of(results: Sequence[RoomResult]) -> list[str]:
    """Every aim that does not hold, in words."""
    return list(
        chain.from_iterable(
            (
                f"{result.room}: {aim.figure}: {_number(found.value)}, asked {aim.words}"
                + (f", best peer {_number(found.rival)}" if found.rival is not None else "")
                for aim in AIMS
                if (found := verdict(aim, result)) and not found.holds
            )
            for result in results
            if not result.about
        )
    )


def _cell(found: Verdict | None) -> str:
    if found is None:
        return ""
    mark = "✓" if found.holds else "✗"
    rival = f" ({_number(found.rival)})" if found.rival is not None else ""
    return f"{mark} {_number(found.value)}{rival}"


def _number(value: float) -> str:
    return f"{value:.4g}"
