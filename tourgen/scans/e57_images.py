"""The pictures in an E57 file (`images2D`) that have a pose, as panoramas.

All representations of the standard become spherical: cylindrical and pinhole ones (the faces of a
cube, mostly) are drawn anew on the sphere, so that one kind is left to look colours up in. The
axes are those of ASTM E2807: a spherical or cylindrical picture has azimuth 0 in its middle column
and azimuth grows to the left; a pinhole camera looks along -z with x to the right and y up.
Visual references have no projection and are passed over, as is what cannot be decoded: a scan
is not lost for its pictures. Lens distortion (an extension of the format) is not undone.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from tourgen.errors import InputError
from tourgen.geometry import Float64, Panorama, UInt8

WIDEST_PX: Final = 8192
"""Wider panoramas are halved: at 5 m a pixel of a whole turn is 4 mm then."""

_SPHERICAL, _CYLINDRICAL, _PINHOLE = (
    f"{kind}Representation" for kind in ("spherical", "cylindrical", "pinhole")
)
_CAMERA_AXES: Final = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
"""Columns: a panorama's axes (forward, left, up) in a pinhole camera's frame."""


def panoramas_of(
    nodes: Any, pose_of: Callable[[Any], tuple[Float64, Float64]]
) -> tuple[Panorama, ...]:
    """The pictures that can colour a surface.

    Args:
        nodes: The file's `images2D`.
        pose_of: Reads a node's rotation and translation.
    """
    found = (_panorama(nodes[index], pose_of) for index in range(len(nodes)))
    return tuple(each for each in found if each is not None)


def count_of(nodes: Any) -> int:
    """How many pictures have a pose and a projection, decodable or not."""
    return sum(_projection(nodes[index]) is not None for index in range(len(nodes)))


def _projection(node: Any) -> str | None:
    if not node.isDefined("pose"):
        return None
    kinds = (_SPHERICAL, _CYLINDRICAL, _PINHOLE)
    return next((kind for kind in kinds if node.isDefined(kind)), None)


def _panorama(node: Any, pose_of: Callable[[Any], tuple[Float64, Float64]]) -> Panorama | None:
    kind = _projection(node)
    if kind is None:
        return None
    about = node[kind]
    image = _image(about)
    if image is None:
        return None
    height, width = image.shape[:2]
    declared = [_number(about, name) for name in ("imageWidth", "imageHeight")]
    if min(declared) <= 0:
        return None
    # Pixels as the file means them; a picture stored in another size spans the same angle.
    pixel = (
        _number(about, "pixelWidth") * declared[0] / width,
        _number(about, "pixelHeight") * declared[1] / height,
    )
    if not (np.isfinite(pixel).all() and min(pixel) > 0):
        return None
    try:
        rotation, translation = pose_of(node)
    except InputError:
        return None
    if kind == _SPHERICAL:
        spherical = image, pixel
    elif kind == _CYLINDRICAL:
        row = _number(about, "principalPointY") * height / declared[1]
        found = from_cylinder(image, pixel, _number(about, "radius"), row)
        if found is None:
            return None
        spherical = found
    else:
        middle = (
            _number(about, "principalPointX") * width / declared[0],
            _number(about, "principalPointY") * height / declared[1],
        )
        found = from_pinhole(image, pixel, _number(about, "focalLength"), middle)
        if found is None:
            return None
        spherical = found
        rotation = rotation @ _CAMERA_AXES
    image, pixel = spherical
    if image.shape[1] * pixel[0] > 2.02 * np.pi or image.shape[0] * pixel[1] > 1.02 * np.pi:
        return None
    return _halved(Panorama(translation, rotation, image, pixel))


def _image(about: Any) -> UInt8 | None:
    """The decoded picture, black where its mask says that there is none."""
    from PIL import Image

    blob = next((name for name in ("jpegImage", "pngImage") if about.isDefined(name)), None)
    if blob is None:
        return None
    try:
        picture = np.asarray(Image.open(io.BytesIO(_bytes(about[blob]))).convert("RGB"))
        if about.isDefined("imageMask"):
            mask = Image.open(io.BytesIO(_bytes(about["imageMask"]))).convert("L")
            size = (picture.shape[1], picture.shape[0])
            picture = picture * (np.asarray(mask.resize(size, Image.Resampling.NEAREST)) > 0)[
                ..., None
            ].astype(np.uint8)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    return picture


def _bytes(blob: Any) -> bytes:
    content = np.empty(blob.byteCount(), np.uint8)
    blob.read(content, 0, len(content))
    return content.tobytes()


def _number(node: Any, name: str) -> float:
    return float(node[name].value()) if node.isDefined(name) else 0.0


def from_cylinder(
    image: UInt8, pixel: tuple[float, float], radius_m: float, middle_row: float
) -> tuple[UInt8, tuple[float, float]] | None:
    """A cylindrical picture on the sphere; `pixel` is in radians across, metres down.

    Returns None where the cylinder has no radius.
    """
    if not (np.isfinite(radius_m) and radius_m > 0 and np.isfinite(middle_row)):
        return None
    height, width = image.shape[:2]
    top = np.arctan(max(middle_row, height - middle_row) * pixel[1] / radius_m)
    step = np.arctan(pixel[1] / radius_m)
    rows = max(2 * round(top / step), 2)
    elevation = (rows / 2 - np.arange(rows) - 0.5) * (2 * top / rows)
    row = middle_row - np.tan(elevation) * radius_m / pixel[1]
    column = np.broadcast_to(np.arange(width) + 0.5, (rows, width))
    shown = _read(image, column, np.broadcast_to(row[:, None], (rows, width)))
    return shown, (pixel[0], float(2 * top / rows))


def from_pinhole(
    image: UInt8, pixel: tuple[float, float], focal_m: float, middle: tuple[float, float]
) -> tuple[UInt8, tuple[float, float]] | None:
    """A pinhole picture on the sphere; `pixel` is in metres, `middle` its column and row.

    Returns None where the camera has no focal length.
    """
    if not (np.isfinite(focal_m) and focal_m > 0 and np.isfinite(middle).all()):
        return None
    height, width = image.shape[:2]
    side = np.arctan(max(middle[0], width - middle[0]) * pixel[0] / focal_m)
    top = np.arctan(max(middle[1], height - middle[1]) * pixel[1] / focal_m)
    columns = max(2 * round(side / np.arctan(pixel[0] / focal_m)), 2)
    rows = max(2 * round(top / np.arctan(pixel[1] / focal_m)), 2)
    azimuth = (columns / 2 - np.arange(columns) - 0.5) * (2 * side / columns)
    elevation = (rows / 2 - np.arange(rows) - 0.5) * (2 * top / rows)
    column = middle[0] - np.tan(azimuth) * focal_m / pixel[0]
    row = middle[1] - np.tan(elevation)[:, None] / np.cos(azimuth) * focal_m / pixel[1]
    shown = _read(image, np.broadcast_to(column, (rows, columns)), row)
    return shown, (float(2 * side / columns), float(2 * top / rows))


def _read(image: UInt8, column: Float64, row: Float64) -> UInt8:
    """The image at places counted in pixels from its upper left corner, black outside."""
    from scipy.ndimage import map_coordinates

    height, width = image.shape[:2]
    at = np.stack([row - 0.5, column - 0.5])
    inside = (row >= 0) & (row <= height) & (column >= 0) & (column <= width)
    channels = [
        map_coordinates(image[..., k].astype(np.float32), at, order=1, mode="nearest")
        for k in range(3)
    ]
    shown = np.rint(np.stack(channels, axis=-1)) * inside[..., None]
    return np.asarray(shown, np.uint8)


def _halved(panorama: Panorama) -> Panorama:
    """Half as wide and high until it is no wider than it needs."""
    image, (across, down) = panorama.image, panorama.pixel_rad
    while image.shape[1] > WIDEST_PX and not (image.shape[0] % 2 or image.shape[1] % 2):
        quarters = image.reshape(image.shape[0] // 2, 2, image.shape[1] // 2, 2, 3)
        image = np.rint(quarters.mean((1, 3), dtype=np.float32)).astype(np.uint8)
        across, down = 2 * across, 2 * down
    return replace(panorama, image=image, pixel_rad=(across, down))
