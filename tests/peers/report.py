"""What ``fidelity`` found, as tables and as pictures side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from programs import ATTEMPTS
from sections import rewrite
from surface_score import Figures

from tourgen.geometry import UInt8

HEADING = "Fidelity"
OURS = ("auto", "published")
"""Who has to beat the peers; the first that there is."""
SHOWN_CAMERAS = (0, 7)
SHOWN_SIZE = (640, 360)
QUALITY = 70
PREAMBLE = """Made by `make bench-fidelity` from the demo, and from the gallery where it is at hand.
Every column is one surface of the same scan: `published` is the tour's site as it stands, then
follow the methods of `room.surface.method`, each built with this tour.toml, and the best of three
settings of each peer. Peers get the scan within the same `keep` and `remove` boxes, drop
outliers by their own filter, find normals by their own, and have these turned towards the true
stations for them; Poisson's invented surface is cut by density.

- `precision` and `recall` at a distance are shares of the mesh near the truth, and of the truth
  that a station sees near the mesh; the F-score is their harmonic mean. Mesh over 30 mm behind
  what every station sees is not judged. `normal_agreement` is the mean cosine to the true
  normal. `inferred_share`: of the mesh's area, what stands for surface that no station saw.
- `walls`, `floor` and `table`: residual to the true plane and angle to it, root mean square.
  `crease`: distance of the mesh's own creases from the true ones, and the share within 4 mm.
  `rails`: the bed's and the stair's rods of 20 mm, the share of them with mesh within 5 mm, and
  how many are broken, that is lack two slices of 10 mm in a row.
- `discs`: of what truly lies under the tripods, the share that is closed (mesh before it or less
  than 100 mm behind) and true (within 20 mm), in all, under the worst, and (`blind`) where no
  station sees it. `openings`: of the area of doors and windows,
  20 mm within their rims, the share that one sees straight through, in all and of the worst;
  `outlook`: of the directions in which a station sees no surface, the share without mesh.
- `psnr` and `ssim`: ten views a room of 960 x 540 pixels, in Chromium, against the textured
  truth; glass, mirror and lamp masked, one gain a channel and room fitted first. Peers are
  decimated and coloured by their own chain to the bytes of the published room, and drawn by ray
  casting. `seam`: step of the error, of 255, where the set of stations that see a surface
  changes, in one-coloured places where the surface lies within 5 mm of the true one: averaged
  over the room for each two sets (`seam_max`, `seam_median`), over one view (`seam_view_max`).
  `squares`: share of the plaque's squares told apart in a view from 1.5 m, and their contrast
  over the truth's.
"""


@dataclass(frozen=True)
class RoomResult:
    """All that was found in a room.

    Attributes:
        room: Its id.
        columns: Figures by contestant.
        settings: The setting of each peer's column.
        attempts: Program, setting and figures of every attempt.
        refused: Methods that would not, with their reasons.
        cleaning: What cleaning did to the scan, by its format.
        pictures: By contestant, and of "truth"; empty where none were taken.
    """

    room: str
    columns: Mapping[str, Figures]
    settings: Mapping[str, str]
    attempts: Sequence[tuple[str, str, Figures]]
    refused: Mapping[str, str]
    cleaning: Mapping[str, Figures]
    pictures: Mapping[str, Sequence[UInt8]]

    @property
    def own(self) -> str:
        """Our column that is held against the peers."""
        return next(name for name in OURS if name in self.columns)

    @property
    def won(self) -> bool:
        """Whether no peer has a higher F-score at 5 mm or PSNR."""
        mine = self.columns[self.own]
        theirs = [self.columns[name] for name in self.settings]
        return all(
            mine[key] > other[key]
            for other in theirs
            for key in ("f_score_5mm", "psnr_db")
            if key in mine and key in other
        )


def table(result: RoomResult) -> str:
    """One row a figure, one column a contestant; Markdown."""
    names = list(result.columns)
    figures = list(dict.fromkeys(key for each in result.columns.values() for key in each))
    lines = [f"| {result.room} | {' | '.join(names)} |", f"|---|{'---|' * len(names)}"]
    if result.settings:
        settings = " | ".join(result.settings.get(name, "") for name in names)
        lines.append(f"| setting | {settings} |")
    for key in figures:
        cells = " | ".join(_shown(key, result.columns[name].get(key)) for name in names)
        lines.append(f"| {key} | {cells} |")
    refusals = [f"`{method}` refuses: {why}." for method, why in result.refused.items()]
    return "\n".join([*lines, *([""] if refusals else []), *refusals, ""])


def _shown(key: str, value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return ""
    if isinstance(value, int) or float(value).is_integer():
        return f"{value:,.0f}"
    digits = 4 if any(word in key for word in ("share", "precision", "recall", "score")) else 2
    return f"{value:.{digits + (key in ('ssim', 'normal_agreement'))}f}"


def write(results: Sequence[RoomResult], file: Path) -> None:
    """Rewrite the section of a Markdown file, and the pictures in ``pictures/`` beside it."""
    parts = [PREAMBLE]
    for result in results:
        parts.append(f"### {result.room}\n\n{table(result)}")
        for number in SHOWN_CAMERAS if result.pictures else ():
            name = f"fidelity-{result.room}-{number}.webp"
            names = _side_by_side(result, number, file.parent / "pictures" / name)
            parts.append(f"{' | '.join(names)}:\n\n![{result.room}](pictures/{name})\n")
    parts.append(_cleaning(results))
    parts.append(_attempts(results))
    rewrite(file, HEADING, "\n".join(parts))


def _cleaning(results: Sequence[RoomResult]) -> str:
    """What cleaning did to every scan."""
    scans = {
        f"{result.room}.{kind}": figures
        for result in results
        for kind, figures in result.cleaning.items()
    }
    names = list(dict.fromkeys(name for figures in scans.values() for name in figures))
    lines = [
        "### Cleaning\n",
        "Share of each label that is gone, without any box: from the E57 the station of each",
        "point is known, from the merged PLY it is not. Mixed pixels count where they lie over",
        "10 mm off the true surface. `lost`: of the true area that a station sees and that had a",
        "point within 10 mm, what has none any more.\n",
        f"| | {' | '.join(scans)} |",
        f"|---|{'---|' * len(scans)}",
    ]
    for name in names:
        cells = [f"{scans[scan][name]:.4f}" if name in scans[scan] else "" for scan in scans]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _attempts(results: Sequence[RoomResult]) -> str:
    """The F-score at 5 mm of every setting of every peer."""
    found = {
        (program, setting): each
        for attempt in ATTEMPTS
        for program, setting in [(attempt.program, attempt.setting)]
        if (each := _f_scores(results, program, setting))
    }
    if not found:
        return ""
    rooms = [result.room for result in results]
    lines = [
        "### Settings of the peers\n\nF-score at 5 mm.\n",
        f"| program | setting | {' | '.join(rooms)} |",
        f"|---|---|{'---|' * len(rooms)}",
    ]
    for (program, setting), scores in found.items():
        cells = " | ".join(f"{scores[room]:.4f}" if room in scores else "" for room in rooms)
        lines.append(f"| {program} | {setting} | {cells} |")
    return "\n".join(lines)


def _f_scores(results: Sequence[RoomResult], program: str, setting: str) -> dict[str, float]:
    return {
        result.room: figures["f_score_5mm"]
        for result in results
        for name, how, figures in result.attempts
        if (name, how) == (program, setting)
    }


def _side_by_side(result: RoomResult, number: int, file: Path) -> list[str]:
    """Save one camera's pictures, two in a row; who is seen, in reading order."""
    from PIL import Image

    names = ["truth", result.own, *result.settings]
    width, height = SHOWN_SIZE
    rows = -(-len(names) // 2)
    sheet = Image.new("RGB", (2 * width, rows * height), "white")
    for place, name in enumerate(names):
        picture = Image.fromarray(np.asarray(result.pictures[name][number]))
        at = (place % 2 * width, place // 2 * height)
        sheet.paste(picture.resize(SHOWN_SIZE, Image.Resampling.LANCZOS), at)
    file.parent.mkdir(exist_ok=True)
    sheet.save(file, quality=QUALITY, method=6)
    return names
