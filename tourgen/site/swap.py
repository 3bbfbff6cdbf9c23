"""The published tour: pages, tour.json, the viewer and the rooms' tiles, swapped in whole.

A site is written into a folder beside the published one and takes its place by two renames. A
build killed between the two leaves the old site under a hidden name, from which the next build
(or `restore_site`) puts it back: at no time is there no whole site on disk.
"""

from __future__ import annotations

import errno
import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from tourgen.errors import InputError
from tourgen.headers import headers_file
from tourgen.site.built import BuiltRoom
from tourgen.site.described import described, note_files
from tourgen.site.kiosk import code_of, kiosk_settings
from tourgen.site.offline import ICONS, MANIFEST, WORKER, icon, icon_path, manifest, worker_script
from tourgen.site.pages import Pages, viewer_folder
from tourgen.site.single import write_singles
from tourgen.tour import Tour
from tourgen.tour.theme import load_theme

_SINGLE = "single"
"""Where single files lie in the site."""

_SINGLE_SCRIPT = "single.js"
"""The viewer in one script; single files hold it, pages do not ask for it."""

Json = dict[str, Any]


def write_site(
    tour: Tour, rooms: Sequence[BuiltRoom], report: Json, out: Path, *, single_files: bool = False
) -> Json:
    """Write the whole site and put it in the place of the one published before.

    Args:
        tour: The tour file.
        rooms: Every room of the tour, in any order.
        report: What goes into report.json and onto its page.
        out: The site's folder; made if it does not exist.
        single_files: Whether it shall hold the tour and each room as one file, too.

    Returns:
        The report as it was written: with what single files there are.

    Raises:
        InputError: ``out`` holds something that is not a tour, or cannot be written.
        Faults: The single file of a room would be larger than browsers open.
        MissingTool: The viewer has not been compiled.
    """
    out = out.absolute()
    restore_site(out)
    _refuse_foreign(out)
    fresh, old = _beside(out)
    try:
        _remove(fresh)
        fresh.mkdir(parents=True)
        pages = _write_all(tour, {room.id: room for room in rooms}, fresh)
        if single_files:
            script = (viewer_folder() / _SINGLE_SCRIPT).read_text("utf-8")
            report = {**report, "single_files": write_singles(fresh, script, fresh / _SINGLE)}
        _write_json(fresh / "report.json", report)
        _write(fresh / "report.html", pages.report(report))
        if out.exists():
            out.rename(old)
        fresh.rename(out)
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise
        raise InputError(
            f"`{error.filename or out}`: expected it to be read and written, "
            f"found: {error.strerror or error}",
            f"look whether it is there, and whose it is; or publish elsewhere than `{out}` by `-o`",
        ) from error
    shutil.rmtree(old, ignore_errors=True)  # what is left of it the next build drops
    return report


def restore_site(out: Path) -> None:
    """Put back the site that a build killed while swapping has left aside, if there is one."""
    _, old = _beside(out.absolute())
    if not old.exists():
        return
    if out.exists():
        _remove(old)
    else:
        old.rename(out)


def is_site(folder: Path) -> bool:
    """Whether ``folder`` holds a tour that tourgen wrote."""
    try:
        tour = json.loads((folder / "tour.json").read_text("utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(tour, dict) and "format" in tour and "rooms" in tour


def _beside(out: Path) -> tuple[Path, Path]:
    """Where the next site is written, and where the last one waits while they are swapped."""
    return out.with_name(f".{out.name}.new"), out.with_name(f".{out.name}.old")


def _refuse_foreign(out: Path) -> None:
    if out.is_dir() and (is_site(out) or not any(out.iterdir())):
        return
    if out.exists():
        found = "other files" if out.is_dir() else "a file"
        raise InputError(
            f"`{out}`: expected a tour or an empty folder to write to, found {found}",
            "choose another folder with `-o`, or empty this one",
        )


def _remove(folder: Path) -> None:
    if folder.exists():
        shutil.rmtree(folder)


# ------------------------------------------------------------------ contents


def _write_all(tour: Tour, built: Mapping[str, BuiltRoom], out: Path) -> Pages:
    """Write all but the report; returns the tour's pages."""
    viewer = viewer_folder()
    left = shutil.ignore_patterns(WORKER, _SINGLE_SCRIPT)
    shutil.copytree(viewer, out / "viewer", ignore=left)
    theme = load_theme(tour.folder)
    for name, content in theme.files.items():
        _write(out / name, content)
    told = {**described(tour, built), "logo": theme.logo}
    _write_json(out / "tour.json", told)
    _write(out / "_headers", headers_file())
    for room in tour.rooms:
        folder = out / "rooms" / room.id
        for name, content in built[room.id].files.items():
            _write(folder / PurePosixPath(name), content)
        for name, file in note_files(tour, room):
            _write(out / name, file.read_bytes())
    kiosk = kiosk_settings(tour.kiosk, told)
    for address, name in kiosk["codes"].items():
        _write(out / name, code_of(address))
    names = json.loads((viewer / "manifest.json").read_bytes())
    pages = Pages(tour.folder, told, theme, names, kiosk)
    for name, page in pages.every():
        _write(out / name, page)
    for size in ICONS:
        _write(out / icon_path(size), icon(built[tour.start].files["poster.webp"], size))
    _write(out / MANIFEST, manifest(told))
    # Last, since it names all that is there.
    _write(out / WORKER, worker_script(out, (viewer / WORKER).read_text("utf-8")))
    return pages


def _write_json(path: Path, content: Json) -> None:
    _write(path, json.dumps(content, ensure_ascii=False, indent=1) + "\n")


def _write(path: Path, content: bytes | str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)
