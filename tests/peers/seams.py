"""Seams between stations: steps of colour where the set of stations that see a surface changes.

A pixel's error is published less true, after the room's gain. Along rows and columns of each
picture, a border lies between two runs of pixels each of which one set of stations truly sees;
it counts where the true surface runs on, the truth is of one colour across both runs, and the
contestant's surface stands within 5 mm of the true one at every pixel of them: elsewhere the
picture shows another thing's colour, which is a fault of the shape, told by the surface's figures
and by PSNR. (Counted as seams, a beam's ragged edge and a bookcase's were worth 13.5 of 255.) The
step is the mean error of the one run less that of the other. One pixel's step is noise; a seam is
what is left when all borders between the same two sets are averaged over the room's pictures
(``seam_max``), or, as a step may have one sign here and another there, over one picture
(``seam_view_max``).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from drawing import SIZE, Camera, tensor
from numpy.lib.stride_tricks import sliding_window_view
from picture_score import corrected
from score import LOWEST, PLAY_M
from surface_score import Figures
from true_picture import Shot, TexturedTruth

from tourgen.geometry import Float64, Int32, UInt8
from tourgen.rays import ray_scene

RUN_PX = 8
REST_PX = 2
"""Between the runs, where blending may take place."""
FLAT = 8
"""The truth's channels differ by at most so much across both runs, of 255."""
BEND = 0.01
"""Depths differ from a straight line by at most this share."""
CLOSE_M = 0.005
"""The contestant's surface lies within this of the true one, along the ray."""
LEAST_PX = 400
"""Of border, or the sets say nothing."""

Bools = npt.NDArray[np.bool_]
Codes = npt.NDArray[np.int64]


def seam_figures(
    truth: TexturedTruth,
    cameras: Sequence[Camera],
    pictures: Sequence[UInt8],
    shots: Sequence[Shot],
    gain: Float64,
    surface: tuple[Float64, Int32],
) -> Figures:
    """The largest and the median seam of a room, of 255, and how many pairs of sets were met.

    Args:
        truth: Of the room.
        cameras: c of them.
        pictures: (h, w, 3) each, what they see of the contestant.
        shots: What they truly see.
        gain: (3,) of the room's pictures.
        surface: The contestant's vertices and faces.
    """
    keys: list[Codes] = []
    steps: list[Float64] = []
    views: list[Codes] = []
    scene = ray_scene(*surface)
    for number, (camera, picture, shot) in enumerate(zip(cameras, pictures, shots, strict=True)):
        codes = seen_by(truth, camera, shot)
        codes[~stands(scene, camera, shot)] = -1
        error = corrected(picture, gain) - shot.picture
        fields = (codes, error, shot.picture, shot.depth_m)
        for axes in ((0, 1), (1, 0)):
            key, step = _steps(*(np.moveaxis(each, axes, (0, 1)) for each in fields))
            keys.append(key)
            steps.append(step)
            views.append(np.full(len(key), number))
    key, step = np.concatenate(keys), np.concatenate(steps)
    mean = _means(key, step)
    if not len(mean):
        return {"seams": 0}
    found: Figures = {
        "seams": len(mean),
        "seam_max": float(mean.max()),
        "seam_median": float(np.median(mean)),
    }
    of_view = _means(key << 8 | np.concatenate(views), step)
    return found | ({"seam_view_max": float(of_view.max())} if len(of_view) else {})


def _means(key: Codes, step: Float64) -> Float64:
    """The largest channel of the mean step of each key met often enough, without its sign."""
    keys, number = np.unique(key, return_inverse=True)
    count = np.bincount(number, minlength=len(keys))
    sums = np.stack([np.bincount(number, step[:, k], len(keys)) for k in range(3)], axis=1)
    mean: Float64 = np.abs(sums[count >= LEAST_PX] / count[count >= LEAST_PX, None]).max(axis=1)
    return mean


def stands(scene: Any, camera: Camera, shot: Shot) -> Bools:
    """(h, w) whether a surface stands where the true one does."""
    cast = camera.rays(SIZE)
    reach = scene.cast_rays(tensor(cast))["t_hit"].numpy().astype(np.float64)
    depth_m = reach * np.linalg.norm(cast[..., 3:], axis=2)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(depth_m - shot.depth_m) < CLOSE_M)


def seen_by(truth: TexturedTruth, camera: Camera, shot: Shot) -> Codes:
    """(h, w) a bit for each station that truly sees what the pixel shows; -1 where not judged."""
    cast = camera.rays(SIZE)
    answer = truth.scene.cast_rays(tensor(cast))
    normals = answer["primitive_normals"].numpy().astype(np.float64)
    ahead = cast[..., 3:] / np.linalg.norm(cast[..., 3:], axis=2, keepdims=True)
    places = camera.position + ahead * np.where(shot.judged, shot.depth_m, 0)[..., None]
    codes = np.zeros(shot.judged.shape, np.int64)
    for bit, station in enumerate(truth.facts["stations"]):
        way = places - np.array(station["position"])
        length = np.linalg.norm(way, axis=2)
        direction = way / np.maximum(length, 1e-9)[..., None]
        origins = np.broadcast_to(np.array(station["position"]), way.shape)
        rays = np.concatenate([origins, direction], axis=2)
        reach = truth.scene.cast_rays(tensor(rays))["t_hit"].numpy()
        sees = (reach > length - PLAY_M) & (direction[..., 2] > LOWEST)
        sees &= (direction * normals).sum(axis=2) < 0
        codes += sees.astype(np.int64) << bit
    codes[~shot.judged] = -1
    return codes


def _steps(codes: Codes, error: Float64, picture: UInt8, depth_m: Float64) -> tuple[Codes, Float64]:
    """(n,) a number for the two sets on either side of each border met, (n, 3) its step."""
    span = 2 * RUN_PX + REST_PX
    runs = sliding_window_view(codes, span, axis=1)
    one, other = runs[..., 0], runs[..., -1]
    border = (one != other) & (one > 0) & (other > 0)
    row, column = np.nonzero(border)
    near = runs[row, column]
    even = (near[:, :RUN_PX] == near[:, :1]).all(axis=1)
    even &= (near[:, -RUN_PX:] == near[:, -1:]).all(axis=1)
    colors = sliding_window_view(picture, span, axis=1)[row, column].astype(np.int16)
    even &= (colors.max(axis=2) - colors.min(axis=2)).max(axis=1) <= FLAT
    depth = sliding_window_view(depth_m, span, axis=1)[row, column]
    line = np.linspace(0, 1, span)
    with np.errstate(invalid="ignore"):
        bend = depth - (depth[:, :1] * (1 - line) + depth[:, -1:] * line)
        even &= np.abs(bend).max(axis=1) < BEND * depth[:, 0]
    chosen = np.flatnonzero(even)
    errors = sliding_window_view(error, span, axis=1)[row[chosen], column[chosen]]
    step = errors[..., :RUN_PX].mean(axis=2) - errors[..., -RUN_PX:].mean(axis=2)
    low = np.minimum(near[chosen, 0], near[chosen, -1])
    high = np.maximum(near[chosen, 0], near[chosen, -1])
    sign = np.where(near[chosen, 0] == low, 1, -1)
    return low << 20 | high, step * sign[:, None]
