"""Grown: the rest of a body most of which was looked through.

Where another station could not see that part of a person (a foot against the floor, a leg behind
the table), it goes with the rest: points in the midst of such ones go too, unless a second
station measured the same place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter
from scipy.spatial import cKDTree

from tourgen.geometry import Float32, PointCloud
from tourgen.stages.mesh_arrays import components
from tourgen.stages.sift.nearby import nearby
from tourgen.stages.sift.strays import clusters
from tourgen.stages.sift.views import View
from tourgen.threads import threads

Mask = npt.NDArray[np.bool_]
_ROUNDS = 4
_GROW_M = 0.05
_GROW_NEIGHBOURS = 10
_SAME_PLACE_M = 0.015
_ENCLAVE_M = 0.2
_BODY_POINTS = 100
_FILLED = 0.9
_FULL = 0.3
_LINK_SPACINGS = 1.7


def bodies(points: Float32, gone: Mask, seen: Sequence[View]) -> Mask:
    """Mask of the (n, 3) points that are gone and belong to a body: a cluster most of which fills
    its part of a picture, as the mixed pixels around an edge do not."""
    at = np.flatnonzero(gone)
    found = np.zeros(len(gone), np.bool_)
    if not len(at):
        return found
    filled = np.zeros(len(gone), np.bool_)
    for view in seen:
        shape = view.picture.beams.shape
        count = np.bincount(view.cell, gone[view.index], minlength=shape[0] * shape[1])
        around = 9 * uniform_filter(count.reshape(shape), 3, mode="constant")
        solid = around > _FILLED * view.picture.beams
        filled[view.index] |= solid.reshape(-1)[view.cell]
    number = clusters(points[at], _GROW_M)
    size = np.bincount(number)
    full = np.bincount(number, filled[at]) > _FULL * size
    found[at] = (full & (size >= _BODY_POINTS))[number]
    return found


def grown(cloud: PointCloud, gone: Mask, body: Mask) -> Mask:
    """``gone``, and the points in the midst of a body that no second station confirms."""
    if not body.any():
        return gone
    around = np.flatnonzero(nearby(cloud.points, cloud.points[body], _ENCLAVE_M + 3 * _GROW_M))
    out = gone.copy()
    out[around] = _grown(cloud.take(around), gone[around])
    return out


def _grown(cloud: PointCloud, gone: Mask) -> Mask:
    gone = gone.copy()
    for _ in range(_ROUNDS):
        if not gone.any():
            break
        rest = np.flatnonzero(~gone)
        distance, _ = cKDTree(cloud.points[gone]).query(
            cloud.points[rest], distance_upper_bound=_GROW_M, workers=threads()
        )
        edge = rest[np.isfinite(distance)]
        edge = edge[~_confirmed(cloud, edge, ~gone, _SAME_PLACE_M)]
        edge = edge[_amid(cloud, edge, gone)]
        if not len(edge):
            break
        gone[edge] = True
    gone[_enclaves(cloud, gone)] = True
    return gone


def _enclaves(cloud: PointCloud, gone: Mask) -> npt.NDArray[np.int64]:
    """Small pieces that only one station measured, next to a body that is gone, and nowhere far
    from it: a shoe that all others have in shadow."""
    body = cloud.points[gone]
    if len(body):
        number = clusters(body, _GROW_M)
        body = body[(np.bincount(number) >= _BODY_POINTS)[number]]
    if not len(body):
        return np.empty(0, np.int64)
    rest = np.flatnonzero(~gone)
    distance, _ = cKDTree(body).query(
        cloud.points[rest], distance_upper_bound=_ENCLAVE_M + _GROW_M, workers=threads()
    )
    near = np.isfinite(distance)
    rest, distance = rest[near], np.asarray(distance)[near]
    alone = ~_confirmed(cloud, rest, ~gone, _SAME_PLACE_M)
    rest, distance = rest[alone], distance[alone]
    if len(rest) < 2:
        return np.empty(0, np.int64)
    tree = cKDTree(cloud.points[rest])
    distance_m = np.asarray(tree.query(cloud.points[rest], k=[2])[0])
    pairs = tree.query_pairs(_LINK_SPACINGS * float(np.median(distance_m)), output_type="ndarray")
    piece = components(pairs, len(rest))
    farthest, nearest = np.zeros(len(rest)), np.full(len(rest), np.inf)
    np.maximum.at(farthest, piece, distance)
    np.minimum.at(nearest, piece, distance)
    return rest[((farthest < _ENCLAVE_M) & (nearest < _GROW_M))[piece]]


def _amid(cloud: PointCloud, edge: npt.NDArray[np.int64], gone: Mask) -> Mask:
    """Which of the points ``edge`` have gone ones for half their neighbours or more."""
    if not len(edge):
        return np.zeros(0, np.bool_)
    tree = cKDTree(cloud.points[edge])
    distance, _ = tree.query(cloud.points, distance_upper_bound=2 * _GROW_M, workers=threads())
    around = np.flatnonzero(np.isfinite(distance))
    far = 2 * _GROW_M
    distance, near = cKDTree(cloud.points[around]).query(
        cloud.points[edge],
        k=np.arange(2, _GROW_NEIGHBOURS + 2),
        distance_upper_bound=far,
    )
    known = np.isfinite(distance)
    at = around[np.where(known, near, 0)]
    own = cloud.station[edge][:, None]
    known &= (cloud.station[at] == own) | (own < 0)
    return np.asarray(2 * (gone[at] & known).sum(axis=1) >= np.maximum(known.sum(axis=1), 1))


def _confirmed(cloud: PointCloud, at: npt.NDArray[np.int64], by: Mask, radius_m: float) -> Mask:
    """Which of the points ``at`` have one of ``by`` from another station within a radius."""
    found = np.zeros(len(at), np.bool_)
    if not len(at):
        return found
    witness = np.flatnonzero(by)
    distance, _ = cKDTree(cloud.points[at]).query(
        cloud.points[witness], distance_upper_bound=2 * radius_m, workers=threads()
    )
    witness = witness[np.isfinite(distance)]
    for station in np.unique(cloud.station[witness]):
        own = witness[cloud.station[witness] == station]
        others = np.flatnonzero(cloud.station[at] != station)
        distance, _ = cKDTree(cloud.points[own]).query(
            cloud.points[at[others]], distance_upper_bound=radius_m, workers=threads()
        )
        found[others] |= np.isfinite(distance)
    return found
