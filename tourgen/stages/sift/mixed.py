"""Mixed pixels: returns of beams that struck two surfaces at once.

Such a return lies on its beam somewhere between the two. In the station's picture it is an edge
pixel whose range is that of neither side. The test is the other way round: a true point has
company. The points of a plane have inverse ranges that are linear in the picture, whatever the
slant, so a true point lies on a plane through two of its eight nearest neighbours in the picture
on which several more of the nearest twenty lie, to within the noise. Only points off the plane
about their cell are asked: not one of the demo's 7,800 mixed pixels lies on one. Who is lonely in
the picture may still have company in space (``rejoin.py``): rods, rims, tubes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32
from tourgen.stages.sift.rejoin import rejoined
from tourgen.stages.sift.views import Surroundings, View
from tourgen.threads import each

Mask = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int64]
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
_NEAR_M = 0.006


def mixed(points: Float32, seen: Iterable[View], near_m: float) -> Mask:
    """Mask of the (n, 3) points that have no company in any view they are in, nor in space."""
    alone, company = np.zeros((2, len(points)), np.bool_)
    way = np.zeros((len(points), 3), np.float32)
    spacing_m, noise_m = np.zeros((2, len(points)), np.float32)
    for view in seen:
        lonely = np.zeros(len(view), np.bool_)
        suspect = np.flatnonzero(~view.smooth)
        suspect = suspect[np.argsort(view.cell[suspect], kind="stable")]
        if len(view) > _NEAR and len(suspect):
            look = partial(_lonely, view, view.around(suspect, _NEAR))
            lonely[np.concatenate(each(look, view.blocks(suspect)))] = True
        at = view.index[lonely]
        alone[at] = True
        company[view.index[~lonely]] = True
        way[at], noise_m[at] = view.direction[lonely], view.noise_m[lonely]
        spacing_m[at] = view.range_m[lonely] * view.picture.step_rad
    found = alone & ~company
    back = rejoined(points, found, way[found], spacing_m[found], noise_m[found], near_m)
    found[np.flatnonzero(found)[back]] = False
    return found


def _lonely(view: View, around: Surroundings, at: Indices) -> Indices:
    """Which of the points ``at`` of a view have no company in it."""
    near = around.neighbours(at, _NEAR)
    edge = _bent(view, at, near) & _between(view, at, near)
    at, near = at[edge], near[edge]
    return np.asarray(at[~_in_company(view, at, near)])


def _bent(view: View, at: Indices, near: Indices) -> Mask:
    """Whether a point lies off the mean of its ring, along the beam."""
    around = (1 / view.range_m)[near[:, :_RING]].mean(axis=1)
    own = view.range_m[at]
    return np.asarray(np.abs(around - 1 / own) * own * own > _SUSPECT_SIGMA * view.noise_m[at])


def _between(view: View, at: Indices, near: Indices) -> Mask:
    """Whether a point lies well behind one of its ring and well before another."""
    ring, own = view.range_m[near[:, :_RING]], view.range_m[at]
    least = _BETWEEN_SIGMA * view.noise_m[at]
    return np.asarray((own - ring.min(axis=1) > least) & (ring.max(axis=1) - own > least))


def _in_company(view: View, at: Indices, near: Indices) -> Mask:
    places = _picture(view, at, near)
    u, v, inverse = places
    own = view.range_m[at]
    radius = np.hypot(u, v)
    reach = radius / np.maximum(radius[:, :_RING].mean(axis=1, keepdims=True), 1e-9)
    error = view.noise_m[at] / (own * own)
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
            off_m = off * own[check] ** 2 / np.hypot(1, slope[check])
            company[check] = (off < spread * _OWN_SIGMA * error[check]) | (off_m < _NEAR_M)
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


def _picture(view: View, at: Indices, near: Indices) -> Places:
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
