"""Draws coloured meshes by casting rays: nine a pixel, averaged as light, no shading."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64, Int32, UInt8
from tourgen.simulation.atlas import sample

sys.path.insert(0, str(Path(__file__).parents[1]))
from visitor import rays

SIZE = (960, 540)
FINENESS = 3
"""Rays a pixel along each axis."""
_ROWS_AT_ONCE = 90

Ints = npt.NDArray[np.int64]
ColorsAt = Callable[[Ints, Float32], UInt8]
"""(n,) faces and (n, 2) barycentric shares of their second and third corners -> (n, 3) sRGB."""

_LIGHT = np.arange(256) / 255
_LIGHT = np.where(_LIGHT <= 0.04045, _LIGHT / 12.92, ((_LIGHT + 0.055) / 1.055) ** 2.4)
_LIGHT = _LIGHT.astype(np.float32)
"""Of each sRGB value."""


@dataclass(frozen=True)
class Camera:
    """An eye and what it looks at, metres."""

    position: Float64
    look_at: Float64

    def rays(self, size: tuple[int, int]) -> Float32:
        """(h, w, 6) through the middles of the pixels of a picture."""
        return rays(self.position, self.look_at, size)


def textured(uv: Float32, faces: Int32, texture: UInt8) -> ColorsAt:
    """Colours from a picture; ``uv`` (v, 2), (0, 0) in the upper left corner."""

    def colors_at(face: Ints, share: Float32) -> UInt8:
        return sample(texture, blended(uv[faces[face]], share))

    return colors_at


def vertex_colored(colors: UInt8, faces: Int32) -> ColorsAt:
    """Colours blended between those of a face's corners."""

    def colors_at(face: Ints, share: Float32) -> UInt8:
        mixed: UInt8 = np.rint(blended(colors[faces[face]].astype(np.float32), share)).astype(
            np.uint8
        )
        return mixed

    return colors_at


def relief(vertices: Float64, faces: Int32, eye: Float64) -> ColorsAt:
    """Grey by the angle at which an eye looks at a face; red from behind."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-15)
    ways = (eye - vertices).astype(np.float32)

    def colors_at(face: Ints, share: Float32) -> UInt8:
        way = blended(ways[faces[face]], share)
        cosine = (normal[face] * way).sum(axis=1) / np.linalg.norm(way, axis=1)
        shades = np.repeat((40 + 210 * np.abs(cosine))[:, None], 3, axis=1).astype(np.uint8)
        shades[cosine < 0, 1:] //= 3
        return shades

    return colors_at


def blended(corners: Float32, share: Float32) -> Float32:
    """(n, k) values of (n, 3, k) at the corners, blended."""
    mixed: Float32 = corners[:, 0] * (1 - share.sum(axis=1))[:, None]
    mixed += corners[:, 1] * share[:, :1] + corners[:, 2] * share[:, 1:]
    return mixed


def draw(
    scene: Any,
    colors_at: ColorsAt,
    camera: Camera,
    size: tuple[int, int] = SIZE,
    void: tuple[int, int, int] = (205, 216, 224),
) -> UInt8:
    """(h, w, 3) what a camera sees of a ray casting scene, ``void`` where there is nothing."""
    width, height = size
    fine = camera.rays((width * FINENESS, height * FINENESS))
    light = np.zeros((height, width, 3), np.float32)
    for top in range(0, height, _ROWS_AT_ONCE):
        cast = fine[top * FINENESS : (top + _ROWS_AT_ONCE) * FINENESS]
        answer = scene.cast_rays(tensor(cast))
        found = np.isfinite(answer["t_hit"].numpy())
        colors = np.full((*found.shape, 3), void, np.uint8)
        colors[found] = colors_at(
            answer["primitive_ids"].numpy()[found].astype(np.int64),
            answer["primitive_uvs"].numpy()[found],
        )
        blocks = _LIGHT[colors].reshape(-1, FINENESS, width, FINENESS, 3)
        light[top : top + _ROWS_AT_ONCE] = blocks.mean(axis=(1, 3))
    return _encoded(light)


def splatted(
    points: Float32,
    colors: UInt8,
    camera: Camera,
    size: tuple[int, int] = SIZE,
    void: tuple[int, int, int] = (205, 216, 224),
) -> UInt8:
    """(h, w, 3) what a camera sees of a cloud, each point a dot of 2 x 2 pixels."""
    width, height = size
    cast = camera.rays(size)[..., 3:].astype(np.float64)
    corner, right, down = cast[0, 0], cast[0, 1] - cast[0, 0], cast[1, 0] - cast[0, 0]
    # A point lies along a ray: way = depth * (corner + column * right + row * down).
    ahead = np.linalg.inv(np.stack([corner, right, down], axis=1))
    depth, column, row = ((points - camera.position) @ ahead.T).T
    before = np.flatnonzero(depth > 0)
    before = before[np.argsort(-depth[before], kind="stable")]
    picture = np.full((height, width, 3), void, np.uint8)
    for right_px, down_px in ((0, 0), (1, 0), (0, 1), (1, 1)):
        x = np.floor(column[before] / depth[before]).astype(np.int64) + right_px
        y = np.floor(row[before] / depth[before]).astype(np.int64) + down_px
        seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        # The last of several values for one pixel stays: that of the nearest point.
        picture[y[seen], x[seen]] = colors[before[seen]]
    return picture


def _encoded(light: Float32) -> UInt8:
    """sRGB values of light 0 to 1."""
    curve = 1.055 * np.maximum(light, 0) ** (1 / 2.4) - 0.055
    srgb = np.where(light <= 0.0031308, 12.92 * light, curve)
    values: UInt8 = np.clip(np.rint(srgb * 255), 0, 255).astype(np.uint8)
    return values


def tensor(array: npt.NDArray[Any]) -> Any:
    """The array for Open3D, float32."""
    import open3d as o3d

    return o3d.core.Tensor(np.ascontiguousarray(array, dtype=np.float32))
