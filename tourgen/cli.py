"""The commands: parse, call, print; no logic."""

from __future__ import annotations

import argparse
import errno
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tourgen import __version__
from tourgen.errors import Faults, InputError, StageError, TourgenError
from tourgen.threads import limit_native_threads

OUTPUT = "site"
_LAST_PORT = 65535


def main(arguments: Sequence[str] | None = None) -> int:
    """Run tourgen.

    Args:
        arguments: Of the command line; those of this process if left out.

    Returns:
        The exit code: 0 done, 1 a room failed or this machine lacks something, 2 bad input.
    """
    asked = _parser().parse_args(arguments)
    command: Callable[[argparse.Namespace], int] = asked.command
    try:
        return command(asked)
    except TourgenError as error:
        _tell(error)
        return error.exit_code
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        hint = "free some, and run the same line again"
        _tell(StageError("disk: expected room, found none left", hint))
        return StageError.exit_code
    except KeyboardInterrupt:
        print("stopped; the same line goes on from what is finished", file=sys.stderr)
        return 130


def _tell(error: TourgenError) -> None:
    for each in _each(error):
        print(f"error: {each.message}", file=sys.stderr)
        if each.hint:
            print(f"\nhint: {each.hint}\n", file=sys.stderr)


def _each(error: TourgenError) -> tuple[TourgenError, ...]:
    return getattr(error, "faults", None) or getattr(error, "errors", None) or (error,)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tourgen", description="Raw laser scans of rooms in, a virtual tour out."
    )
    parser.add_argument("--version", action="version", version=f"tourgen {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name: str, run: Callable[[argparse.Namespace], int], text: str, folder: str) -> Any:
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(command=run)
        if folder:
            command.add_argument("folder", type=Path, metavar=folder)
        return command

    add("new", _new, "Write a commented tour.toml for the scans found in DIR.", "DIR")
    add("keys", _keys, "Tell what each key of tour.toml means.", "")
    check = add("check", _check, "Read tour.toml and the scans' headers; tell every fault.", "DIR")
    plan = add("plan", _plan, "Say what a build would do, and why.", "DIR")
    build = add("build", _build, "Build the tour's website.", "DIR")
    serve = add("serve", _serve, "Serve a tour on this machine.", "DIR-or-SITE")
    kiosk = add("kiosk", _kiosk, "Show a tour on a screen that nobody attends.", "DIR-or-SITE")
    film = add("film", _film, "Make a video of the guided tour of a built tour.", "DIR-or-SITE")
    add("clean", _clean, "Drop the cache of a tour.", "DIR")
    doctor = add("doctor", _doctor, "Say what this machine lacks, and how to mend it.", "")
    build.add_argument(
        "-o", "--output", metavar="OUT", help="the site's folder (DIR/site), or an address"
    )
    build.add_argument(
        "--room",
        action="append",
        default=[],
        metavar="ID",
        help="build only this room, with the others as they were built before; repeatable",
    )
    build.add_argument(
        "--jobs", type=_whole(), metavar="N", help="stages that run at once (one a core)"
    )
    build.add_argument(
        "--cluster", metavar="ADDRESS", help="run them on the workers of this dask scheduler"
    )
    build.add_argument(
        "--profile",
        type=Path,
        metavar="PAGE",
        help="write where the time of what runs goes, a flame graph in HTML",
    )
    build.add_argument(
        "--single-file",
        action="store_true",
        help="besides, one HTML file of the tour and one of each room, which hold all they show "
        "and open by a double click",
    )
    serve.add_argument("--port", type=_whole(_LAST_PORT), default=8000, help="port (8000)")
    kiosk.add_argument("--port", type=_whole(_LAST_PORT), default=8710, help="port (8710)")
    film.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="FILE.mp4",
        help="the film; FILE.webp, FILE.loop.mp4 and FILE.LANGUAGE.vtt are written beside it",
    )
    film.add_argument(
        "--size",
        default="1920x1080",
        metavar="WIDTHxHEIGHT",
        help="pixels (1920x1080); 3840x2160 for 4K",
    )
    film.add_argument("--fps", type=int, choices=(30, 60), default=30, help="frames a second (30)")
    film.add_argument(
        "--language", default="", metavar="TAG", help="of titles and captions (the tour's first)"
    )
    film.add_argument("--captions", action="store_true", help="write captions into the picture")
    film.add_argument("--sound", action="store_true", help="add a sound track: sounds of notes")
    film.add_argument("--part", metavar="FROM-TO", help="make these seconds alone, for a trial")
    for command in (check, plan, build, doctor):
        command.add_argument("--json", action="store_true", help="print JSON")
    return parser


def _whole(most: int | None = None) -> Callable[[str], int]:
    """Reads a whole number from 1 on, and up to ``most`` where that is given."""
    expected = f"a whole number from 1 to {most}" if most else "a whole number, at least 1"

    def read(text: str) -> int:
        if not text.isdecimal() or not 1 <= int(text) <= (most or sys.maxsize):
            raise argparse.ArgumentTypeError(f"expected {expected}, found {text}")
        return int(text)

    return read


def _rooms(count: int) -> str:
    return f"{count} room{'s' * (count != 1)}"


def _print_json(content: Any) -> None:
    print(json.dumps(content, indent=2, ensure_ascii=False))


def _new(asked: argparse.Namespace) -> int:
    from tourgen.reference import starter
    from tourgen.tour import TOUR_FILE

    target = asked.folder / TOUR_FILE
    if target.exists():
        raise InputError(f"`{target}`: expected no file, found one", "edit it, or move it away")
    target.write_text(starter(asked.folder), encoding="utf-8")
    print(f"wrote {target}; now: tourgen check {asked.folder}")
    return 0


def _keys(_: argparse.Namespace) -> int:
    from tourgen.reference import reference

    print(reference(), end="")
    return 0


def _check(asked: argparse.Namespace) -> int:
    from tourgen.tour import check_tour

    try:
        tour, warnings = check_tour(asked.folder)
    except Faults as faults:
        if not asked.json:
            raise
        _print_json({"faults": [{"message": f.message, "hint": f.hint} for f in faults.faults]})
        return faults.exit_code
    if asked.json:
        _print_json({"faults": [], "warnings": warnings})
        return 0
    for warning in warnings:
        print(f"warning: {warning}")
    print(f"{_rooms(len(tour.rooms))}, no fault; now: tourgen build {asked.folder}")
    return 0


def _plan(asked: argparse.Namespace) -> int:
    from tourgen.build import plan_tour
    from tourgen.tour import check_tour

    tour, _ = check_tour(asked.folder)
    rooms = plan_tour(tour)
    if asked.json:
        _print_json({room.room: dict(room.stages) for room in rooms})
        return 0
    for room in rooms:
        if not room.stages:
            print(f"{room.room}: nothing to do")
        for stage, reason in room.stages:
            print(f"{room.room}: {stage}: {reason}")
    return 0


def _build(asked: argparse.Namespace) -> int:
    from tourgen.unchanged import last_report

    out = asked.output or str(asked.folder / OUTPUT)
    plain = not (asked.room or asked.cluster or asked.profile)
    last = last_report(asked.folder, out, single_files=asked.single_file) if plain else None
    report = last or _built(asked, out)
    if asked.json:
        _print_json(report)
        return 0
    for room_id, room in report["rooms"].items():
        for warning in room["warnings"]:
            print(f"warning: room `{room_id}`: {warning}")
    print(
        f"built {out}: {_rooms(len(report['rooms']))}, {report['total_bytes'] / 1e6:.1f} MB, "
        f"{report['ran_stages']} stages run, {report['cached_stages']} from the cache, "
        f"{report['seconds']:.1f} s"
    )
    singles = report.get("single_files", {"warnings": [], "bytes": {}})
    for warning in singles["warnings"]:
        print(f"warning: {warning}")
    for path, size in singles["bytes"].items():
        print(f"single file {out.rstrip('/')}/{path}: {size / 1e6:.1f} MB")
    if "://" not in out:
        print(f"to walk through it: tourgen serve {out if asked.output else asked.folder}")
    return 0


def _built(asked: argparse.Namespace, out: str) -> Any:
    """Build, and report."""
    limit_native_threads()  # before anything loads such libraries
    from tourgen.tour import check_tour
    from tourgen.workers import load_ahead

    tour, _ = check_tour(asked.folder)
    if asked.jobs != 1 and not asked.cluster:
        load_ahead()
    from tourgen.build import build_tour
    from tourgen.progress import ProgressBars

    with ProgressBars() as bars:
        return build_tour(
            tour,
            out,
            bars,
            only=asked.room,
            jobs=asked.jobs,
            cluster=asked.cluster,
            profile=asked.profile,
            single_files=asked.single_file,
        )


def _serve(asked: argparse.Namespace) -> int:
    from tourgen.serve import serve

    serve(_site(asked.folder), "127.0.0.1", asked.port)
    return 0


def _kiosk(asked: argparse.Namespace) -> int:
    from tourgen.kiosk import run_kiosk

    run_kiosk(_site(asked.folder), asked.port)
    return 0


def _site(folder: Path) -> Path:
    """The site in a folder, or the folder itself where it is one."""
    from tourgen.site import is_site, restore_site

    site = folder if is_site(folder) else folder / OUTPUT
    restore_site(site)
    if not is_site(site):
        raise InputError(
            f"`{folder}`: expected a tour's site, found none",
            f"build it first: tourgen build {folder}",
        )
    return site


def _film(asked: argparse.Namespace) -> int:
    from tourgen.film import make_film
    from tourgen.film.progress import FrameBar
    from tourgen.film.settings import FilmSettings, parse_part, parse_size

    width, height = parse_size(asked.size)
    settings = FilmSettings(
        width=width,
        height=height,
        fps=asked.fps,
        language=asked.language,
        captions=asked.captions,
        sound=asked.sound,
        part=parse_part(asked.part) if asked.part else None,
    )
    with FrameBar() as bar:
        written = make_film(_site(asked.folder), asked.output, settings, bar)
    for path in written:
        print(f"wrote {path}: {path.stat().st_size / 1e6:.1f} MB")
    return 0


def _clean(asked: argparse.Namespace) -> int:
    from tourgen.cache import Cache
    from tourgen.tour import TOUR_FILE

    if not (asked.folder / TOUR_FILE).is_file():
        raise InputError(
            f"`{asked.folder}`: expected a folder with a {TOUR_FILE}, found none",
            "name the folder that `tourgen build` was given",
        )
    freed = Cache(asked.folder).clear()
    print(f"dropped the cache of {asked.folder}: {freed / 1e6:.1f} MB")
    return 0


def _doctor(asked: argparse.Namespace) -> int:
    from tourgen.doctor import findings

    found = findings(Path.cwd())
    if asked.json:
        _print_json([asdict(finding) for finding in found])
    elif not found:
        print("nothing is lacking")
    for each in [] if asked.json else found:
        print(f"{each.subject}: {each.fault}\n\nhint: {each.mend}\n")
    return 1 if any(not each.optional for each in found) else 0


if __name__ == "__main__":
    sys.exit(main())
