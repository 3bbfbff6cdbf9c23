"""Rejoin: points that stand alone in a station's picture, but not in space.

Of a rod, a rim or a tube few beams wide, most points lie on no plane of the picture. In space they
lie where the points kept around them say. So does a mixed pixel close to one of its two surfaces,
which does no harm.

Measured over what ``mixed`` alone would drop: on the stair, of 4,190 true points 3,700 come back,
690 of the 840 of its handrail that nearness alone leaves among them, and 8 % of the mixed pixels
more than 10 mm off; in the chambers 3,100 of 3,340 and 4,210 of 4,540, and 10 to 11 % of such
mixed pixels. Rejected: only what another station measured within 6 mm (1,100 of 3,300); a third
round (20 points more); lines through the nearest five besides planes (25 points more of the
stair, none of the 16 that its lantern's rod lacks).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64
from tourgen.neighbours import Neighbours
from tourgen.stages.sift.nearby import nearby

Mask = npt.NDArray[np.bool_]
_ROUNDS = 2
_NEIGHBOURS = 5
_REACH_STEPS = 4.0
_REACH_M = 0.2
_OFF_SIGMA = 4.0
_CURVED_M = 0.008
_LEAST_COSINE = 0.1


def rejoined(
    points: Float32,
    found: Mask,
    way: Float32,
    spacing_m: Float32,
    noise_m: Float32,
    near_m: float,
) -> Mask:
    """Which of the found points fit those kept around them in space.

    Args:
        points: (n, 3) metres.
        found: (n,) the points in question; m are.
        way: (m, 3) unit directions of the beams that measured these.
        spacing_m: (m,) metres between beams where they lie.
        noise_m: (m,) range noise.
        near_m: A point this near to a kept one fits.
    """
    at = np.flatnonzero(found)
    back = np.zeros(len(at), np.bool_)
    if not len(at):
        return back
    reach_m = np.maximum(np.minimum(_REACH_STEPS * spacing_m, _REACH_M), near_m)
    local = np.flatnonzero(~found & nearby(points, points[at], float(reach_m.max())))
    kept = points[local]
    for _ in range(_ROUNDS):
        if len(kept) < _NEIGHBOURS:
            break
        rest = np.flatnonzero(~back)
        own = points[at[rest]]
        around = Neighbours.of(kept, _NEIGHBOURS)
        index, distance = around.nearest(own, _NEIGHBOURS, float(reach_m.max()))
        fits = distance[:, 0] < near_m
        wide = distance[:, -1] < reach_m[rest]
        fits[wide] |= _on_surface(
            own[wide].astype(np.float64),
            kept[index[wide]].astype(np.float64),
            way[rest[wide]],
            noise_m[rest[wide]],
        )
        if not fits.any():
            break
        back[rest[fits]] = True
        kept = np.concatenate([kept, own[fits]])
    return back


def _on_surface(own: Float64, around: Float64, way: Float32, noise_m: Float32) -> Mask:
    """Whether points lie on the planes through those around them, not too steeply seen."""
    middle = around.mean(axis=1)
    _, size, axes = np.linalg.svd(around - middle[:, None], full_matrices=False)
    normal = axes[:, 2]
    curved_m = size[:, 2] / np.sqrt(_NEIGHBOURS - 3)
    off_m = np.abs(np.einsum("ij,ij->i", own - middle, normal))
    cosine = np.abs(np.einsum("ij,ij->i", way, normal))
    fits = (off_m < _OFF_SIGMA * noise_m + curved_m) & (curved_m < _CURVED_M)
    return np.asarray(fits & (cosine > _LEAST_COSINE))
