"""How true every method is, and every peer: ``python tests/peers/fidelity.py TOUR [...]``.

Each room of a simulated tour, and the gallery where it is given, is reconstructed by every
method of tourgen and by other programs at three settings each, from the same points. All are
held against the truth, as surfaces (``surface_score``, ``planes``) and as pictures
(``picture_score``, ``seams``, ``plaque``). ``--write`` puts tables and pictures into the docs.
What was made or measured before is kept in ``--scratch`` and not done again.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import cleaning
import contestants
import numpy as np
import oracle
import report
from browsing import photographed, published
from contestants import CHAINS, PUBLISHED, Contestant
from drawing import draw
from gaps import Gaps
from ledger import Ledger, digest
from picture_score import fitted_gain, score_pictures
from planes import Creases, Flatness, Rails, model_rods
from plaque import EDGES_MM, plaque_view, read_board
from rooms import GALLERY, BenchRoom, demo_rooms, gallery
from seams import seam_figures
from surface_score import Figures, Reference, Samples, best, surface_figures
from true_picture import TexturedTruth, true_shots
from variants import built, gallery_tour

import tourgen
from tourgen.geometry import UInt8
from tourgen.simulation.light import ray_scene

VERSION = 2
"""Raised when a measure changes, so that nothing is taken from earlier runs."""


@dataclass(frozen=True)
class Bench:
    """Measures contestants of one room.

    Attributes:
        room: The room.
        scratch: Where meshes, pictures and figures are kept.
    """

    room: BenchRoom
    scratch: Path

    @property
    def ledger(self) -> Ledger:
        """Of this room and this version of the measures."""
        return Ledger(self.scratch / f"v{VERSION}" / self.room.id)

    @cached_property
    def reference(self) -> Reference:
        """The truth and its seen points."""
        return Reference.of(self.room.truth())

    @cached_property
    def flatness(self) -> Flatness:
        """Its planes."""
        return Flatness(self.reference.truth)

    @cached_property
    def creases(self) -> Creases:
        """Where they meet."""
        return Creases(self.reference.truth)

    @cached_property
    def gaps(self) -> Gaps:
        """Where nobody measured, and where nothing is."""
        return Gaps.of(self.room, self.reference.truth)

    @cached_property
    def rails(self) -> Rails:
        """Its rods."""
        truth = self.reference.truth
        return Rails(truth, model_rods(self.room.id, truth))

    @cached_property
    def textured(self) -> TexturedTruth:
        """The truth with its colours."""
        return TexturedTruth(self.room)

    def surface(self, one: Contestant) -> Figures:
        """What a contestant's surface is worth."""

        def measure() -> Figures:
            vertices, faces = one.mesh
            samples = Samples.of(vertices, faces, self.reference.truth)
            return {
                **surface_figures(vertices, faces, samples, self.reference),
                **self.flatness.figures(samples),
                **self.creases.figures(vertices, faces),
                **self.rails.figures(vertices, faces),
            }

        def gaps() -> Figures:
            return self.gaps.figures(*one.mesh)

        name = digest(one.files)
        return {
            **self.ledger.figures(f"surface-{name}", measure),
            **self.ledger.figures(f"gaps-{name}", gaps),
        }

    def pictures(self, one: Contestant, budget: int) -> list[UInt8]:
        """What the room's cameras see of a contestant, and the plaque's after them.

        Args:
            one: Published, or a peer's mesh.
            budget: Bytes that a peer's whole chain may take.
        """
        cameras = list(self.textured.cameras)
        if self.room.id in EDGES_MM:
            cameras.append(plaque_view(self.room.id)[0])

        def take() -> list[UInt8]:
            if one.site is not None:
                with published(one.site) as here:
                    return photographed(here, self.room.id, cameras)
            chain = CHAINS[one.name](*one.mesh, self.room, budget)
            scene = ray_scene(chain.vertices, chain.faces)
            return [draw(scene, chain.colors_at, camera) for camera in cameras]

        weight = "" if one.site else f"-{budget // 1000}"
        return self.ledger.pictures(f"{digest(one.files)}{weight}", take)

    def picture(self, one: Contestant, budget: int) -> Figures:
        """How near its pictures come to the true ones."""

        def measure() -> Figures:
            truth = self.textured
            shots = true_shots(self.room, truth, self.scratch)
            pictures = self.pictures(one, budget)
            views = pictures[: len(shots)]
            scored = score_pictures(views, shots)
            figures = {
                "psnr_db": float(np.mean(scored.psnr_db)),
                "psnr_worst_db": min(scored.psnr_db),
                "ssim": float(np.mean(scored.ssim)),
                **seam_figures(
                    truth, truth.cameras, views, shots, fitted_gain(views, shots), one.mesh
                ),
            }
            if self.room.id in EDGES_MM:
                camera, boards = plaque_view(self.room.id)
                true = draw(truth.scene, truth.colors_at, camera)
                for board in boards:
                    reading = read_board(pictures[-1], true, camera, board)
                    figures[f"squares_{board.edge_mm}mm_right"] = reading.right
                    figures[f"squares_{board.edge_mm}mm_contrast"] = reading.contrast
            return figures

        weight = "" if one.site else f"-{budget // 1000}"
        return self.ledger.figures(f"picture-{digest(one.files)}{weight}", measure)


def cleaned(room: str, given: argparse.Namespace, ledger: Ledger) -> dict[str, Figures]:
    """What cleaning leaves of a room's faults, by the format of the scan."""
    stages = sorted((Path(tourgen.__file__).parent / "stages").rglob("*.py"))

    def measure(kind: str) -> Figures:
        if room == GALLERY:
            case = cleaning.gallery(given.gallery)
        else:
            case = cleaning.modelled(given.tour, room, kind)
        return cleaning.figures(case, cleaning.cleaned(case)[0])

    kinds = ("e57",) if room == GALLERY else ("e57", "ply")
    code = digest([Path(cleaning.__file__), *stages])
    return {
        kind: ledger.figures(f"cleaning-{kind}-{code}", partial(measure, kind)) for kind in kinds
    }


def main() -> int:
    """The command; 1 where a room is not won."""
    given = _asked()
    rooms = {room.id: room for room in demo_rooms(given.tour)}
    if given.gallery and given.gallery.exists():
        shown = gallery(given.gallery, given.scratch)
        rooms[shown.id] = shown
    chosen = given.room or list(rooms)
    results = []
    for room in chosen:
        results.append(_judged(rooms[room], given))
        print(report.table(results[-1]), flush=True)
    if given.write:
        report.write(results, given.write)
    return 0 if all(each.won for each in results) else 1


def _asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tour", type=Path, help="a tour's folder, with scans/, truth/ and site/")
    parser.add_argument("--gallery", type=Path, help="folder of gallery_sim")
    parser.add_argument("--scratch", type=Path, default=Path("build/fidelity"))
    parser.add_argument("--room", action="append", help="only this room")
    parser.add_argument("--method", action="append", help="only this method beside the published")
    parser.add_argument("--skip-peers", action="store_true")
    parser.add_argument("--skip-picture", action="store_true")
    parser.add_argument("--write", type=Path, help="write the section of this Markdown file")
    return parser.parse_args()


def _judged(room: BenchRoom, given: argparse.Namespace) -> report.RoomResult:
    """One room: all contestants, their figures, the best of each peer's settings."""
    bench = Bench(room, given.scratch)
    is_demo = (given.tour / "site" / "rooms" / room.id).exists()
    tour = given.tour if is_demo else gallery_tour(given.gallery, given.scratch)
    columns: dict[str, tuple[Contestant, Figures]] = {}
    refused: dict[str, str] = {}
    if is_demo:
        one = contestants.ours(PUBLISHED, given.tour / "site", room.id)
        columns[PUBLISHED] = one, bench.surface(one)
    for method in given.method or contestants.methods():
        print(f"{room.id}: {method} ...", flush=True)
        site = built(tour, method, room.id, given.scratch)
        if isinstance(site, str):
            refused[method] = site
            continue
        one = contestants.ours(method, site, room.id)
        columns[method] = one, bench.surface(one)
    rows = [
        (one, bench.surface(one))
        for one in ([] if given.skip_peers else contestants.peers(room, given.scratch))
    ]
    for program in dict.fromkeys(one.name for one, _ in rows):
        columns[program] = best([row for row in rows if row[0].name == program])
    pictures: dict[str, list[UInt8]] = {}
    if is_demo and not given.skip_picture:
        site = oracle.built_oracle(tour, room, bench.textured, given.scratch)
        if isinstance(site, str):
            refused[oracle.NAME] = site
        else:
            columns[oracle.NAME] = contestants.ours(oracle.NAME, site, room.id), {}
        budget = contestants.tiles_bytes(given.tour / "site", room.id)
        for name, (one, figures) in columns.items():
            print(f"{room.id}: pictures of {name} ...", flush=True)
            columns[name] = one, figures | bench.picture(one, budget)
            pictures[name] = bench.pictures(one, budget)
        shots = true_shots(room, bench.textured, given.scratch)
        pictures["truth"] = [shot.picture for shot in shots]
    return report.RoomResult(
        room.id,
        {name: figures for name, (_, figures) in columns.items()},
        {name: one.setting for name, (one, _) in columns.items() if one.setting},
        [(one.name, one.setting, figures) for one, figures in rows],
        refused,
        cleaned(room.id, given, bench.ledger),
        pictures,
    )


if __name__ == "__main__":
    sys.exit(main())
