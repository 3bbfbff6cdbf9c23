"""A tour of two bare rooms, small enough to be built in seconds again and again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from scan_files import cloud_table, write_ply

WIDTH_M, DEPTH_M, HEIGHT_M = 3.0, 2.4, 2.4
POINTS = 30_000

TOUR = """\
[tour]
title = { en = "Two rooms", fr = "Deux pièces" }
languages = ["en", "fr"]

[[room]]
id = "left"
scans = ["scans/left.ply"]
stations = [[0.3, 0.2, 1.5]]
[room.surface]
detail_mm = 30
[room.texture]
texel_mm = 20
[[room.link]]
to = "right"
at = [1.4, 0.0, 1.0]

[[room]]
id = "right"
scans = ["scans/right.ply"]
stations = [[0.3, 0.2, 1.5]]
[room.surface]
detail_mm = 30
[room.texture]
texel_mm = 20
[[room.link]]
to = "left"
at = [-1.4, 0.0, 1.0]
"""


def write_box_tour(folder: Path) -> None:
    """Write tour.toml and scans."""
    (folder / "scans").mkdir()
    (folder / "tour.toml").write_text(TOUR, encoding="utf-8")
    for seed, name in enumerate(("left", "right")):
        points, colors = box_scan(seed)
        write_ply(folder / f"scans/{name}.ply", cloud_table(points, colors))


def box_scan(
    seed: int, points: int = POINTS
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint8]]:
    """Points on the inside of a box, with 1 mm of noise, and a colour a side."""
    rng = np.random.default_rng(seed)
    size = np.array([WIDTH_M, DEPTH_M, HEIGHT_M])
    area = np.array([size[1] * size[2], size[0] * size[2], size[0] * size[1]])
    axis = rng.choice(3, points, p=area / area.sum())
    end = rng.integers(0, 2, points)
    at = rng.random((points, 3)) * size
    at[np.arange(points), axis] = end * size[axis]
    at += rng.normal(0, 0.001, at.shape) - [WIDTH_M / 2, DEPTH_M / 2, 0]
    shade = 70 + 40 * axis + 30 * end
    return at.astype(np.float32), np.stack([shade, 200 - shade, shade // 2], 1).astype(np.uint8)
