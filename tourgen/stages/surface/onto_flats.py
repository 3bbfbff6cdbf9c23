"""Tangent planes of walls, floors and boards are moved onto the planes of these.

They carry what is left of the noise: a wall drawn from them ripples by a few degrees, and the line
where two walls meet wanders by millimetres. Where many of them agree on one plane (``flats``), that
plane is known far better than any of them is, and every tangent plane that lies on it within the
noise is moved onto it and takes its normal. So do those beside a crease whose normals, fitted
across it, look along neither side: that is what makes creases straight.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tourgen.compiled import compiled
from tourgen.geometry import Float32, Float64, Int32
from tourgen.neighbours import Neighbours
from tourgen.stages.surface.flats import BENT, Flats, Ints, Surfels, grown, surfels_of
from tourgen.stages.surface.tangent_planes import TangentPlanes
from tourgen.threads import in_parts

_OFF = 2.5
"""How far off a flat a tangent plane may lie, in standard deviations of the points."""
_TURNED = 0.5
"""Cosine between a tangent plane's normal and its flat's, at least."""
_WIDE_M = 1.0
"""Standard deviation across of a flat of which heights tell enough, at least. From 0.25 or 0.6 on,
panelled walls become flats that are none (chamber1, F-score at 5 mm: 0.971 instead of 0.976)."""
_AROUND = 4
_PART = 1 << 15


def flattened(planes: TangentPlanes, spacing_m: float) -> tuple[TangentPlanes, Flats]:
    """Move the tangent planes that lie on a common plane onto it.

    Args:
        planes: n tangent planes.
        spacing_m: Distance between neighbouring points in the middle of the room.

    Returns:
        The tangent planes, and the flats on which they lie.
    """
    surfels = surfels_of(planes, spacing_m)
    flats = grown(surfels, planes.noise_m)
    label = _straight(planes, np.append(flats.of, -1)[surfels.of], flats)[flats.of]
    return _moved(planes, surfels, replace(flats, of=label))


def _straight(planes: TangentPlanes, label: Ints, flats: Flats) -> Ints:
    """(p + 1,) number of each flat; -1 where its normals turn as a bent surface's would, and last.

    A strip may be too narrow for its surfels' heights to tell. Across a room they tell best, and
    the least that its normals are wrong together comes to millimetres: a floor of five metres, seen
    in 15 million points, was none for that.

    Args:
        planes: n tangent planes.
        label: (n,) the flat that each is of, -1 where of none.
        flats: p of them.
    """
    own = np.flatnonzero(label >= 0)
    label, count = label[own], len(flats.normals)
    across = np.linalg.svd(flats.normals[:, None])[2][:, 1:].astype(np.float32)

    def mean(values: Float32) -> Float64:
        number = np.maximum(np.bincount(label, minlength=count), 1)
        return np.asarray(np.bincount(label, values, minlength=count) / number)

    def apart(values: Float32) -> Float32:
        found = np.einsum("nij,nj->ni", across[label], values[own])
        return np.asarray(found - np.stack([mean(each) for each in found.T], 1)[label], np.float32)

    at, turn = apart(planes.points), apart(planes.normals)
    spread = np.stack([[mean(x * y) for x in at.T] for y in at.T]).transpose(2, 0, 1)
    turned = np.stack([[mean(x * y) for x in at.T] for y in turn.T]).transpose(2, 0, 1)
    bend = turned @ np.linalg.pinv(spread)
    height = np.einsum("ni,nij,nj->n", at, bend[label].astype(np.float32), at) / 2
    height -= mean(height).astype(np.float32)[label]
    wide = np.linalg.eigvalsh(spread)[:, 0] > _WIDE_M**2
    bent = ~wide & (np.sqrt(mean(np.square(height))) > BENT * planes.noise_m)
    return np.append(np.where(bent, -1, np.arange(count)), -1)


def _moved(planes: TangentPlanes, surfels: Surfels, flats: Flats) -> tuple[TangentPlanes, Flats]:
    """The tangent planes, those near a flat on it; the flats, with these instead of surfels."""
    lain = np.flatnonzero(flats.of >= 0)
    if not len(lain):
        return planes, replace(flats, of=np.full(len(planes.points), -1))
    around = Neighbours.of(surfels.points[lain], _AROUND)
    near, _ = around.nearest(planes.points, _AROUND, 1.5 * surfels.edge_m)
    label = np.append(flats.of[lain], -1).astype(np.int32)
    chosen, height = _nearest(planes, flats, label[near])
    on = np.flatnonzero(chosen >= 0)
    points, normals, support = planes.points.copy(), planes.normals.copy(), planes.support.copy()
    normals[on] = flats.normals[chosen[on]]
    points[on] -= height[on, None] * normals[on]
    support[on] = 1
    moved = TangentPlanes(points, normals, planes.spacing_m, support, planes.noise_m)
    return moved, replace(flats, of=chosen)


def _nearest(planes: TangentPlanes, flats: Flats, label: Int32) -> tuple[Ints, Float32]:
    """Which of a few flats each tangent plane lies on, -1 for none, and how high over it.

    Args:
        planes: n tangent planes.
        flats: See there.
        label: (n, k) numbers of the flats near each, -1 for none.
    """
    chosen, height = np.full(len(label), -1), np.zeros(len(label), np.float32)
    normals, offsets_m = flats.normals.astype(np.float32), flats.offsets_m.astype(np.float32)
    most_m = np.float32(_OFF * planes.noise_m)

    def choose(first: int, last: int) -> None:
        some = slice(first, last)
        lying = planes.points[some], planes.normals[some], label[some]
        _choose(normals, offsets_m, most_m, *lying, chosen[some], height[some])

    in_parts(choose, len(label), _PART)
    return chosen, height


@compiled
def _choose(
    flat_normals: Float32,
    offsets_m: Float32,
    most_m: np.float32,
    points: Float32,
    normals: Float32,
    label: Int32,
    chosen: Ints,
    height_m: Float32,
) -> None:
    """Write what ``_nearest`` tells of some tangent planes."""
    for i in range(len(points)):
        best = np.float32(np.inf)
        for flat in label[i]:
            if flat < 0:
                continue
            height, turned = -offsets_m[flat], np.float32(0)
            for axis in range(3):
                height += points[i, axis] * flat_normals[flat, axis]
                turned += normals[i, axis] * flat_normals[flat, axis]
            cost = abs(height) / most_m + 2 * (1 - turned)
            if abs(height) < most_m and turned > _TURNED and cost < best:
                best, chosen[i], height_m[i] = cost, flat, height
