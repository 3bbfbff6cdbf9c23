"""A leg that ends in a shadow stands on the floor; one that was seen to end ends there."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from tourgen.geometry import Mesh, PointCloud
from tourgen.stages.free_space import FreeSpace, free_space
from tourgen.stages.surface.footing import on_footing
from tourgen.stages.surface.tubes import Rod

STATION = np.array([0.0, -2.0, 1.4])
LEG = Rod(np.array([[0, 0, 0.3], [0.1, 0, 1.3]]), 0.015)


def floor() -> Mesh:
    box = trimesh.creation.box(
        (4, 4, 0.2), trimesh.transformations.translation_matrix([0, 0, -0.1])
    )
    return Mesh(np.zeros(3), np.float32(box.vertices), np.int32(box.faces))


def seen_past(screen_top_m: float) -> FreeSpace:
    """What a station sees of a wall and of a screen that hides its lower part."""
    azimuth, height = np.meshgrid(np.linspace(-0.8, 0.8, 300), np.linspace(-1.0, 0.5, 300))
    way = np.stack([np.sin(azimuth), np.cos(azimuth), height], axis=-1).reshape(-1, 3)
    at_screen = STATION + way * (1.0 / way[:, 1:2])
    hidden = at_screen[:, 2] < screen_top_m
    reach = np.where(hidden, 1.0, 4.0) / way[:, 1]
    points = np.float32(STATION + way * reach[:, None])
    count = len(points)
    cloud = PointCloud(
        np.zeros(3), points, np.zeros((count, 3), np.uint8), np.zeros(count, np.int16)
    )
    return free_space(cloud, STATION[None], 0.75, -58, 0.005)


def test_a_leg_ending_in_a_shadow_goes_on_to_the_floor() -> None:
    (leg,) = on_footing((LEG,), floor(), seen_past(0.9))
    assert leg.axis[0] == pytest.approx([-0.03, 0, 0], abs=1e-3)
    assert leg.axis[-1] == pytest.approx(LEG.axis[-1])
    assert leg.radius_m == LEG.radius_m


def test_a_leg_seen_to_end_ends_there() -> None:
    (leg,) = on_footing((LEG,), floor(), seen_past(-1.0))
    assert np.allclose(leg.axis, LEG.axis)


def test_a_leg_far_from_what_it_points_at_stays_as_it_is() -> None:
    short = LEG.cut(0.5, 1.0)
    (leg,) = on_footing((short,), floor(), seen_past(0.9))
    assert np.allclose(leg.axis, short.axis)


def test_a_leg_that_ends_in_the_seat_it_carries_ends_there() -> None:
    seat = trimesh.creation.box((0.4, 0.4, 0.1))
    seat.apply_translation((0.1, 0, 1.3))
    both = trimesh.util.concatenate([trimesh.Trimesh(floor().vertices, floor().faces), seat])
    stool = Mesh(np.zeros(3), np.float32(both.vertices), np.int32(both.faces))
    (leg,) = on_footing((LEG,), stool, seen_past(1.6))
    assert leg.axis[-1] == pytest.approx(LEG.axis[-1])
    assert leg.axis[0, 2] == pytest.approx(0, abs=1e-3)
