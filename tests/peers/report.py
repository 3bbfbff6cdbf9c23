"""What ``fidelity`` found, as tables and as pictures side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from aims import aims_table
from programs import ATTEMPTS
from results import RoomResult, Sheet
from sections import rewrite

from tourgen.geometry import UInt8

HEADING = "Fidelity"
SHOWN_CAMERAS = 2
"""So many, those that see most."""
SHOWN_SIZE = (640, 360)
ASIDE = 2
"""Pictures in a row."""
QUALITY = 70
PREAMBLE = """Made by `make bench-fidelity FULL=1` from the demo, and from the gallery where it is
at hand; with it chamber2 has all its 15 million points, of which it has a tenth in other sections.
Every column is one surface of the same scan: `published` is the tour's site as it stands, then
follow the methods of `room.surface.method`, each with this tour.toml as far as the finest level of
detail; `exact`: drawn by the same stages from the same points, put on the true surface with its
normals, in the scan's true colours, so that what is lost there is lost for want of points; and the
best of three settings of each peer. `oracle`: the scan's true points in true colours, baked onto
the true mesh by the same stages; `panoramas`: the room published from its E57, coloured by the
panoramas in it; `oracle-panoramas`: these on the true mesh. Peers get the scan cropped to the room,
drop outliers by their own filter, find normals by their own, and have these turned towards the true
stations for them; Poisson's invented surface is cut by density. In the pictures `scan` is the cloud
as it came: before anything was done; `truth` is what there was to find.

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
  station sees it. `openings`: of the area of doors and windows, 20 mm within their rims, the share
  that one sees straight through, in all and of the worst; `outlook`: of the directions in which a
  station sees no surface, the share without mesh.
- `psnr` and `ssim`: ten views a room of 960 x 540 pixels, in Chromium, against the textured
  truth; glass, mirror and lamp masked, one gain a channel and room fitted first. Peers are
  decimated and coloured by their own chain to the bytes of the published room, and drawn by ray
  casting. `seam`: step of the error, of 255, where the set of stations that see a surface
  changes, in one-coloured places where the surface lies within 5 mm of the true one: averaged
  over the room for each two sets (`seam_max`, `seam_median`), over one view (`seam_view_max`).
  `squares`: share of the plaque's squares told apart in a view from 1.5 m, and their contrast
  over the truth's.
"""
ASKED = """By the lines of what was asked: our figure, whether it holds, and in brackets the best
peer's where ours has to be better. What is not measured in a room is left out.
"""


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
    notes = [f"- `{method}` refuses: {why}." for method, why in result.refused.items()]
    notes += [f"- `{method}`: {told}." for method, told in result.told.items()]
    if len(result.methods) > 1:
        first = max(result.methods, key=lambda name: result.columns[name]["f_score_5mm"])
        notes.append(f"- By F-score at 5 mm the best method is `{first}`.")
    return "\n".join([*lines, *([""] if notes else []), *notes, ""])


def _shown(key: str, value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return ""
    if isinstance(value, int) or float(value).is_integer():
        return f"{value:,.0f}"
    digits = 4 if any(word in key for word in ("share", "precision", "recall", "score")) else 2
    return f"{value:.{digits + (key in ('ssim', 'normal_agreement'))}f}"


def write(results: Sequence[RoomResult], file: Path) -> None:
    """Rewrite the section of a Markdown file.

    Args:
        results: Of all rooms; their sheets lie in ``pictures/`` beside the file.
        file: The Markdown.
    """
    parts = [PREAMBLE, "### What was asked\n", ASKED, aims_table(results)]
    for result in results:
        parts.append(f"### {result.room}\n")
        parts += [f"{result.about}\n"] if result.about else []
        parts.append(table(result))
        for sheet in result.sheets:
            parts.append(f"{', '.join(sheet.names)}:\n\n![{result.room}](pictures/{sheet.file})\n")
    parts.append(_cleaning(results))
    parts.append(_tries(results))
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
        "point within 10 mm, what has none any more. The gallery's PLY is its E57 shuffled,",
        "without stations; of the stair's the places of its stations are told, as in tour.toml.\n",
        f"| | {' | '.join(scans)} |",
        f"|---|{'---|' * len(scans)}",
    ]
    for name in names:
        cells = [f"{scans[scan][name]:.4f}" if name in scans[scan] else "" for scan in scans]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _tries(results: Sequence[RoomResult]) -> str:
    """The F-score at 5 mm of every setting of every peer, or why it has none."""
    rooms = [result for result in results if result.tries]
    if not rooms:
        return ""
    lines = [
        "### Settings of the peers\n\nF-score at 5 mm.\n",
        f"| program | setting | {' | '.join(result.room for result in rooms)} |",
        f"|---|---|{'---|' * len(rooms)}",
    ]
    for attempt in ATTEMPTS:
        cells = " | ".join(_try(result, attempt.program, attempt.setting) for result in rooms)
        lines.append(f"| {attempt.program} | {attempt.setting} | {cells} |")
    return "\n".join(lines)


def _try(result: RoomResult, program: str, setting: str) -> str:
    return next(
        (
            each.why if each.f_score_5mm is None else f"{each.f_score_5mm:.4f}"
            for each in result.tries
            if (each.program, each.setting) == (program, setting)
        ),
        "",
    )


def side_by_side(pictures: Mapping[str, UInt8], file: Path) -> Sheet:
    """Save pictures with the names of what they show."""
    from PIL import Image, ImageDraw, ImageFont

    width, height = SHOWN_SIZE
    rows = -(-len(pictures) // ASIDE)
    sheet = Image.new("RGB", (ASIDE * width, rows * height), "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=20)
    for place, (name, picture) in enumerate(pictures.items()):
        left, top = place % ASIDE * width, place // ASIDE * height
        shown = Image.fromarray(np.asarray(picture)).resize(SHOWN_SIZE, Image.Resampling.LANCZOS)
        sheet.paste(shown, (left, top))
        box = pen.textbbox((left + 12, top + 10), name, font=font)
        pen.rectangle((box[0] - 6, box[1] - 4, box[2] + 6, box[3] + 4), fill="black")
        pen.text((left + 12, top + 10), name, font=font, fill="white")
    file.parent.mkdir(parents=True, exist_ok=True)
    sheet.save(file, quality=QUALITY, method=6)
    return Sheet(file.name, tuple(pictures))
