"""Mixed pixels: returns of beams that struck two surfaces at once.

Such a return lies on its beam somewhere between the two. In the station's picture it is an edge
pixel whose range is that of neither side. The test is the other way round: a true point has
company. The points of a plane have inverse ranges that are linear in the picture, whatever the
slant, so a true point lies on a plane through two of its eight nearest neighbours in the picture
on which several more of the nearest twenty lie, to within the noise.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32
from tourgen.stages.sift.views import View

Mask = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.floating]
Places = tuple[Float32, Float32, Float32]
_RING = 8
_NEAR = 20
_COMPANY = 8
"""Fewest points on one plane. Between two sides a steep plane may pass through three points of
each."""
_STEEP = 8.0
_STEEP_COMPANY = 13
_ROW = 3
"""Fewest points on one line, on both sides of a point."""
_SUSPECT_SIGMA = 2.5
_PLANE_SIGMA = 1.2
_OWN_SIGMA = 2.5
_BETWEEN_SIGMA = 3.0
_SAMPLE = 50_000


def mixed(count: int, seen: Iterable[View], near_m: float) -> Mask:
    """Mask of the ``count`` points that have no company in any view they are in."""
    alone, company = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    for view in seen:
        if len(view) <= _NEAR:
            continue
        noise_m = _noise_m(view)
        suspect = np.concatenate(
            [at[_bent(view, at, noise_m[at])] for at in view.blocks(np.arange(len(view)))]
        )
        lonely = np.zeros(len(view), np.bool_)
        for at in view.blocks(suspect):
            between = at[_between(view, at, noise_m[at])]
            lonely[between] = ~_in_company(view, between, noise_m[between], near_m)
        alone[view.index[lonely]] = True
        company[view.index[~lonely]] = True
    return alone & ~company


def _residual_m(view: View, at: npt.NDArray[np.int64]) -> Float32:
    """How far each point lies off the mean of its ring, along the beam."""
    around = (1 / view.range_m)[view.neighbours(at, _RING)].mean(axis=1)
    own = view.range_m[at]
    return np.asarray(np.abs(around - 1 / own) * own * own, np.float32)


def _bent(view: View, at: npt.NDArray[np.int64], noise_m: Float32) -> Mask:
    return np.asarray(_residual_m(view, at) > _SUSPECT_SIGMA * noise_m)


def _between(view: View, at: npt.NDArray[np.int64], noise_m: Float32) -> Mask:
    """Whether a point lies well behind one of its ring and well before another."""
    ring, own = view.range_m[view.neighbours(at, _RING)], view.range_m[at]
    before = own - ring.min(axis=1) > _BETWEEN_SIGMA * noise_m
    return np.asarray(before & (ring.max(axis=1) - own > _BETWEEN_SIGMA * noise_m))


def _noise_m(view: View) -> Float32:
    """Range noise at each point, from what smooth surfaces show at such a range.

    The lower quartile of the residuals is that of smooth places, whatever the furniture; of a
    normal distribution it is 0.32 standard deviations.
    """
    rng = np.random.default_rng(0)
    sample = rng.choice(len(view), min(_SAMPLE, len(view)), replace=False)
    residual = _residual_m(view, sample)
    order = np.argsort(view.range_m[sample])
    groups = np.array_split(order, max(1, len(order) // 2000))
    middle = [float(np.median(view.range_m[sample[each]])) for each in groups]
    noise = [float(np.quantile(residual[each], 0.25)) / 0.32 for each in groups]
    lowest = 1e-6 * float(np.median(view.range_m))  # float32
    return np.maximum(np.interp(view.range_m, middle, noise), lowest).astype(np.float32)


def _in_company(view: View, at: npt.NDArray[np.int64], noise_m: Float32, near_m: float) -> Mask:
    places = _picture(view, at, view.neighbours(at, _NEAR))
    u, v, inverse = places
    own = view.range_m[at]
    radius = np.hypot(u, v)
    reach = radius / np.maximum(radius[:, :_RING].mean(axis=1, keepdims=True), 1e-9)
    error = noise_m / (own * own)
    tolerance = _PLANE_SIGMA * error[:, None] * (1 + reach)
    company = _on_line(places, own, tolerance)
    for corners in _triples(places):
        level, slope_u, slope_v, wide = _plane(*corners)
        off = np.abs(inverse - level[:, None] - slope_u[:, None] * u - slope_v[:, None] * v)
        friends = off < tolerance
        slope = own * np.hypot(slope_u, slope_v)
        enough = friends.sum(axis=1) >= np.where(slope > _STEEP, _STEEP_COMPANY, _COMPANY)
        check = np.flatnonzero(wide & enough & ~company)
        if len(check):
            off, spread = _own_place(friends[check], u[check], v[check], inverse[check])
            square = own[check] ** 2
            off_m = off * square / np.hypot(1, slope[check])
            spread *= _OWN_SIGMA * error[check]
            company[check] = (off < spread) | (off_m < near_m)
    return company


def _on_line(places: Places, own: Float32, tolerance: Float32) -> Mask:
    """Whether a point lies on a straight row of others that goes on to both sides, as on a rod
    one beam wide."""
    u, v, inverse = places
    apart = 0.35 * np.hypot(u[:, :_RING], v[:, :_RING]).mean(axis=1, keepdims=True)
    found = np.zeros(len(u), np.bool_)
    for number in range(_RING):
        length = np.maximum(np.hypot(u[:, number], v[:, number]), 1e-9)[:, None]
        right, up = u[:, number, None] / length, v[:, number, None] / length
        along = u * right + v * up
        slope = inverse[:, number, None] / length
        row = (np.abs(u * up - v * right) < apart) & (np.abs(along) > apart)
        row &= np.abs(inverse - slope * along) < tolerance
        both = (row & (along < 0)).any(axis=1) & (row.sum(axis=1) >= _ROW)
        found |= both & (np.abs(slope[:, 0]) * own < _STEEP)
    return found


def _triples(places: Places) -> Iterator[tuple[Float32, Float32, Float32]]:
    """Corners of planes to try, each (n, 3): the point with two of its ring, then two of its
    ring with one farther out between them."""
    stacked = np.stack(places, axis=-1)
    angle = np.arctan2(places[1], places[0])
    ring = np.argsort(angle[:, :_RING], axis=1)
    outer = _RING + np.argsort(angle[:, _RING:], axis=1)
    rows = np.arange(len(stacked))
    own = np.zeros_like(stacked[:, 0])
    for number in range(_RING):
        first = stacked[rows, ring[:, number]]
        for turn in (1, 2):
            yield own, first, stacked[rows, ring[:, (number + turn) % _RING]]
    for number in range(_RING):
        beyond = ((number + 1) * (_NEAR - _RING) // _RING) % (_NEAR - _RING)
        yield (
            stacked[rows, ring[:, number]],
            stacked[rows, ring[:, (number + 2) % _RING]],
            stacked[rows, outer[:, beyond]],
        )


def _plane(a: Floats, b: Floats, c: Floats) -> tuple[Floats, Floats, Floats, Mask]:
    """Level and slopes of the planes through three points each, and whether these span one."""
    b, c = b - a, c - a
    area = b[:, 0] * c[:, 1] - c[:, 0] * b[:, 1]
    wide = np.abs(area) > 0.3 * np.hypot(b[:, 0], b[:, 1]) * np.hypot(c[:, 0], c[:, 1])
    area[~wide] = 1
    slope_u = (b[:, 2] * c[:, 1] - c[:, 2] * b[:, 1]) / area
    slope_v = (b[:, 0] * c[:, 2] - c[:, 0] * b[:, 2]) / area
    return a[:, 2] - slope_u * a[:, 0] - slope_v * a[:, 1], slope_u, slope_v, wide


def _own_place(friends: Mask, u: Float32, v: Float32, inverse: Float32) -> tuple[Float32, Float32]:
    """How far the point itself, at (0, 0, 0), lies off the plane fitted through its friends, and
    by how many times its error that would vary."""
    scale = np.maximum(np.hypot(u, v).max(axis=1, keepdims=True), 1e-9)
    terms = np.stack([np.ones_like(u), u / scale, v / scale], axis=-1) * friends[..., None]
    normal = np.einsum("nki,nkj->nij", terms, terms).astype(np.float64)
    covariance = np.linalg.inv(normal + 1e-6 * np.eye(3))
    off = np.abs(np.einsum("ni,nki,nk->n", covariance[:, 0], terms, inverse))
    return off.astype(np.float32), np.sqrt(1 + np.maximum(covariance[:, 0, 0], 0)).astype(
        np.float32
    )


def _picture(view: View, at: npt.NDArray[np.int64], near: npt.NDArray[np.int64]) -> Places:
    """Neighbours in the picture plane about each point: place (u, v), and inverse depth less the
    point's own."""
    axis = view.direction[at]
    up = np.zeros_like(axis)
    up[np.arange(len(axis)), np.argmin(np.abs(axis), axis=1)] = 1
    right = np.cross(up, axis)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    above = np.cross(axis, right)
    way = view.direction[near]
    ahead = np.maximum(np.einsum("nkj,nj->nk", way, axis), 1e-3)
    u = np.einsum("nkj,nj->nk", way, right) / ahead
    v = np.einsum("nkj,nj->nk", way, above) / ahead
    return u, v, 1 / (view.range_m[near] * ahead) - 1 / view.range_m[at][:, None]
