"""Poster: what a visitor sees on entering, and all around; by ray casting, without GPU or browser.

Rays through Embree (Open3D's RaycastingScene), the pictures of the tiles read with bilinear
blending, for the poster four rays averaged a pixel. Faces are seen from both sides, as in the
viewer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tourgen.compiled import compiled
from tourgen.errors import StageError
from tourgen.geometry import Float32, TexturedMesh, UInt8, View
from tourgen.rays import rays_of
from tourgen.threads import in_parts

VERSION = 5

_SAMPLES = 2  # rays a pixel along each axis
_ROWS_AT_ONCE = 64


@dataclass(frozen=True, slots=True)
class Settings:
    """The pictures.

    Attributes:
        width: Of the poster, pixels.
        height: Of the poster, pixels.
        field_of_view_deg: From the bottom to the top of the poster.
        around_width: Of the picture all around, pixels; it is half as high.
        void: sRGB where no surface is; that of the viewer, so that nothing jumps.
    """

    width: int = 1600
    height: int = 900
    field_of_view_deg: float = 65.0
    around_width: int = 2048
    void: tuple[int, int, int] = (205, 216, 224)


class Scene:
    """Tiles that rays can be cast at.

    Args:
        tiles: Those to be seen, commonly the leaves of the tile tree.

    Raises:
        StageError: Where there is no tile.
    """

    def __init__(self, tiles: Sequence[TexturedMesh]) -> None:
        import open3d as o3d

        if not tiles:
            raise StageError("poster: expected at least 1 tile, found 0")
        self._scene = o3d.t.geometry.RaycastingScene()
        self._tiles: dict[int, tuple[Float32, UInt8]] = {}
        for tile in tiles:
            mesh = tile.uv_mesh.mesh
            key = self._scene.add_triangles(
                o3d.core.Tensor(np.ascontiguousarray(mesh.vertices)),
                o3d.core.Tensor(mesh.faces.astype(np.uint32)),
            )
            self._tiles[int(key)] = tile.uv_mesh.uv[mesh.faces], tile.texture

    def look(self, eye: Float32, directions: Float32, void: tuple[int, int, int]) -> Float32:
        """(n, 3) what each ray sees; ``void`` where it meets nothing."""
        colors = np.tile(np.array(void, np.float32), (len(directions), 1))
        answer = self._scene.cast_rays(rays_of(eye, directions))
        hit = {name: value.numpy() for name, value in answer.items()}
        order = np.argsort(hit["geometry_ids"], kind="stable")
        keys, first = np.unique(hit["geometry_ids"][order], return_index=True)
        for key, which in zip(keys, np.split(order, first[1:]), strict=True):
            tile = self._tiles.get(int(key))
            if tile is not None:  # else there is nothing
                face, at = hit["primitive_ids"][which], hit["primitive_uvs"][which]
                _paint(which, face, at, *tile, colors)
        return colors


def poster(scene: Scene, view: View, settings: Settings) -> UInt8:
    """Render the room from one view.

    Args:
        scene: What is to be seen.
        view: The camera; up is z, or y where the camera looks straight up or down.
        settings: See there.

    Returns:
        (height, width, 3) uint8, sRGB.
    """
    directions = _directions(view, settings)
    eye = view.position.astype(np.float32)
    picture = np.empty((settings.height, settings.width, 3), np.float32)

    def draw(first: int, last: int) -> None:
        fine = directions[first * _SAMPLES : last * _SAMPLES]
        colors = scene.look(eye, fine.reshape(-1, 3), settings.void)
        shape = (last - first, _SAMPLES, settings.width, _SAMPLES, 3)
        picture[first:last] = colors.reshape(shape).mean((1, 3))

    in_parts(draw, settings.height, _ROWS_AT_ONCE)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def around(scene: Scene, view: View, settings: Settings) -> UInt8:
    """Render all that is seen from one place, as an equirectangular picture.

    Args:
        scene: What is to be seen.
        view: The eye, and what shall be in the middle.
        settings: See there.

    Returns:
        (around_width / 2, around_width, 3) uint8, sRGB; zenith at the top.
    """
    width, height = settings.around_width, settings.around_width // 2
    ahead = view.look_at - view.position
    middle = np.arctan2(ahead[1], ahead[0])
    azimuth = middle + np.pi - (np.arange(width) + 0.5) * (2 * np.pi / width)
    elevation = np.pi / 2 - (np.arange(height) + 0.5) * (np.pi / height)
    eye = view.position.astype(np.float32)
    picture = np.empty((height, width, 3), np.float32)

    def draw(first: int, last: int) -> None:
        up, turn = np.meshgrid(elevation[first:last], azimuth, indexing="ij")
        ways = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], -1)
        colors = scene.look(eye, ways.astype(np.float32).reshape(-1, 3), settings.void)
        picture[first:last] = colors.reshape(-1, width, 3)

    in_parts(draw, height, _ROWS_AT_ONCE)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def _directions(view: View, settings: Settings) -> Float32:
    """(h, w, 3) of the fine picture, from the eye, not of unit length."""
    forward = view.look_at - view.position
    forward = forward / np.linalg.norm(forward)
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    height, width = settings.height * _SAMPLES, settings.width * _SAMPLES
    half = np.tan(np.radians(settings.field_of_view_deg) / 2)
    across = ((np.arange(width) + 0.5) / width * 2 - 1) * half * width / height
    down = (1 - (np.arange(height) + 0.5) / height * 2) * half
    directions = forward + across[None, :, None] * right + down[:, None, None] * up
    return np.asarray(directions, np.float32)


@compiled
def _paint(
    which: npt.NDArray[np.int64],
    face: npt.NDArray[np.uint32],
    at: Float32,
    uv: Float32,
    texture: UInt8,
    colors: Float32,
) -> None:
    """Write the colours of some rays, where each met a face; bilinear."""
    height, width = texture.shape[:2]
    for k, ray in enumerate(which):
        a, b, c = uv[face[k]]
        u, v = at[k]
        x = (a[0] + u * (b[0] - a[0]) + v * (c[0] - a[0])) * width - np.float32(0.5)
        y = (a[1] + u * (b[1] - a[1]) + v * (c[1] - a[1])) * height - np.float32(0.5)
        left, top = int(np.floor(x)), int(np.floor(y))
        right_part, low_part = x - left, y - top
        right, low = min(max(left + 1, 0), width - 1), min(max(top + 1, 0), height - 1)
        left, top = min(max(left, 0), width - 1), min(max(top, 0), height - 1)
        for channel in range(3):
            above = texture[top, left, channel] * (1 - right_part)
            above += texture[top, right, channel] * right_part
            below = texture[low, left, channel] * (1 - right_part)
            below += texture[low, right, channel] * right_part
            colors[ray, channel] = above * (1 - low_part) + below * low_part
