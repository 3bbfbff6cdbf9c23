"""How true every method is, and every peer: ``python tests/peers/fidelity.py TOUR [...]``.

Each room of a simulated tour, and the gallery where it is given, is reconstructed by every
method of tourgen and by other programs at three settings each, from the same points. All are
held against the truth, as surfaces (``surface_score``, ``planes``, ``gaps``) and as pictures
(``picture_score``, ``seams``, ``plaque``); what goes before, as cleaning, is judged too.
``--write`` puts tables and pictures into the docs after every room, and what was found beside
them, so that a run of hours may be cut: rooms that are not asked for are written as they were
last judged. With ``--keep-peers`` so are the peers, which do not change as our code does. What was
made or measured before is kept in ``--scratch`` and not done again.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import contestants
import oracle
import report
from aims import ORACLE, PANORAMAS, short_of
from bench import Bench, reported_inferred
from contestants import Contestant
from exact import exact
from results import EXACT, PUBLISHED, RoomResult, Sheet, Try, save, saved
from rooms import GALLERY, BenchRoom, demo_rooms, gallery
from surface_score import Figures, best
from thinned import POINTS, ROOM, thinned_room, thinned_tour
from variants import alone, built, drawn, gallery_tour, link, scanned

from tourgen.geometry import UInt8
from tourgen.tour import Tour, load_tour

THINNED = f"{ROOM}-thinned"
COLORED_BY_PANORAMAS = ("chamber1",)
"""Rooms that are published once more, from their E57."""
AS_ASKED = "as asked for"

Column = tuple[Contestant, Figures]


def main() -> int:
    """The command; 1 where a room is not won."""
    given = _asked()
    rooms = {room.id: room for room in demo_rooms(given.tour)}
    if given.gallery and given.gallery.exists():
        shown = gallery(given.gallery, given.scratch)
        rooms[shown.id] = shown
    every = [*rooms, *([THINNED] if ROOM in rooms else [])]
    results = {}
    for name in given.room or every:
        if name == THINNED:
            results[name] = _thinned(rooms[ROOM], given)
        else:
            results[name] = _judged(rooms[name], given)
        print(report.table(results[name]), flush=True)
        if given.write:
            save(results[name], _kept(given.write, name))
            _write(every, given)
    for line in short_of(list(results.values())):
        print(f"falls short: {line}")
    lost = [line for each in results.values() for line in each.lost]
    print("\n".join(f"lost: {line}" for line in lost) or "every room is won")
    return 1 if lost else 0


def _asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tour", type=Path, help="a tour's folder, with scans/, truth/ and site/")
    parser.add_argument("--gallery", type=Path, help="folder of gallery_sim")
    parser.add_argument("--scratch", type=Path, default=Path("build/fidelity"))
    parser.add_argument("--room", action="append", help="only this room")
    parser.add_argument("--method", action="append", help="only this method beside the published")
    parser.add_argument("--keep-peers", action="store_true", help="as they were judged last")
    parser.add_argument("--skip-peers", action="store_true")
    parser.add_argument("--skip-picture", action="store_true")
    parser.add_argument("--write", type=Path, help="write the section of this Markdown file")
    given = parser.parse_args()
    if given.keep_peers and not given.write:
        parser.error("--keep-peers needs --write: earlier results lie beside that file")
    if given.write and _is_partial(given):
        print("writes no docs: not all contestants are judged", flush=True)
        given.write = None
    given.scratch = given.scratch.resolve()
    return given


def _is_partial(given: argparse.Namespace) -> bool:
    """Whether rooms are not judged whole."""
    return bool(given.method or given.skip_peers or given.skip_picture)


def _kept(docs: Path, room: str) -> Path:
    """Where a room's result is kept for runs that leave it out."""
    return docs.parent / "fidelity" / f"{room}.json"


def _before(room: str, given: argparse.Namespace) -> RoomResult:
    """What is not judged again: nothing, unless that was asked for."""
    file = _kept(given.write, room) if given.keep_peers else None
    return saved(file) if file and file.exists() else RoomResult(room)


def _write(every: list[str], given: argparse.Namespace) -> None:
    """Write the docs, each room as it was last judged."""
    kept = [file for name in every if (file := _kept(given.write, name)).exists()]
    report.write([saved(file) for file in kept], given.write)
    print(f"wrote {given.write}: {', '.join(file.stem for file in kept)}", flush=True)


def _sheets(given: argparse.Namespace) -> Path:
    """Where pictures side by side are put."""
    docs: Path | None = given.write
    return docs.parent / "pictures" if docs else Path(given.scratch) / "sheets"


def _judged(room: BenchRoom, given: argparse.Namespace) -> RoomResult:
    """One room: all contestants, their figures, the best of each peer's settings."""
    bench = Bench(room, given.scratch)
    is_demo = room.id != GALLERY
    tour = load_tour(given.tour) if is_demo else gallery_tour(given.gallery, given.scratch)
    columns: dict[str, Column] = {}
    refused: dict[str, str] = {}
    if is_demo:
        one = contestants.published(PUBLISHED, given.tour / "site", room.id)
        columns[PUBLISHED] = one, bench.surface(one)
    columns |= _drawn(tour, bench, given.method or contestants.methods(), refused)
    if not given.method:
        columns |= _exact(tour, bench, refused)
    before = _before(room.id, given)
    left_out = given.skip_peers or given.keep_peers
    found, failed = ([], {}) if left_out else contestants.peers(room, given.scratch)
    rows = [(one, bench.surface(one)) for one in found]
    for program in dict.fromkeys(one.name for one, _ in rows):
        columns[program] = best([row for row in rows if row[0].name == program])
    checks = bench.registered(given.tour, given.gallery)
    sheets = [_reliefs(room.id, bench, columns, given)]
    if is_demo:
        inferred = reported_inferred(given.tour / "site", room.id)
        checks |= {"inferred_reported": inferred, **bench.oriented(given.tour)}
        if not given.skip_picture:
            sheets += _pictured(tour, bench, columns, refused, given)
    return RoomResult(
        room=room.id,
        columns={name: figures for name, (_, figures) in columns.items()} | before.peers,
        settings={
            **before.settings,
            **{name: one.setting for name, (one, _) in columns.items() if one.setting},
        },
        tries=[
            *before.tries,
            *(Try(one.name, one.setting, each["f_score_5mm"]) for one, each in rows),
            *(Try(program, setting, None, why) for (program, setting), why in failed.items()),
        ],
        refused=refused,
        told=_told(columns),
        cleaning=bench.cleaned(given.tour, given.gallery),
        checks=checks,
        sheets=sheets,
    )


def _drawn(
    tour: Tour, bench: Bench, methods: tuple[str, ...], refused: dict[str, str]
) -> dict[str, Column]:
    """A room by each method; those that refuse are noted."""
    columns: dict[str, Column] = {}
    room = bench.room.id
    for method in methods:
        print(f"{room}: {method} ...", flush=True)
        file = drawn(tour, room, method, bench.scratch)
        if isinstance(file, str):
            refused[method] = file
        else:
            one = Contestant(method, "", (file,), None, room)
            columns[method] = one, bench.surface(one)
    return columns


def _exact(tour: Tour, bench: Bench, refused: dict[str, str]) -> dict[str, Column]:
    """A room from exact points."""
    room, truth = bench.room.id, bench.reference.truth
    print(f"{room}: {EXACT} ...", flush=True)
    file = exact(tour, room, (truth.vertices, truth.faces), bench.scratch)
    if isinstance(file, str):
        refused[EXACT] = file
        return {}
    one = Contestant(EXACT, "", (file,), None, room)
    return {EXACT: (one, bench.surface(one))}


def _told(columns: dict[str, Column]) -> dict[str, str]:
    """What methods say of their surface beyond that it was asked for."""
    told = {name: one.told for name, (one, _) in columns.items()}
    return {name: words for name, words in told.items() if words and AS_ASKED not in words}


def _reliefs(
    name: str, bench: Bench, columns: dict[str, Column], given: argparse.Namespace
) -> Sheet:
    """The bare surfaces side by side."""
    shown = {"truth": bench.relief(None)}
    shown |= {each: bench.relief(one) for each, (one, _) in columns.items()}
    return report.side_by_side(shown, _sheets(given) / f"fidelity-{name}-relief.webp")


def _pictured(
    tour: Tour,
    bench: Bench,
    columns: dict[str, Column],
    refused: dict[str, str],
    given: argparse.Namespace,
) -> list[Sheet]:
    """Add the figures of pictures to the columns that have colours; the sheets of all."""
    room = bench.room.id
    for name, site in _published_beside(tour, bench, columns, given).items():
        if isinstance(site, str):
            refused[name] = site
        else:
            _, figures = columns.get(name, (None, {}))
            columns[name] = contestants.published(name, site, room), figures
    budget = contestants.tiles_bytes(given.tour / "site", room)
    shown: dict[str, list[UInt8]] = {}
    for name, (one, figures) in columns.items():
        if one.site is None and not one.setting:
            continue
        print(f"{room}: pictures of {name} ...", flush=True)
        columns[name] = one, figures | bench.picture(one, budget)
        shown[name] = bench.pictures(one, budget)
    shown = {"scan": bench.dots(), "truth": bench.true_pictures(), **shown}
    numbers = [
        *bench.busiest[: report.SHOWN_CAMERAS],
        *range(len(bench.shots), len(shown["truth"])),
    ]
    return [
        report.side_by_side(
            {name: pictures[number] for name, pictures in shown.items()},
            _sheets(given) / f"fidelity-{room}-{number}.webp",
        )
        for number in numbers
    ]


def _published_beside(
    tour: Tour, bench: Bench, columns: dict[str, Column], given: argparse.Namespace
) -> dict[str, Path | str]:
    """The sites that are built for their pictures alone."""
    room, truth, scratch = bench.room.id, bench.textured, given.scratch
    print(f"{room}: {ORACLE} ...", flush=True)
    sites = {ORACLE: oracle.built_oracle(tour, bench.room, truth, scratch)}
    if EXACT in columns:
        print(f"{room}: pictures of {EXACT} ...", flush=True)
        mesh = columns[EXACT][0].mesh
        sites[EXACT] = oracle.built_exact(tour, bench.room, truth, mesh, scratch)
    if room in COLORED_BY_PANORAMAS:
        print(f"{room}: {PANORAMAS} ...", flush=True)
        folder = given.scratch / PANORAMAS / room
        folder.mkdir(parents=True, exist_ok=True)
        link(folder / "scans", given.tour / "scans")
        scan = scanned(tour, room, f"scans/{room}.e57")
        sites[PANORAMAS] = built(alone(tour, room, folder, **scan))
        print(f"{room}: {oracle.WITH_PANORAMAS} ...", flush=True)
        sites[oracle.WITH_PANORAMAS] = oracle.built_with_panoramas(tour, bench.room, truth, scratch)
    return sites


def _thinned(room: BenchRoom, given: argparse.Namespace) -> RoomResult:
    """A room by every method from so few points that crust can do it."""
    few = thinned_room(room, given.scratch)
    bench = Bench(few, given.scratch)
    refused: dict[str, str] = {}
    tour = thinned_tour(load_tour(given.tour), few, given.scratch)
    columns = _drawn(tour, bench, given.method or contestants.methods(), refused)
    return RoomResult(
        room=THINNED,
        about=f"`{room.id}` thinned to {POINTS:,} points, the middlemost of each cell of a grid: "
        "so many `crust` can do.",
        columns={name: figures for name, (_, figures) in columns.items()},
        refused=refused,
        told=_told(columns),
        sheets=(_reliefs(THINNED, bench, columns, given),),
    )


if __name__ == "__main__":
    sys.exit(main())
