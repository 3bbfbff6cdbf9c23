"""Whether gaps of the scan are closed where there is a surface, and stay open where there is none.

The disc under each tripod is where beams steeper than its scanner looks would have ended: seen by
other stations in part, or by none. Openings are doors, windows and portholes: judged straight
through each, where the truth knows it, and by all directions in which a station sees nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from rooms import BenchRoom
from scipy.ndimage import binary_erosion
from score import LOWEST, Truth
from surface_score import Figures

from tourgen.geometry import Float64, Int32
from tourgen.rays import ray_scene, rays_of

TRUE_M = 0.020
"""A disc is laid where it truly lies where the mesh is so near to it."""
DISC_BEAMS = 20_000
STEP_DEG = 0.2
"""Between the beams of a station."""
PANE_M = 0.010
"""Between beams straight through an opening."""
RIM_STEPS = 2
"""So near to its rim, some 20 mm, an opening is not judged."""
BESIDE_M = 0.1
"""They begin so far before the wall, and end so far behind it, as those to a disc do."""
FAR_M = 1e3
"""Beyond all that a scan holds."""
Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Beams:
    """Lines on which the truth has no surface.

    Attributes:
        origins: (n, 3) metres.
        ways: (n, 3) unit.
        length_m: (n,)
        group: (n,) what they belong to.
    """

    origins: Float64
    ways: Float64
    length_m: Float64
    group: Ints

    def free(self, scene: Any) -> Bools:
        """(n,) which meet no surface of a scene."""
        reach = scene.cast_rays(rays_of(self.origins, self.ways))["t_hit"].numpy()
        return np.asarray(reach > self.length_m)

    def take(self, chosen: Bools) -> Beams:
        """Some of them."""
        return Beams(
            self.origins[chosen], self.ways[chosen], self.length_m[chosen], self.group[chosen]
        )


@dataclass(frozen=True)
class Gaps:
    """A room's blind discs and openings.

    Attributes:
        down: From each station to the true surface under it and as far behind that as counts, even
            over a level floor.
        under: (n, 3) where they meet it.
        unseen: (n,) no station sees that.
        outlook: From each station.
        through: Straight through each opening.
    """

    down: Beams
    under: Float64
    unseen: Bools
    outlook: Beams
    through: Beams

    @classmethod
    def of(cls, room: BenchRoom, truth: Truth) -> Gaps:
        """Look around from every station."""
        through = _through(room.facts()["openings"], truth)
        return cls(*_discs(truth), _outlook(truth), through)

    def figures(self, vertices: Float64, faces: Int32) -> Figures:
        """How one mesh treats them."""
        import open3d as o3d

        scene = ray_scene(vertices, faces)
        places = o3d.core.Tensor(self.under.astype(np.float32))
        true = scene.compute_distance(places).numpy() <= TRUE_M
        closed = ~self.down.free(scene)
        figures: Figures = {
            "discs_closed_share": float(closed.mean()),
            "disc_worst_closed_share": _worst(closed, self.down.group),
            "discs_true_share": float(true.mean()),
            "disc_worst_true_share": _worst(true, self.down.group),
        }
        if self.unseen.any():
            figures["blind_closed_share"] = float(closed[self.unseen].mean())
            figures["blind_true_share"] = float(true[self.unseen].mean())
        if len(self.outlook.group):
            figures["outlook_free_share"] = float(self.outlook.free(scene).mean())
        if len(self.through.group):
            free = self.through.free(scene)
            figures["openings_free_share"] = float(free.mean())
            figures["opening_worst_free_share"] = _worst(free, self.through.group)
        return figures


def _worst(good: Bools, group: Ints) -> float:
    """The least share of good ones in a group."""
    total = np.bincount(group)
    return float((np.bincount(group, good)[total > 0] / total[total > 0]).min())


def _discs(truth: Truth) -> tuple[Beams, Float64, Bools]:
    """Beams down from the stations, what they meet, and whether no station sees it."""
    rng = np.random.default_rng(3)
    radius = np.sqrt(1 / LOWEST**2 - 1) * np.sqrt(rng.random(DISC_BEAMS))
    around = 2 * np.pi * rng.random(DISC_BEAMS)
    ways = np.stack([radius * np.cos(around), radius * np.sin(around), -np.ones(DISC_BEAMS)], 1)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    origins = np.repeat(truth.stations, DISC_BEAMS, axis=0)
    ways = np.tile(ways, (len(truth.stations), 1))
    met = truth.scene.cast_rays(rays_of(origins, ways))
    reach, face = met["t_hit"].numpy().astype(np.float64), met["primitive_ids"].numpy()
    down = Beams(origins, ways, reach + BESIDE_M, np.arange(len(ways)) // DISC_BEAMS)
    hit = np.isfinite(reach)
    under = origins[hit] + reach[hit, None] * ways[hit]
    return down.take(hit), under, ~truth.seen(under, face[hit].astype(np.int64))


def _outlook(truth: Truth) -> Beams:
    """Beams of the stations that meet nothing, nor do those next to them."""
    elevation = np.radians(np.arange(np.degrees(np.arcsin(LOWEST)), 85, STEP_DEG))
    azimuth = np.radians(np.arange(0, 360, STEP_DEG))
    el, az = np.meshgrid(elevation, azimuth, indexing="ij")
    ways = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=-1)
    number = len(truth.stations)
    beams = Beams(
        np.repeat(truth.stations, el.size, axis=0),
        np.tile(ways.reshape(-1, 3), (number, 1)),
        np.full(number * el.size, FAR_M),
        np.repeat(np.arange(number), el.size),
    )
    panoramas = beams.free(truth.scene).reshape(number, *el.shape)
    wrapped = np.pad(panoramas, [(0, 0), (0, 0), (RIM_STEPS, RIM_STEPS)], mode="wrap")
    plus = np.array([[[0, 1, 0], [1, 1, 1], [0, 1, 0]]], np.bool_)
    inner = binary_erosion(wrapped, plus, iterations=RIM_STEPS)
    return beams.take(inner[:, :, RIM_STEPS:-RIM_STEPS].ravel())


def _through(openings: Sequence[dict[str, Any]], truth: Truth) -> Beams:
    """Beams straight through openings that meet nothing, nor do those around them."""
    none = Beams(np.empty((0, 3)), np.empty((0, 3)), np.empty(0), np.empty(0, np.int64))
    parts = [none, *(_pane(each, number, truth) for number, each in enumerate(openings))]
    return Beams(
        np.concatenate([part.origins for part in parts]),
        np.concatenate([part.ways for part in parts]),
        np.concatenate([part.length_m for part in parts]),
        np.concatenate([part.group for part in parts]),
    )


def _pane(opening: dict[str, Any], number: int, truth: Truth) -> Beams:
    """Those through one, from before the wall to behind it."""
    half = opening["width"] / 2, opening["height"] / 2
    across, along = np.meshgrid(*(np.arange(-h, h, PANE_M) for h in half))
    outward, before = np.array(opening["outward"]), opening["depth"] + BESIDE_M
    at = np.stack([across.ravel(), along.ravel()], axis=1)
    pane = opening["center"] + at @ np.array([opening["right"], opening["up"]])
    beams = Beams(
        pane - before * outward,
        np.tile(outward, (len(at), 1)),
        np.full(len(at), before + BESIDE_M),
        np.full(len(at), number),
    )
    free = beams.free(truth.scene).reshape(across.shape)
    return beams.take(binary_erosion(free, iterations=RIM_STEPS).ravel())
