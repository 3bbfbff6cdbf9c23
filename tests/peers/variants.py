"""The tour as each method builds it: a folder beside, whose tour.toml names the method."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

GALLERY_TOUR = """[tour]
title = { en = "Gallery" }
languages = ["en"]
start = "gallery_sim"

[[room]]
id = "gallery_sim"
title = { en = "Gallery" }
scans = ["scans/scan_structured.e57"]
"""


def gallery_tour(gallery: Path, scratch: Path) -> Path:
    """A tour's folder with the gallery alone."""
    folder = scratch / "gallery"
    folder.mkdir(parents=True, exist_ok=True)
    _link(folder / "scans", gallery)
    (folder / "tour.toml").write_text(GALLERY_TOUR, encoding="utf-8")
    return folder


def built(tour: Path, name: str, room: str, scratch: Path, method: str | None = None) -> Path | str:
    """The site of a tour of one room; why not, where it cannot be built.

    Args:
        tour: With scans and tour.toml.
        name: Of the variant.
        room: To be built.
        scratch: Keeps the variant's folder, and so its cache.
        method: For ``room.surface.method``; none: ``name``, "": as the tour says.
    """
    folder = scratch / "variants" / f"{room}-{name}"
    folder.mkdir(parents=True, exist_ok=True)
    for part in ("scans", "texts"):
        if (tour / part).exists():
            _link(folder / part, tour / part)
    told = alone((tour / "tour.toml").read_text(encoding="utf-8"), room)
    chosen = name if method is None else method
    told = with_method(told, chosen) if chosen else told
    (folder / "tour.toml").write_text(told, encoding="utf-8")
    program = Path(sys.executable).with_name("tourgen")
    ran = subprocess.run(
        [program, "build", str(folder)], check=False, stderr=subprocess.PIPE, text=True
    )
    if ran.returncode:
        lines = [line for line in ran.stderr.splitlines() if line.startswith("error: ")]
        return lines[0].removeprefix("error: ") if lines else ran.stderr.strip()[-200:]
    return folder / "site"


def alone(told: str, room: str) -> str:
    """tour.toml with one room, and without doors to others."""
    head, *rooms = told.split("[[room]]\n")
    mine = next(each for each in rooms if f'id = "{room}"' in each)
    body, *tables = mine.split("\n[[room.")
    kept = [table for table in tables if not table.startswith("link]]")]
    lines = [
        f'start = "{room}"' if line.startswith("start =") else line for line in head.split("\n")
    ]
    return "\n".join(lines) + "[[room]]\n" + "\n[[room.".join([body, *kept])


def with_method(told: str, method: str) -> str:
    """tour.toml of one room with its surface made by a method; its other settings stay."""
    line = f'method = "{method}"'
    if "[room.surface]" not in told:
        return f"{told.rstrip()}\n\n[room.surface]\n{line}\n"
    before, after = told.split("[room.surface]", 1)
    table, *rest = after.split("\n[")
    kept = [each for each in table.splitlines() if not each.strip().startswith("method")]
    return "\n[".join([f"{before}[room.surface]\n{line}" + "\n".join(kept), *rest])


def _link(link: Path, target: Path) -> None:
    if not link.is_symlink():
        link.symlink_to(target.resolve(), target_is_directory=True)
