"""What a room truly looks like from a camera, and which pixels are judged."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from drawing import SIZE, Camera, draw, tensor, textured
from rooms import BenchRoom

from tourgen.geometry import Float32, Float64, Int32, UInt8
from tourgen.rays import ray_scene

VERSION = 1
"""Raised when cameras or rendering change, so that stored pictures are made again."""
CAMERAS = 10
CLEARANCE_M = 0.45
EYE_M = 1.6
INSIDE_SHARE = 0.75
"""So many of the directions about an eye must end on a surface."""
VIEW_M = 0.9
"""A camera's median distance to what it sees is at least this."""
RIM_PX = 2
"""What is masked is masked so much wider: edges of glass are a matter of half pixels."""
LAMP_SPARE_M = 0.03
_SHOT = ("picture", "judged", "depth_m")

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Shot:
    """What a camera truly sees.

    Attributes:
        picture: (h, w, 3) uint8, sRGB.
        judged: (h, w) neither glass, void, mirror nor lamp.
        depth_m: (h, w) along the ray through the pixel's middle, infinite in the void.
    """

    picture: UInt8
    judged: Bools
    depth_m: Float64


class TexturedTruth:
    """The true surface with its picture."""

    def __init__(self, room: BenchRoom) -> None:
        from PIL import Image

        Image.MAX_IMAGE_PIXELS = None
        surface = room.truth_folder / f"{room.id}.ply"
        self.digest = hashlib.sha256(surface.read_bytes()).hexdigest()[:12]
        self.vertices, self.uv, self.faces = read_textured(surface)
        self.texture = np.asarray(
            Image.open(room.truth_folder / f"{room.id}.png").convert("RGB"), np.uint8
        )
        self.colors_at = textured(self.uv, self.faces, self.texture)
        self.facts = room.facts()
        self.scene = ray_scene(self.vertices, self.faces)
        self._is_mirror = np.zeros(len(self.faces), dtype=np.bool_)
        self._is_mirror[self.facts["mirror_faces"]] = True
        middle = self.vertices[self.faces].mean(axis=1)
        self._is_lamp = np.zeros(len(self.faces), dtype=np.bool_)
        for lamp in self.facts["lamps"]:
            away = np.linalg.norm(middle - np.array(lamp["position"]), axis=1)
            self._is_lamp |= away < lamp["radius_m"] + LAMP_SPARE_M

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """Ten places where one can stand, each with a direction to look."""
        return cameras_in(self.vertices, self.scene)

    def shot(self, camera: Camera) -> Shot:
        """What a camera sees, and what of it is judged."""
        picture = draw(self.scene, self.colors_at, camera, void=(0, 0, 0))
        masked, depth_m = self._masked(camera.rays(SIZE))
        return Shot(picture, ~_grown(masked, RIM_PX), depth_m)

    def _masked(self, cast: Float32) -> tuple[Bools, Float64]:
        """(h, w) what is not judged, and how far it is."""
        answer = self.scene.cast_rays(tensor(cast))
        reach = answer["t_hit"].numpy()
        found = np.isfinite(reach)
        face = np.where(found, answer["primitive_ids"].numpy(), 0).astype(np.int64)
        masked = ~found | self._is_mirror[face] | self._is_lamp[face]
        for opening in self.facts["openings"]:
            masked |= _through(opening, cast, reach)
        return masked, reach * np.linalg.norm(cast[..., 3:], axis=-1)


def cameras_in(vertices: Float64, scene: Any) -> tuple[Camera, ...]:
    """Ten places where one can stand in a surface, each with a direction to look; always the same.

    Args:
        vertices: (v, 3) of the surface, metres.
        scene: Its ray casting scene.
    """
    found: list[Camera] = []
    for camera in _tries(vertices, scene):
        reach = _reach(scene, camera.rays((48, 27)))
        if np.isfinite(reach).mean() > INSIDE_SHARE and np.median(reach) > VIEW_M:
            found.append(camera)
        if len(found) == CAMERAS:
            break
    return tuple(found)


def busiest(cameras: Sequence[Camera], scene: Any) -> list[int]:
    """Numbers of cameras, those first that see the most faces of a surface."""
    faces = [scene.cast_rays(tensor(each.rays((96, 54))))["primitive_ids"] for each in cameras]
    seen = [len(np.unique(each.numpy())) for each in faces]
    return sorted(range(len(cameras)), key=lambda number: -seen[number])


def _tries(vertices: Float64, scene: Any) -> Iterator[Camera]:
    rng = np.random.default_rng(11)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    while True:
        eye = rng.uniform(low, high)
        turn, tilt = rng.uniform(0, 2 * np.pi), rng.uniform(-0.6, 0.35)
        down = _reach(scene, np.array([[*eye, 0, 0, -1]], np.float32))[0]
        if not np.isfinite(down):
            continue
        eye[2] += EYE_M - down
        clearance_m = float(scene.compute_distance(tensor(eye[None])).numpy()[0])
        if clearance_m < CLEARANCE_M or not _inside(scene, eye):
            continue
        ahead = [np.cos(turn) * np.cos(tilt), np.sin(turn) * np.cos(tilt), np.sin(tilt)]
        yield Camera(eye, eye + ahead)


def _inside(scene: Any, place: Float64) -> bool:
    directions = np.random.default_rng(1).normal(size=(300, 3))
    origins = np.broadcast_to(place, directions.shape)
    reach = _reach(scene, np.concatenate([origins, directions], axis=1).astype(np.float32))
    return bool(np.isfinite(reach).mean() > INSIDE_SHARE)


def _reach(scene: Any, cast: Float32) -> Float64:
    reach: Float64 = scene.cast_rays(tensor(cast))["t_hit"].numpy()
    return reach * np.linalg.norm(cast[..., 3:], axis=-1)


def read_textured(path: Path) -> tuple[Float64, Float32, Int32]:
    """Vertices (v, 3), uv (v, 2) with (0, 0) in the upper left corner, and faces (f, 3)."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    counts = [
        int(line.split()[2]) for line in data[:end].splitlines() if line.startswith(b"element")
    ]
    vertex = np.frombuffer(data, [("xyz", "<f4", 3), ("st", "<f4", 2)], counts[0], end)
    face = np.frombuffer(data, [("n", "u1"), ("v", "<i4", 3)], counts[1], end + vertex.nbytes)
    uv = vertex["st"].copy()
    uv[:, 1] = 1 - uv[:, 1]
    return vertex["xyz"].astype(np.float64), uv, face["v"].astype(np.int32)


def _grown(mask: Bools, by_px: int) -> Bools:
    from scipy.ndimage import binary_dilation

    grown: Bools = binary_dilation(mask, iterations=by_px)
    return grown


def _through(opening: dict[str, Any], cast: Float32, hit: Float64) -> Bools:
    """Whether rays pass the pane of an opening, which lies deep in the wall, before they hit."""
    centre, right, up, outward = (
        np.array(opening[key]) for key in ("center", "right", "up", "outward")
    )
    origin, direction = cast[..., :3].astype(np.float64), cast[..., 3:].astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (centre - origin) @ outward / (direction @ outward)
        at = origin + reach[..., None] * direction - centre
    beside = np.abs(at @ right) / (opening["width"] / 2)
    above = np.abs(at @ up) / (opening["height"] / 2)
    rim = np.hypot(beside, above) if opening["kind"] == "porthole" else np.maximum(beside, above)
    passed: Bools = (rim <= 1) & (reach > 0) & (direction @ outward > 0) & (reach < hit)
    return passed


def true_shots(room: BenchRoom, truth: TexturedTruth, scratch: Path) -> list[Shot]:
    """What the room's cameras see, rendered once for each truth."""
    file = scratch / "shots" / f"{room.id}-v{VERSION}-{truth.digest}.npz"
    if not file.exists():
        shots = [truth.shot(camera) for camera in truth.cameras]
        file.parent.mkdir(parents=True, exist_ok=True)
        aside = file.with_name(f".{file.name}")
        columns = {name: np.stack([getattr(s, name) for s in shots]) for name in _SHOT}
        np.savez_compressed(aside, **columns)
        aside.rename(file)
    with np.load(file) as stored:
        return [Shot(*each) for each in zip(*(stored[name] for name in _SHOT), strict=True)]
