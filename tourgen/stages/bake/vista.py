"""A vista: a panorama made ready, and what it shows at a place of the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.geometry import Float32, Float64, Panorama, UInt8

Int64 = npt.NDArray[np.int64]

_MARGIN = 0.012  # of the range, and
_MARGIN_M = 0.01
_STEEPEST_COS = (0.08, 0.3)


@dataclass(frozen=True, slots=True)
class Sight:
    """Where n of the places asked for, those that can be trusted, lie in one panorama.

    Attributes:
        which: (n,) their numbers among those asked for.
        column: (n,) and
        row: (n,) pixels from the picture's upper left corner.
        trust: (n,) above 0, up to 1.
        pixel_m: (n,) side of a square as large as a pixel's area on the surface.
        metric: (3, n) metres squared: g of |step|^2 = g0 c^2 + 2 g1 c r + g2 r^2, the way on the
            surface that a step of c columns and r rows is.
    """

    which: Int64
    column: Float32
    row: Float32
    trust: Float32
    pixel_m: Float32
    metric: Float32


@dataclass(frozen=True, slots=True)
class Vista:
    """A panorama made ready.

    Attributes:
        panorama: Position, rotation and pixels.
        pyramid: The picture without gain, and copies half as large each; uint8.
        gain: (3,) factor that the camera put on each channel.
        range_m: (h, w) float32 of the surface, infinite where there is none.
        trust: (h, w) float32, 0 to 1, same size as ``range_m``.
    """

    panorama: Panorama
    pyramid: tuple[UInt8, ...]
    gain: Float64
    range_m: Float32
    trust: Float32

    def look(self, places: Float32, normals: Float32) -> Sight:
        """Find (m, 3) places, metres from the room's origin, with unit normals."""
        panorama = self.panorama
        rotation = panorama.rotation.astype(np.float32)
        way = places - panorama.position.astype(np.float32)
        front = np.flatnonzero(np.einsum("mx,mx->m", way, normals) < 0)
        x, y, z = (way[front] @ rotation).T
        flat = np.maximum(np.hypot(x, y), np.float32(1e-6))
        distance = np.hypot(flat, z)
        across, down, facing = _turned(normals[front] @ rotation, x, y, z, flat, distance)
        column, row = _pixels(panorama, x, y, flat, z)
        trust = self._trust(column, row, distance, facing)
        # A turn t of the ray moves its foot on the plane by distance * (t - ray (n.t) / (n.ray)).
        right_m = flat * np.float32(panorama.pixel_rad[0])
        down_m = distance * np.float32(panorama.pixel_rad[1])
        safe = np.maximum(facing, np.float32(0.05))
        lean_right, lean_down = across / safe, down / safe
        metric = np.stack(
            [
                right_m**2 * (1 + lean_right**2),
                right_m * down_m * lean_right * lean_down,
                down_m**2 * (1 + lean_down**2),
            ]
        )
        pixel_m = np.sqrt(right_m * down_m / safe)
        of = np.flatnonzero(trust)
        return Sight(front[of], column[of], row[of], trust[of], pixel_m[of], metric[:, of])

    def _trust(self, column: Float32, row: Float32, distance: Float32, facing: Float32) -> Float32:
        """(n,) trust in what the picture shows of n places; 0 where it shows none of them."""
        height, width = self.panorama.image.shape[:2]
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        rows, columns = self.range_m.shape
        cell = (
            np.clip(row * (rows / height), 0, rows - 1).astype(np.int32),
            np.clip(column * (columns / width), 0, columns - 1).astype(np.int32),
        )
        slant = np.sqrt(np.maximum(1 - facing**2, 0)) / np.maximum(facing, np.float32(0.05))
        step_rad = np.float32(self.panorama.pixel_rad[1] * height / rows)
        play_m = _MARGIN_M + distance * (_MARGIN + np.minimum(slant, 10) * step_rad)
        shown = inside & (distance - play_m <= self.range_m[cell])
        return np.asarray(
            np.where(shown, self.trust[cell] * smooth(facing, *_STEEPEST_COS), 0), np.float32
        )

    def read(self, sight: Sight, sigma_m: Float32, texel_m: float) -> tuple[Float32, Float32]:
        """The four pixels about each place, weighted by their distance on the surface.

        Args:
            sight: Of n places.
            sigma_m: (n,) width of the weight's bell.
            texel_m: What is finer is read from a smaller copy.

        Returns:
            (n, 3) colours without the gain; (n,) sum of the weights.
        """
        fine = np.log2(np.maximum(texel_m / np.maximum(sight.pixel_m, 1e-6), 1))
        level = np.minimum(fine.astype(np.int64), len(self.pyramid) - 1)
        colors = np.empty((len(level), 3), np.float32)
        mass = np.empty(len(level), np.float32)
        for each in np.unique(level):
            of = np.flatnonzero(level == each)
            colors[of], mass[of] = self._kernel(sight, of, int(each), sigma_m[of])
        return np.asarray(colors / self.gain, np.float32), mass

    def _kernel(
        self, sight: Sight, of: npt.NDArray[np.int64], level: int, sigma_m: Float32
    ) -> tuple[Float32, Float32]:
        image = self.pyramid[level]
        height, width = image.shape[:2]
        scale = np.float32(2**level)
        column = sight.column[of] / scale - np.float32(0.5)
        row = sight.row[of] / scale - np.float32(0.5)
        left, top = np.floor(column).astype(np.int32), np.floor(row).astype(np.int32)
        metric = sight.metric[:, of] * (scale / sigma_m) ** 2 / 2
        total = np.zeros((len(of), 3), np.float32)
        mass = np.full(len(of), 1e-12, np.float32)
        for right in (0, 1):
            c = left + right - column
            at_column = left + right
            at_column = at_column % width if is_whole(self.panorama) else at_column
            at_column = np.clip(at_column, 0, width - 1)
            for below in (0, 1):
                r = top + below - row
                far = metric[0] * c * c + 2 * metric[1] * c * r + metric[2] * r * r
                weight = np.exp(-far)
                total += weight[:, None] * image[np.clip(top + below, 0, height - 1), at_column]
                mass += weight
        return total / mass[:, None], mass


def _turned(
    normals: Float32, x: Float32, y: Float32, z: Float32, flat: Float32, distance: Float32
) -> tuple[Float32, Float32, Float32]:
    """Parts of the normals along growing column, along growing row, and toward the lens."""
    outward = (normals[:, 0] * x + normals[:, 1] * y) / flat
    across = (normals[:, 0] * y - normals[:, 1] * x) / flat
    down = (outward * z - normals[:, 2] * flat) / distance
    facing = -(outward * flat + normals[:, 2] * z) / distance
    return (
        np.asarray(across, np.float32),
        np.asarray(down, np.float32),
        np.asarray(facing, np.float32),
    )


def smooth(value: Float32, low: float, high: float) -> Float32:
    """0 below ``low``, 1 above ``high``, without a kink between."""
    share = np.clip((value - np.float32(low)) / np.float32(high - low), 0, 1)
    return np.asarray(share * share * (3 - 2 * share), np.float32)


def is_whole(panorama: Panorama) -> bool:
    """Whether it goes all the way round."""
    turn = panorama.image.shape[1] * panorama.pixel_rad[0]
    return bool(abs(turn - 2 * np.pi) < 1.5 * panorama.pixel_rad[0])


def _pixels(
    panorama: Panorama, x: Float32, y: Float32, flat: Float32, z: Float32
) -> tuple[Float32, Float32]:
    """(n,) column and (n,) row of n directions, in pixels from the upper left corner."""
    height, width = panorama.image.shape[:2]
    column = width / 2 - np.arctan2(y, x) / np.float32(panorama.pixel_rad[0])
    row = height / 2 - np.arctan2(z, flat) / np.float32(panorama.pixel_rad[1])
    if is_whole(panorama):
        column = column % width
    return np.asarray(column, np.float32), np.asarray(row, np.float32)


def directions(panorama: Panorama, width: int, height: int) -> Float32:
    """(height, width, 3) unit vectors, room frame, of a grid that spans the panorama."""
    across = panorama.image.shape[1] * panorama.pixel_rad[0]
    down = panorama.image.shape[0] * panorama.pixel_rad[1]
    azimuth = across * (0.5 - (np.arange(width) + 0.5) / width)
    elevation = down * (0.5 - (np.arange(height) + 0.5) / height)
    flat = np.cos(elevation)[:, None]
    z = np.broadcast_to(np.sin(elevation)[:, None], (height, width))
    local = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=-1)
    return np.asarray(local @ panorama.rotation.T, np.float32)
