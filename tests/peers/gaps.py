"""Whether gaps of the scan are closed where there is a surface, and stay open where there is none.

The disc under each tripod is where beams steeper than its scanner looks would have ended: seen by
other stations in part, or by none. An opening is a patch of directions in which a station sees
nothing at all, neither shell nor furniture: a door, a window, a porthole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_erosion, label
from score import LOWEST, Truth
from surface_score import Figures

from tourgen.geometry import Float64, Int32
from tourgen.simulation.light import ray_scene, rays_of

CLOSED_M = 0.020
"""A disc is closed where the mesh lies so near to it."""
DISC_BEAMS = 20_000
STEP_DEG = 0.2
RIM_STEPS = 2
"""So near to its rim, some 20 mm, an opening is not judged."""
LEAST_BEAMS = 50
"""Fewer are a slit between two things, or an opening seen edge on."""
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Gaps:
    """A room's blind discs and openings.

    Attributes:
        under: (n, 3) places on the true surface right under the stations, even over a level floor.
        disc: (n,) number of the station that each lies under.
        unseen: (n,) no station sees it.
        origins: (m, 3) of beams that meet nothing, and
        ways: (m, 3) their directions.
        opening: (m,) number of the opening that each passes: each station's count for themselves.
    """

    under: Float64
    disc: npt.NDArray[np.int64]
    unseen: Bools
    origins: Float64
    ways: Float64
    opening: npt.NDArray[np.int64]

    @classmethod
    def of(cls, truth: Truth) -> Gaps:
        """Look around from every station."""
        under, disc, unseen = _discs(truth)
        return cls(under, disc, unseen, *_openings(truth))

    def figures(self, vertices: Float64, faces: Int32) -> Figures:
        """How one mesh treats them."""
        import open3d as o3d

        scene = ray_scene(vertices, faces)
        places = o3d.core.Tensor(self.under.astype(np.float32))
        closed = scene.compute_distance(places).numpy() <= CLOSED_M
        figures: Figures = {
            "discs_closed_share": float(closed.mean()),
            "disc_worst_closed_share": _worst(closed, self.disc),
        }
        if self.unseen.any():
            figures["blind_closed_share"] = float(closed[self.unseen].mean())
        if len(self.opening):
            reach = scene.cast_rays(rays_of(self.origins, self.ways))["t_hit"].numpy()
            free = np.isinf(reach)
            figures["openings_free_share"] = float(free.mean())
            figures["opening_worst_free_share"] = _worst(free, self.opening)
        return figures


def _worst(good: Bools, group: npt.NDArray[np.int64]) -> float:
    """The least share of good ones in a group."""
    total = np.bincount(group)
    return float((np.bincount(group, good)[total > 0] / total[total > 0]).min())


def _discs(truth: Truth) -> tuple[Float64, npt.NDArray[np.int64], Bools]:
    """Places under the stations, under which, and whether no station sees them."""
    rng = np.random.default_rng(3)
    radius = np.sqrt(1 / LOWEST**2 - 1) * np.sqrt(rng.random(DISC_BEAMS))
    around = 2 * np.pi * rng.random(DISC_BEAMS)
    ways = np.stack([radius * np.cos(around), radius * np.sin(around), -np.ones(DISC_BEAMS)], 1)
    origins = np.repeat(truth.stations, DISC_BEAMS, axis=0)
    ways = np.tile(ways, (len(truth.stations), 1))
    met = truth.scene.cast_rays(rays_of(origins, ways))
    reach, face = met["t_hit"].numpy(), met["primitive_ids"].numpy()
    hit = np.flatnonzero(np.isfinite(reach))
    under = origins[hit] + reach[hit, None] * ways[hit]
    return under, hit // DISC_BEAMS, ~truth.seen(under, face[hit].astype(np.int64))


def _openings(truth: Truth) -> tuple[Float64, Float64, npt.NDArray[np.int64]]:
    """Beams that meet nothing, where they start and go, and which opening they pass."""
    elevation = np.radians(np.arange(np.degrees(np.arcsin(LOWEST)), 85, STEP_DEG))
    azimuth = np.radians(np.arange(0, 360, STEP_DEG))
    el, az = np.meshgrid(elevation, azimuth, indexing="ij")
    ways = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=-1)
    places, directions, numbers = [np.empty((0, 3))], [np.empty((0, 3))], [np.empty(0, np.int64)]
    for station in truth.stations:
        origins = np.broadcast_to(station, (el.size, 3))
        reach = truth.scene.cast_rays(rays_of(origins, ways.reshape(-1, 3)))["t_hit"].numpy()
        free = np.isinf(reach).reshape(el.shape)
        seam = int(free.sum(axis=0).argmin())  # cuts the panorama open beside the openings
        inner = binary_erosion(np.roll(free, -seam, axis=1), iterations=RIM_STEPS)
        patch = np.roll(label(inner)[0], seam, axis=1)
        large = np.isin(patch, 1 + np.flatnonzero(np.bincount(patch.ravel())[1:] >= LEAST_BEAMS))
        places.append(np.broadcast_to(station, (int(large.sum()), 3)))
        directions.append(ways[large])
        before = max(int(each.max(initial=0)) for each in numbers)
        numbers.append(patch[large].astype(np.int64) + before)
    return np.concatenate(places), np.concatenate(directions), np.concatenate(numbers)
