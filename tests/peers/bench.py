"""The measures of one room, each taken once for the same mesh, scan or code."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cleaning
import numpy as np
import orientation
import registration
from browsing import photographed, published
from contestants import CHAINS, Contestant
from drawing import Camera, draw, relief, splatted
from gaps import Gaps
from ledger import Ledger, digest
from picture_score import fitted_gain, score_pictures
from planes import Creases, Flatness, Rails, model_rods
from plaque import EDGES_MM, plaque_view, read_board
from rooms import GALLERY, BenchRoom, read_scan, stamp
from seams import seam_figures
from surface_score import Figures, Reference, Samples, surface_figures
from true_picture import Shot, TexturedTruth, busiest, cameras_in, true_shots

from tourgen.geometry import UInt8
from tourgen.rays import ray_scene
from tourgen.stages import crowding, normals, ownership, register, sift, stations
from tourgen.tour import load_tour

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
    def truth_digest(self) -> str:
        """Of the true surface and what else is known of the room."""
        folder = self.room.truth_folder
        return digest(folder / f"{self.room.id}.{suffix}" for suffix in ("ply", "json"))

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

    @cached_property
    def shots(self) -> list[Shot]:
        """What the room's cameras truly see."""
        return true_shots(self.room, self.textured, self.scratch)

    def true_pictures(self) -> list[UInt8]:
        """What the room's cameras truly see, and the plaque's after them."""
        seen = [shot.picture for shot in self.shots]
        if self.room.id not in EDGES_MM:
            return seen
        camera, _ = plaque_view(self.room.id)
        return [*seen, draw(self.textured.scene, self.textured.colors_at, camera)]

    def surface(self, one: Contestant) -> Figures:
        """What a contestant's surface is worth."""
        return {**self.shape(one), **self.gapped(one)}

    def shape(self, one: Contestant) -> Figures:
        """How true it is, its planes, creases and rails."""

        def measure() -> Figures:
            vertices, faces = one.mesh
            samples = Samples.of(vertices, faces, self.reference.truth)
            return {
                **surface_figures(vertices, faces, samples, self.reference),
                **self.flatness.figures(samples),
                **self.creases.figures(vertices, faces),
                **self.rails.figures(vertices, faces),
            }

        return self.ledger.figures(f"surface-{one.digest}-{self.truth_digest}", measure)

    def gapped(self, one: Contestant) -> Figures:
        """What it closes and leaves open."""
        return self.ledger.figures(
            f"gaps-{one.digest}-{self.truth_digest}", lambda: self.gaps.figures(*one.mesh)
        )

    def relief(self, one: Contestant | None) -> UInt8:
        """The busiest camera's view of a contestant's bare surface, or of the true one."""
        camera = self.cameras[self.busiest[0]]

        def take() -> list[UInt8]:
            truth = self.reference.truth
            vertices, faces = one.mesh if one else (truth.vertices, truth.faces)
            shades = relief(vertices, faces, camera.position)
            return [draw(ray_scene(vertices, faces), shades, camera)]

        name = one.digest if one else "truth"
        return self.ledger.pictures(f"relief-{name}-{self.truth_digest}", take)[0]

    def dots(self) -> list[UInt8]:
        """The scan as it came, from the room's cameras, and from the plaque's after them."""
        cameras = list(self.cameras)
        if self.room.id in EDGES_MM:
            cameras.append(plaque_view(self.room.id)[0])

        def take() -> list[UInt8]:
            points, colors = read_scan(self.room.scan)
            return [splatted(points, colors, camera) for camera in cameras]

        return self.ledger.pictures(f"scan-{stamp(self.room.scan)}", take)

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """That take the room's pictures."""
        truth = self.reference.truth
        return cameras_in(truth.vertices, truth.scene)

    @cached_property
    def busiest(self) -> list[int]:
        """Their numbers, those first that see most."""
        return busiest(self.cameras, self.reference.truth.scene)

    def pictures(self, one: Contestant, budget: int) -> list[UInt8]:
        """What the room's cameras see of a contestant, and the plaque's after them.

        Args:
            one: Published, or a peer's mesh.
            budget: Bytes that a peer's whole chain may take.
        """
        cameras = list(self.cameras)
        if self.room.id in EDGES_MM:
            cameras.append(plaque_view(self.room.id)[0])

        def take() -> list[UInt8]:
            if one.site is not None:
                with published(one.site) as here:
                    return photographed(here, self.room.id, cameras)
            chain = CHAINS[one.name](*one.mesh, self.room, budget)
            scene = ray_scene(chain.vertices, chain.faces)
            return [draw(scene, chain.colors_at, camera) for camera in cameras]

        return self.ledger.pictures(self._shown(one, budget), take)

    def picture(self, one: Contestant, budget: int) -> Figures:
        """How near its pictures come to the true ones."""

        def measure() -> Figures:
            truth, shots = self.textured, self.shots
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
                true = self.true_pictures()[-1]
                for board in boards:
                    reading = read_board(pictures[-1], true, camera, board)
                    figures[f"squares_{board.edge_mm}mm_right"] = reading.right
                    figures[f"squares_{board.edge_mm}mm_contrast"] = reading.contrast
            return figures

        return self.ledger.figures(f"picture-{self._shown(one, budget)}", measure)

    def _shown(self, one: Contestant, budget: int) -> str:
        """What pictures of a contestant are kept under."""
        weight = "" if one.site else f"-{budget // 1000}"
        return f"{one.shown_digest}-{self.truth_digest}{weight}"

    def cleaned(self, tour: Path, gallery: Path | None) -> dict[str, Figures]:
        """What cleaning leaves of the room's faults, by the format of the scan."""

        def measure(kind: str) -> Figures:
            if self.room.id == GALLERY and gallery:
                case = cleaning.gallery(gallery, kind)
            else:
                case = cleaning.modelled(tour, self.room.id, kind)
            return cleaning.figures(case, cleaning.cleaned(case))

        code = "-".join(
            str(each.VERSION) for each in (stations, crowding, ownership, register, sift)
        )
        return {
            kind: self.ledger.figures(
                f"cleaning-{kind}-{code}-{stamp(self.room.scan)}", lambda kind=kind: measure(kind)
            )
            for kind in ("e57", "ply")
        }

    def oriented(self, tour: Path) -> Figures:
        """How many normals are right without given stations, and how long turning takes."""

        def measure() -> Figures:
            room = load_tour(tour).room(self.room.id)
            facts = orientation.oriented(tour, room, given=False).facts
            return {
                "normals_right": facts["right"],
                "turning_s_a_million": facts["turning seconds a million"],
            }

        code = "-".join(str(each.VERSION) for each in (sift, stations, normals))
        return self.ledger.figures(f"normals-{code}-{stamp(self.room.scan)}", measure)

    def registered(self, tour: Path, gallery: Path | None) -> Figures:
        """How far apart the stations are left after one was moved by 5 cm and 1 degree."""

        def measure() -> Figures:
            if self.room.id == GALLERY and gallery:
                case = registration.exact(self.room.scan)
            else:
                case = registration.modelled(tour, load_tour(tour).room(self.room.id))
            found = registration.figures(case, move=True)
            return {
                "stations_apart_mm": found["after largest mm"],
                "stations_apart_deg": found["after largest deg"],
            }

        key = f"stations-{register.VERSION}-{stamp(self.room.scan)}"
        return self.ledger.figures(key, measure)


def reported_inferred(site: Path, room: str) -> float:
    """The share of a published room's area that its report calls inferred."""
    report = json.loads((site / "report.json").read_text(encoding="utf-8"))
    return float(report["rooms"][room]["inferred_area_ratio"])
