"""The texture of a modelled room: charts packed on shelves, painted, and lit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tourgen.geometry import Float32, Float64, Int32, UInt8
from tourgen.simulation.charts import Chart
from tourgen.simulation.light import illuminate
from tourgen.simulation.model import RoomModel, TrueRoom, join, stretch

GUTTER = 2
EXPOSURE = 0.85
SUN = np.array([-0.55, -0.25, 0.52])


def build_truth(model: RoomModel, texture_size: int, seed: int) -> TrueRoom:
    """Mesh and texture of a room, its light baked in."""
    mesh = join(model.charts)
    albedo = np.concatenate([_albedo(part) for part in model.charts])
    light = illuminate(
        model.charts, mesh, albedo, model.openings, model.lamps, SUN / np.linalg.norm(SUN), seed
    )
    places = pack(model.charts, texture_size)
    texture = np.zeros((texture_size, texture_size, 3), dtype=np.uint8)
    uv = np.empty((len(mesh.vertices), 2), dtype=np.float32)
    for k, part in enumerate(model.charts):
        span = slice(mesh.first[k], mesh.first[k + 1])
        shape = part.points.shape[:2]
        x, y, w, h = (int(v) for v in places[k])
        tall = _is_tall(part)
        grid = light[span].reshape(*shape, 3)
        patch = _paint(part, grid, (h, w) if tall else (w, h))
        if tall:
            patch = patch.swapaxes(0, 1)
        texture[y : y + patch.shape[0], x : x + patch.shape[1]] = patch
        s, t, _ = stretch(part)
        a, b = np.broadcast_arrays(s[None], t[:, None])
        if tall:
            a, b = b, a
        pixel = np.stack([x + GUTTER + a * w, y + GUTTER + b * h], axis=-1)
        uv[span] = (pixel / texture_size).reshape(-1, 2)
    return TrueRoom(mesh, uv, texture)


def _albedo(part: Chart) -> Float32:
    paint = part.paint.reshape(-1, 2).astype(np.float32)
    return part.material.paint(paint, _paint_size(part))


def _paint_size(part: Chart) -> tuple[float, float]:
    return float(part.paint[..., 0].max()), float(part.paint[..., 1].max())


def _is_tall(part: Chart) -> bool:
    _, _, (width, height) = stretch(part)
    return height > width


def pack(charts: Sequence[Chart], texture_size: int) -> Int32:
    """Shelves of falling height: (n, 4) x, y of the rectangle with gutter; w, h without."""
    sizes = np.array([sorted(stretch(part)[2], reverse=True) for part in charts])
    fineness = np.array([part.material.texel for part in charts])
    texel_m = float(np.sqrt((sizes.prod(axis=1) / fineness**2).sum() / (0.95 * texture_size**2)))
    while True:
        cells = np.maximum(np.ceil(sizes / (fineness * texel_m)[:, None]).astype(np.int32), 1)
        placed = _shelves(cells + 2 * GUTTER, texture_size)
        if placed is not None:
            return np.concatenate([placed, cells], axis=1)
        texel_m *= 1.03


def _shelves(sizes: Int32, edge: int) -> Int32 | None:
    if sizes.max() > edge:
        return None
    placed = np.zeros_like(sizes)
    x = y = shelf = 0
    for k in np.argsort(-sizes[:, 1], kind="stable"):
        w, h = int(sizes[k, 0]), int(sizes[k, 1])
        if x + w > edge:
            x, y, shelf = 0, y + shelf, 0
        if y + h > edge:
            return None
        placed[k] = x, y
        x += w
        shelf = max(shelf, h)
    return placed


def _paint(part: Chart, light: Float32, size: tuple[int, int]) -> UInt8:
    """(h + 2 gutters, w + 2 gutters, 3) sRGB of one chart, row 0 at its lowest row."""
    s, t, _ = stretch(part)
    w, h = size
    column = _steps(s, (np.arange(-GUTTER, w + GUTTER) + 0.5) / w)
    row = _steps(t, (np.arange(-GUTTER, h + GUTTER) + 0.5) / h)
    paint = _blend(part.paint.astype(np.float32), row, column)
    albedo = part.material.paint(paint.reshape(-1, 2), _paint_size(part)).reshape(
        *paint.shape[:2], 3
    )
    if part.material.glow > 0:
        return np.full(albedo.shape, 255, dtype=np.uint8)
    shown = albedo * _blend(_tone(light), row, column)
    return encode(shown)


def _tone(light: Float32) -> Float32:
    """Contrast of the light drawn together, as a camera with its exposures blended does."""
    level = light.mean(axis=-1, keepdims=True)
    drawn = np.power(np.maximum(level, 1e-3), -0.36)
    toned: Float32 = (EXPOSURE * light * drawn).astype(np.float32)
    return toned


def encode(light: Float32) -> UInt8:
    """sRGB of linear light, highlights rolled off."""
    rolled = np.where(light > 0.6, 1 - 0.4 * np.exp(-(light - 0.6) / 0.4), light)
    index = np.clip(np.sqrt(np.maximum(rolled, 0)) * 4095, 0, 4095).astype(np.int32)
    shown: UInt8 = _SRGB[index]
    return shown


def _srgb_table() -> UInt8:
    c = (np.arange(4096) / 4095) ** 2
    srgb = np.where(c <= 0.0031308, 12.92 * c, 1.055 * np.power(c, 1 / 2.4) - 0.055)
    return np.clip(np.round(srgb * 255), 0, 255).astype(np.uint8)


_SRGB = _srgb_table()


def _steps(stops: Float64, at: Float64) -> tuple[Int32, Float32]:
    at = np.clip(at, 0, 1)
    low = np.clip(np.searchsorted(stops, at, side="right") - 1, 0, len(stops) - 2)
    share = (at - stops[low]) / (stops[low + 1] - stops[low])
    return low.astype(np.int32), share.astype(np.float32)


def _blend(grid: Float32, row: tuple[Int32, Float32], column: tuple[Int32, Float32]) -> Float32:
    (i, u), (j, v) = row, column
    lines = grid[i] * (1 - u)[:, None, None] + grid[i + 1] * u[:, None, None]
    return (lines[:, j] * (1 - v)[:, None] + lines[:, j + 1] * v[:, None]).astype(np.float32)


def sample(texture: UInt8, uv: Float32) -> UInt8:
    """(n, 3) the texels at uv."""
    height, width = texture.shape[:2]
    x = np.clip((uv[:, 0] * width).astype(np.int32), 0, width - 1)
    y = np.clip((uv[:, 1] * height).astype(np.int32), 0, height - 1)
    texels: UInt8 = texture[y, x]
    return texels
