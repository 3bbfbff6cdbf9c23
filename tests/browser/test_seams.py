"""No hole shows where tiles of different levels meet.

Levels are forced into a checkerboard of neighbours and the void is coloured magenta: what shines
through, outside the true openings of the room, is a hole. The true openings are known from the
simulator's ground truth, which tests may open and the pipeline may not. What no station saw, and
what is a mirror, must be closed like all else.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import open3d as o3d
import pytest
from published import tileset
from scipy.ndimage import distance_transform_edt
from visitor import UPRIGHT_DEG, VOID, Bools, Vector, Visit, rays, shining

ROOMS = ("chamber1", "stairs", "chamber2")
VIEWS = 50
SIZE = (480, 320)
CLEARANCE_M = 0.35
EYE_M = 1.6
RIM_PX = 4
"""Around a true opening, where the surface may end a little sooner or later."""
OUTLINE = 3
"""Outlines before a true opening may move by so many geometric errors of the coarse tiles, which
are 95th percentiles; the worst found was 2.5 (the bed's cornice in the miniature)."""
THIN_M = 0.05
"""Depth, along the ray, of what counts as thin."""
BEYOND_PX = 40
"""Openings are known so far beyond the picture's edges."""
PIXEL_RAD = np.radians(UPRIGHT_DEG) / SIZE[1]
FLAT_LUMINANCE = 2.0
"""Standard deviation, of 255, below which a picture shows nothing."""


class TruthRoom:
    """The room as it stands."""

    def __init__(self, folder: Path, room: str) -> None:
        read = o3d.io.read_triangle_mesh(str(folder / f"{room}.ply"))
        mesh = o3d.t.geometry.TriangleMesh.from_legacy(read)
        facts = json.loads((folder / f"{room}.json").read_text(encoding="utf-8"))
        self.doors_and_windows = facts["openings"]
        self.scene = o3d.t.geometry.RaycastingScene()
        self.scene.add_triangles(mesh)
        self.low = mesh.get_min_bound().numpy()
        self.high = mesh.get_max_bound().numpy()

    def views(self, count: int) -> list[tuple[Vector, Vector]]:
        """Places where one can stand, each with a direction to look."""
        rng = np.random.default_rng(7)
        found: list[tuple[Vector, Vector]] = []
        while len(found) < count:
            eye = rng.uniform(self.low, self.high)
            down = self.cast(eye, np.array([0.0, 0.0, -1.0]))
            eye[2] += EYE_M - down
            if not np.isfinite(down) or self.clearance(eye) < CLEARANCE_M or not self.inside(eye):
                continue
            turn, tilt = rng.uniform(0, 2 * np.pi), rng.uniform(-0.7, 0.5)
            ahead = [np.cos(turn) * np.cos(tilt), np.sin(turn) * np.cos(tilt), np.sin(tilt)]
            found.append((eye, eye + ahead))
        return found

    def cast(self, origin: Vector, direction: Vector) -> float:
        """Distance to the first surface, infinite where there is none."""
        ray = np.concatenate([origin, direction]).astype(np.float32)[None]
        return float(self.scene.cast_rays(o3d.core.Tensor(ray))["t_hit"].numpy()[0])

    def clearance(self, place: Vector) -> float:
        point = o3d.core.Tensor(place.astype(np.float32)[None])
        return float(self.scene.compute_distance(point).numpy()[0])

    def inside(self, place: Vector) -> bool:
        """Whether nearly all directions end on a surface of the room."""
        directions = np.random.default_rng(1).normal(size=(200, 3))
        cast = np.concatenate([np.broadcast_to(place, directions.shape), directions], axis=1)
        hits = self.scene.cast_rays(o3d.core.Tensor(cast.astype(np.float32)))["t_hit"].numpy()
        return bool(np.isfinite(hits).mean() > 0.75)

    def void(self, eye: Vector, look_at: Vector, rim_m: float) -> Bools:
        """The pixels in which no surface need be, and those so near to them.

        Through an opening one may also see where something thin stands before it: a rail of two
        centimetres has gaps in the miniature, which are no holes of the room.
        """
        cast = rays(eye, look_at, SIZE, BEYOND_PX)
        length = np.linalg.norm(cast[..., 3:], axis=2)
        hit = self.scene.cast_rays(o3d.core.Tensor(cast))["t_hit"].numpy()
        behind = cast.copy()
        past = np.where(np.isfinite(hit), hit + THIN_M / length, 0)
        behind[..., :3] += past[..., None] * cast[..., 3:]
        farther = past + self.scene.cast_rays(o3d.core.Tensor(behind))["t_hit"].numpy()
        out = ~np.isfinite(hit)
        for opening in self.doors_and_windows:
            out |= through(opening, cast, hit) | through(opening, cast, farther)
        distance_m = hit * length
        rim_px = np.maximum(RIM_PX, rim_m / (distance_m * PIXEL_RAD))
        void: Bools = distance_transform_edt(~out) <= rim_px
        return void[BEYOND_PX:-BEYOND_PX, BEYOND_PX:-BEYOND_PX]


def through(opening: dict[str, Any], cast: npt.NDArray[np.float32], hit: Vector) -> Bools:
    """Whether rays pass an opening's rim in the plane of the wall before they meet anything."""
    centre, right, up, outward = (
        np.array(opening[key]) for key in ("center", "right", "up", "outward")
    )
    centre = centre - outward * opening["depth"]
    origin, direction = cast[..., :3].astype(np.float64), cast[..., 3:].astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (centre - origin) @ outward / (direction @ outward)
        at = origin + reach[..., None] * direction - centre
    beside = np.abs(at @ right) / (opening["width"] / 2)
    above = np.abs(at @ up) / (opening["height"] / 2)
    rim = np.hypot(beside, above) if opening["kind"] == "porthole" else np.maximum(beside, above)
    passed: Bools = (rim <= 1) & (reach > 0) & (direction @ outward > 0) & (reach < hit)
    return passed


@pytest.mark.parametrize("room", ROOMS)
def test_no_hole_where_levels_meet(tour_folder: Path, visit: Visit, room: str) -> None:
    """No void but through true openings."""
    truth = TruthRoom(tour_folder / "truth", room)
    _, root = tileset(tour_folder / "site/rooms" / room / "tileset.json")
    rim_m = OUTLINE * max(branch.error_m for branch in root.children)
    here = visit(size=SIZE)
    here.open(f"rooms/{room}/index.html", levels="checkerboard", background=VOID)
    holes, flat = {}, []
    for number, (eye, look_at) in enumerate(truth.views(VIEWS)):
        here.teleport(eye.tolist(), look_at.tolist())
        picture = here.picture()
        unwanted = shining(picture) & ~truth.void(eye, look_at, rim_m)
        if unwanted.any():
            holes[number] = int(unwanted.sum())
        if picture.mean(axis=2).std() < FLAT_LUMINANCE:
            flat.append(number)
    assert holes == {}, "pixels by view"
    assert flat == []
