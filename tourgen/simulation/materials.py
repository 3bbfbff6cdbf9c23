"""Procedural looks: wood, brass, plaster, tiles, cloth, floors, and the plaque.

Each factory returns a ``Material``. Colours are given as sRGB and painted as linear albedo.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from tourgen.geometry import Float32
from tourgen.simulation.charts import Material, Pair

Color = tuple[int, int, int]
TABLE = 1024

OAK: Color = (176, 124, 74)
DARK_OAK: Color = (128, 82, 46)
MAHOGANY: Color = (126, 70, 46)
EBONY: Color = (48, 34, 28)
MAPLE: Color = (219, 184, 130)
BRASS: Color = (206, 166, 84)


def linear(color: Color) -> Float32:
    """(3,) linear light of an sRGB colour."""
    c = np.asarray(color, dtype=np.float32) / 255
    light: Float32 = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return light


@cache
def _table() -> Float32:
    """(1024, 1024) smooth periodic noise in [0, 1], two octaves of a blurred lattice."""
    rng = np.random.default_rng(7)
    total = np.zeros((TABLE, TABLE), dtype=np.float64)
    for pitch, weight in ((8, 1.0), (4, 0.5), (2, 0.25)):
        lattice = rng.random((TABLE // pitch, TABLE // pitch))
        at = np.arange(TABLE) / pitch
        low = at.astype(int)
        t = at - low
        t = t * t * (3 - 2 * t)
        high = (low + 1) % (TABLE // pitch)
        rows = lattice[low] * (1 - t)[:, None] + lattice[high] * t[:, None]
        total += weight * (rows[:, low] * (1 - t) + rows[:, high] * t)
    spread: Float32 = ((total - total.min()) / (total.max() - total.min())).astype(np.float32)
    return spread


def noise(x: Float32, y: Float32) -> Float32:
    """Smooth noise in [0, 1] with features about one unit wide, bilinear from a table."""
    x, y = x * 8, y * 8
    i, j = np.floor(x).astype(np.int32), np.floor(y).astype(np.int32)
    u, v = x - i, y - j
    i0, j0 = i & (TABLE - 1), j & (TABLE - 1)
    i1, j1 = (i + 1) & (TABLE - 1), (j + 1) & (TABLE - 1)
    flat = _table().reshape(-1)
    top = flat[j0 * TABLE + i0] * (1 - u) + flat[j0 * TABLE + i1] * u
    low = flat[j1 * TABLE + i0] * (1 - u) + flat[j1 * TABLE + i1] * u
    blended: Float32 = (top * (1 - v) + low * v).astype(np.float32)
    return blended


def chance(i: Float32, j: Float32 | float = 0.0) -> Float32:
    """A number in [0, 1) for each pair of whole numbers, always the same."""
    whole = np.asarray(i, dtype=np.int64) * 73856093 ^ np.asarray(j, dtype=np.int64) * 19349663
    for _ in range(2):
        whole = (whole ^ (whole >> 15)) * 0x2C1B3C6D & 0xFFFFFFFF
    share: Float32 = ((whole >> 8) / np.float64(1 << 24)).astype(np.float32)
    return share


def shade(color: Color, brightness: Float32) -> Float32:
    """(n, 3) a colour made lighter or darker."""
    shaded: Float32 = brightness[:, None] * linear(color)
    return shaded


def mix(below: Float32, above: Float32, cover: Float32) -> Float32:
    """(n, 3) ``above`` laid over ``below`` by ``cover`` in [0, 1]."""
    return below + cover[:, None] * (above - below)


def grain(xy: Float32, contrast: float = 1.0) -> Float32:
    """Brightness about 1 of wood whose grain runs along x."""
    x, y = xy[:, 0], xy[:, 1]
    wave = noise(x / 0.9, y / 0.11)
    rings = 0.5 + 0.5 * np.sin((y / 0.012 + 9 * wave) * np.float32(1.1))
    fine = noise(x / 0.16, y / 0.0035 + 31)
    shift = 0.34 * (wave - 0.5) + 0.12 * (rings - 0.5) + 0.22 * (fine - 0.5)
    brightness: Float32 = (1 + contrast * shift).astype(np.float32)
    return brightness


def wood(color: Color = OAK, contrast: float = 1.0) -> Material:
    """Solid wood, grain along the paint's x."""
    return Material(lambda xy, _: shade(color, grain(xy, contrast)))


def plain(color: Color, mottle: float = 0.08, glow: float = 0.0, scale_m: float = 0.25) -> Material:
    """One colour, slightly uneven."""

    def paint(xy: Float32, _: Pair) -> Float32:
        cloud = noise(xy[:, 0] / scale_m, xy[:, 1] / scale_m)
        fine = noise(xy[:, 0] / 0.012, xy[:, 1] / 0.012)
        return shade(
            color, (1 + mottle * (1.4 * (cloud - 0.5) + 0.8 * (fine - 0.5))).astype(np.float32)
        )

    return Material(paint, glow=glow)


def looking_glass() -> Material:
    """What a mirror's own surface looks like: dull silver."""
    base = plain((168, 176, 178), 0.05)
    return Material(base.paint, mirror=True)


def planks(color: Color, width_m: float = 0.14, length_m: float = 1.3) -> Material:
    """Boards along the paint's x."""

    def paint(xy: Float32, _: Pair) -> Float32:
        row = np.floor(xy[:, 1] / width_m)
        along = xy[:, 0] / length_m + chance(row, 3.0) * 5
        piece = np.floor(along)
        tone = 0.78 + 0.44 * chance(row, piece)
        across = xy[:, 1] / width_m - row
        joint = np.minimum(
            np.minimum(across, 1 - across) * width_m,
            np.minimum(along - piece, 1 - along + piece) * length_m,
        )
        shifted = xy + np.stack([chance(row, piece) * 30, chance(piece, row) * 30], axis=-1)
        lit = tone * grain(shifted.astype(np.float32)) * np.where(joint < 0.0018, 0.35, 1.0)
        return shade(color, lit.astype(np.float32))

    return Material(paint)


def marquetry(
    field: Color = MAHOGANY, band: Color = MAPLE, frame: Color = OAK, motif: str = "diamond"
) -> Material:
    """A veneered panel: frame, stringing, banding, book-matched field, a motif."""

    def paint(xy: Float32, size: Pair) -> Float32:
        w, h = size
        x, y = xy[:, 0], xy[:, 1]
        edge = np.minimum(np.minimum(x, w - x), np.minimum(y, h - y))
        across = np.abs(x - w / 2)
        book = np.stack(
            [y + 7 * w, across * 1.5 + 0.1 * noise(y / 0.3, across / 0.1)], axis=-1
        ).astype(np.float32)
        out = shade(field, grain(book, 1.5))
        line = shade(EBONY, grain(xy, 0.6))
        pale = shade(band, grain(xy[:, ::-1], 0.8))
        out = mix(out, line, (edge < 0.068).astype(np.float32))
        out = mix(out, pale, (edge < 0.064).astype(np.float32))
        checks = np.floor(np.where(x < w - 0.06, x, y) / 0.02) + np.floor(y / 0.02)
        out = mix(
            out, line, ((edge < 0.049) & (edge > 0.043) & (checks % 2 == 0)).astype(np.float32)
        )
        out = mix(out, line, (edge < 0.034).astype(np.float32))
        out = mix(out, shade(frame, grain(xy[:, ::-1])), (edge < 0.030).astype(np.float32))
        reach = min(w, h) * 0.26
        dx, dy = x - w / 2, y - h / 2
        if motif == "diamond":
            inside = 1 - np.abs(dx) / reach - np.abs(dy) / (reach * 1.5)
            half = (dx * dy > 0).astype(np.float32)
            out = mix(out, line, (inside > -0.05).astype(np.float32))
            out = mix(
                out, mix(pale, shade(DARK_OAK, grain(xy)), half), (inside > 0).astype(np.float32)
            )
        elif motif == "star":
            cover, dark = star(dx, dy, reach, 8, 0.42)
            out = mix(out, mix(pale, line, dark), cover)
        return out

    return Material(paint)


def painted_panel(color: Color, line: Color) -> Material:
    """A painted panel with a double line round it and a small flower in its middle."""
    base = plain(color, 0.06)

    def paint(xy: Float32, size: Pair) -> Float32:
        x, y = xy[:, 0], xy[:, 1]
        edge = np.minimum(np.minimum(x, size[0] - x), np.minimum(y, size[1] - y))
        out = base.paint(xy, size)
        gilt = shade(line, (0.85 + 0.3 * noise(x / 0.02, y / 0.02)).astype(np.float32))
        lines = ((edge > 0.035) & (edge < 0.043)) | ((edge > 0.052) & (edge < 0.055))
        out = mix(out, gilt, lines.astype(np.float32))
        reach = min(size) * 0.17
        cover, dark = star(x - size[0] / 2, y - size[1] / 2, reach, 8, 0.36)
        return mix(out, mix(gilt, gilt * 0.55, dark), cover)

    return Material(paint)


def climbing_band(
    below: Color,
    above: Color,
    line: Color,
    pitch: Callable[[Float32], Float32],
    turn_rise: float,
    rise: float,
    top: float,
) -> Material:
    """Plaster on a shaft's wall, painted up to some height above a spiral stair.

    Args:
        below, above, line: Colours of the band, of the wall over it, and of the line between.
        pitch: Height of the stair at an arc length.
        turn_rise: Climb of the stair in one turn, metres.
        rise: Height of the band, metres.
        top: Height over which nothing is painted, metres.
    """
    low, high = plain(below, 0.10), plain(above, 0.10)

    def paint(xy: Float32, size: Pair) -> Float32:
        height = xy[:, 1] - pitch(xy[:, 0])
        height = height - np.floor(height / turn_rise) * turn_rise
        lowest = xy[:, 1] < top
        painted = ((height < rise) & lowest).astype(np.float32)
        out = mix(high.paint(xy, size), low.paint(xy, size), painted)
        edge = (np.abs(height - rise) < 0.02) & lowest
        return mix(out, shade(line, np.ones_like(height)), edge.astype(np.float32))

    return Material(paint)


def star(
    x: Float32, y: Float32, radius: float, points: int, waist: float
) -> tuple[Float32, Float32]:
    """A star whose rays are halved in light and dark: (cover, dark half) as 0 or 1 each."""
    r = np.hypot(x, y)
    sector = np.float32(2 * np.pi / points)
    turn = np.arctan2(y, x) + sector / 2
    turn = turn - np.floor(turn / sector) * sector - sector / 2
    a, b = r * np.cos(turn), r * np.abs(np.sin(turn))
    base_x, base_y = waist * radius * np.cos(sector / 2), waist * radius * np.sin(sector / 2)
    inside = (radius - a) * base_y - b * (radius - base_x) >= 0
    return inside.astype(np.float32), (turn > 0).astype(np.float32)


def compass_floor(apothem_m: float, radius_m: float) -> Material:
    """Oak boards laid round an eight-sided room, a dark border, and a compass rose of 16 rays."""

    def paint(xy: Float32, _: Pair) -> Float32:
        x, y = xy[:, 0], xy[:, 1]
        r = np.hypot(x, y)
        eighth = np.float32(np.pi / 4)
        sector = np.round(np.arctan2(y, x) / eighth)
        c, s = np.cos(sector * eighth), np.sin(sector * eighth)
        outward, along = x * c + y * s, -x * s + y * c
        boards = np.stack([along + sector * 11 + 40, outward], axis=-1).astype(np.float32)
        out = planks(OAK, 0.115, 1.1).paint(boards, (1, 1))
        line = shade(EBONY, grain(boards, 0.6))
        red = shade(MAHOGANY, grain(xy))
        pale = shade(MAPLE, grain(xy, 0.8))
        rim = apothem_m - outward
        out = mix(out, red, ((rim > 0.30) & (rim < 0.44)).astype(np.float32))
        out = mix(
            out,
            line,
            (((rim > 0.28) & (rim < 0.30)) | ((rim > 0.44) & (rim < 0.46))).astype(np.float32),
        )
        out = mix(out, red, (r < radius_m * 1.08).astype(np.float32))
        out = mix(out, line, ((r < radius_m * 1.08) & (r > radius_m * 1.06)).astype(np.float32))
        out = mix(out, pale, ((r < radius_m * 1.045) & (r > radius_m * 1.015)).astype(np.float32))
        turned = np.float32(np.pi / 8)
        xr, yr = x * np.cos(turned) - y * np.sin(turned), x * np.sin(turned) + y * np.cos(turned)
        for u, v, reach, count, waist in (
            (xr, yr, 0.66, 8, 0.30),
            (x, y, 0.82, 8, 0.30),
            (x, y, 1.0, 4, 0.24),
        ):
            cover, dark = star(u, v, radius_m * reach, count, waist)
            out = mix(out, mix(pale, line, dark), cover)
        return mix(out, shade(BRASS, np.ones_like(r)), (r < 0.06).astype(np.float32))

    return Material(paint, texel=0.8)


def tiles(
    colors: Sequence[Color],
    size_m: float,
    grout: Color = (200, 192, 178),
    *,
    diagonal: bool = False,
    ornament: bool = False,
) -> Material:
    """Square tiles; two colours make a checker, an ornament paints a blue flower on each."""

    def paint(xy: Float32, _: Pair) -> Float32:
        x, y = xy[:, 0], xy[:, 1]
        if diagonal:
            x, y = (x + y) * np.float32(0.70710678), (y - x) * np.float32(0.70710678)
        i, j = np.floor(x / size_m), np.floor(y / size_m)
        u, v = x / size_m - i - 0.5, y / size_m - j - 0.5
        tone = 0.9 + 0.16 * chance(i, j) + 0.14 * (noise(x / 0.07, y / 0.07) - 0.5)
        out = shade(colors[0], tone.astype(np.float32))
        if len(colors) > 1:
            out = mix(
                out, shade(colors[1], tone.astype(np.float32)), ((i + j) % 2).astype(np.float32)
            )
        if ornament:
            blue = shade((52, 84, 140), (0.8 + 0.5 * noise(x / 0.01, y / 0.01)).astype(np.float32))
            r, turn = np.hypot(u, v), np.arctan2(v, u)
            petal = (r < 0.24 * (0.6 + 0.4 * np.cos(4 * turn))) & (r > 0.05)
            corner = np.hypot(np.abs(u) - 0.5, np.abs(v) - 0.5)
            curl = (np.abs(corner - 0.2) < 0.018) | (corner < 0.09)
            out = mix(out, blue, (petal | curl).astype(np.float32))
        joint = (0.5 - np.maximum(np.abs(u), np.abs(v))) * size_m
        return mix(out, shade(grout, np.ones_like(x)), (joint < 0.0025).astype(np.float32))

    return Material(paint)


def stone(
    color: Color = (168, 160, 150), course_m: float = 0.36, block_m: float = 0.72
) -> Material:
    """Granite in courses along the paint's y."""

    def paint(xy: Float32, _: Pair) -> Float32:
        x, y = xy[:, 0], xy[:, 1]
        row = np.floor(y / course_m)
        along = x / block_m + 0.5 * (row % 2)
        piece = np.floor(along)
        edge = np.minimum(
            np.minimum(y / course_m - row, 1 - y / course_m + row) * course_m,
            np.minimum(along - piece, 1 - along + piece) * block_m,
        ) + 0.004 * (noise(x / 0.03, y / 0.03) - 0.5)
        speckle = noise(x / 0.006, y / 0.006) - 0.5
        lit = (
            0.86
            + 0.22 * chance(row, piece)
            + 0.5 * speckle * noise(x / 0.05, y / 0.05)
            + 0.2 * (noise(x / 0.3, y / 0.3) - 0.5)
        )
        out = shade(color, lit.astype(np.float32))
        return mix(out, shade((196, 188, 172), np.ones_like(x)), (edge < 0.006).astype(np.float32))

    return Material(paint)


def granite(color: Color = (158, 150, 142)) -> Material:
    """Granite without joints."""

    def paint(xy: Float32, _: Pair) -> Float32:
        x, y = xy[:, 0], xy[:, 1]
        speckle = noise(x / 0.007, y / 0.007) - 0.5
        worn = noise(x / 0.35, y / 0.35) - 0.5
        return shade(color, (1 + 0.4 * speckle + 0.25 * worn).astype(np.float32))

    return Material(paint)


def cloth(color: Color, stripe: Color | None = None, pitch_m: float = 0.12) -> Material:
    """Woven cloth, with stripes across x if a second colour is given."""

    def paint(xy: Float32, _: Pair) -> Float32:
        x, y = xy[:, 0], xy[:, 1]
        weave = (
            1
            + 0.10 * (noise(x / 0.003, y / 0.02) - 0.5)
            + 0.10 * (noise(x / 0.02, y / 0.003) - 0.5)
            + 0.22 * (noise(x / 0.2, y / 0.2) - 0.5)
        )
        out = shade(color, weave.astype(np.float32))
        if stripe is None:
            return out
        band = x / pitch_m - np.floor(x / pitch_m)
        return mix(
            out,
            shade(stripe, weave.astype(np.float32)),
            ((band < 0.22) | ((band > 0.32) & (band < 0.37))).astype(np.float32),
        )

    return Material(paint)


def page() -> Material:
    """A log book's open page: ruled lines of handwriting."""

    def paint(xy: Float32, size: Pair) -> Float32:
        x, y = xy[:, 0], xy[:, 1]
        line = y / 0.012 - np.floor(y / 0.012)
        word = noise(x / 0.02, np.floor(y / 0.012) * 3.3)
        stroke = noise(x / 0.002, y / 0.004)
        ink = (line > 0.25) & (line < 0.7) & (word > 0.42) & (stroke > 0.5)
        margin = (x > 0.02) & (x < size[0] - 0.02) & (y > 0.02) & (y < size[1] - 0.02)
        out = shade((232, 222, 196), (0.96 + 0.1 * noise(x / 0.1, y / 0.1)).astype(np.float32))
        return mix(out, shade((40, 44, 70), np.ones_like(x)), (ink & margin).astype(np.float32))

    return Material(paint, texel=0.4)


def sea_chart() -> Material:
    """A nautical chart: land, depth contours, a grid and a rose."""

    def paint(xy: Float32, size: Pair) -> Float32:
        w, h = size
        x, y = xy[:, 0], xy[:, 1]
        height = noise(x / 0.35 + 3.3, y / 0.35 + 1.7) + 0.25 * (noise(x / 0.08, y / 0.08) - 0.5)
        out = shade((222, 216, 192), (0.97 + 0.06 * noise(x / 0.2, y / 0.2)).astype(np.float32))
        out = mix(out, shade((204, 178, 116), np.ones_like(x)), (height > 0.62).astype(np.float32))
        out = mix(
            out,
            shade((176, 204, 206), np.ones_like(x)),
            ((height > 0.50) & (height < 0.62)).astype(np.float32),
        )
        contour = np.abs(height * 14 - np.round(height * 14)) < 0.05
        lines = (np.abs(x / 0.12 - np.round(x / 0.12)) * 0.12 < 0.0008) | (
            np.abs(y / 0.12 - np.round(y / 0.12)) * 0.12 < 0.0008
        )
        edge = np.minimum(np.minimum(x, w - x), np.minimum(y, h - y))
        ink = (contour & (height < 0.62)) | lines | ((edge < 0.022) & (edge > 0.018))
        out = mix(
            out, shade((92, 84, 74), np.ones_like(x)), (ink & (edge > 0.018)).astype(np.float32)
        )
        cover, dark = star(x - 0.75 * w, y - 0.3 * h, 0.09, 8, 0.3)
        return mix(
            out,
            mix(shade((190, 60, 44), np.ones_like(x)), shade((60, 50, 44), np.ones_like(x)), dark),
            cover,
        )

    return Material(paint, texel=0.5)


def picture(image: Float32, size: Pair, texel: float) -> Material:
    """An image (h, w, 3), linear, row 0 at the top, stretched over a sheet of ``size`` metres."""
    height, width = image.shape[:2]

    def paint(xy: Float32, _: Pair) -> Float32:
        column = np.clip((xy[:, 0] / size[0] * width).astype(np.int32), 0, width - 1)
        row = np.clip(((1 - xy[:, 1] / size[1]) * height).astype(np.int32), 0, height - 1)
        texels: Float32 = image[row, column]
        return texels

    return Material(paint, texel=texel)


PLAQUE_SIZE: Pair = (0.6, 0.4)


def plaque(title: str, lines: Sequence[str], checker_mm: Sequence[int]) -> Material:
    """A plate of 0.6 x 0.4 m: letters of falling size above, checkerboards below.

    Args:
        title: The largest letters.
        lines: Smaller and smaller below it.
        checker_mm: Edges of the squares of each board, from left to right; the first is widest.
    """
    from PIL import Image, ImageDraw, ImageFont

    pixels = 2000
    sheet_w, sheet_h = int(PLAQUE_SIZE[0] * pixels), int(PLAQUE_SIZE[1] * pixels)
    plate, ink, white = (226, 208, 160), (32, 28, 30), (244, 240, 228)
    image = Image.new("RGB", (sheet_w, sheet_h), plate)
    draw = ImageDraw.Draw(image)
    draw.rectangle([18, 18, sheet_w - 19, sheet_h - 19], outline=ink, width=6)
    top = 36
    for text, points in [(title, 118), *zip(lines, (62, 40, 26), strict=False)]:
        font = ImageFont.load_default(points)
        draw.text(((sheet_w - draw.textlength(text, font)) / 2, top), text, ink, font)
        top += int(points * 1.22)
    left, bottom = 60, sheet_h - 50
    widths = [0.5, 0.28, 0.14]
    for edge_mm, share in zip(checker_mm, widths, strict=False):
        step = edge_mm * pixels // 1000
        columns = max(2, int((sheet_w - 160) * share) // step)
        rows = max(2, (bottom - top - 20) // step)
        for row in range(rows):
            for column in range(columns):
                x, y = left + column * step, bottom - (row + 1) * step
                color = ink if (row + column) % 2 else white
                draw.rectangle([x, y, x + step - 1, y + step - 1], fill=color)
        left += columns * step + 40
    srgb = np.asarray(image, dtype=np.float32) / 255
    light = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return picture(light.astype(np.float32), PLAQUE_SIZE, texel=0.25)


def marquetry_round(radius_m: float) -> Material:
    """A round table top: radial veneers, a banded rim and a star."""

    def paint(xy: Float32, _: Pair) -> Float32:
        x, y = xy[:, 0], xy[:, 1]
        r = np.hypot(x, y)
        sector = np.floor(np.arctan2(y, x) / np.float32(np.pi / 8))
        middle = (sector + 0.5) * np.float32(np.pi / 8)
        along = np.stack(
            [
                x * np.cos(middle) + y * np.sin(middle) + sector * 5 + 50,
                -x * np.sin(middle) + y * np.cos(middle),
            ],
            axis=-1,
        )
        out = shade(MAHOGANY, grain(along.astype(np.float32), 1.4) * (0.85 + 0.3 * chance(sector)))
        line, pale = shade(EBONY, grain(xy)), shade(MAPLE, grain(xy, 0.8))
        out = mix(out, pale, ((r > radius_m * 0.86) & (r < radius_m * 0.9)).astype(np.float32))
        out = mix(
            out, line, (np.abs(np.abs(r / radius_m - 0.88) - 0.022) < 0.003).astype(np.float32)
        )
        for reach, waist in ((0.36, 0.4), (0.45, 0.22)):
            cover, dark = star(x, y, radius_m * reach, 16 if reach < 0.4 else 8, waist)
            out = mix(out, mix(pale, line, dark), cover)
        return out

    return Material(paint)
