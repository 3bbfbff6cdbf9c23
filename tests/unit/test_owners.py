"""A merged scan tells who measured what, and where from, as long as its points are as measured."""

from __future__ import annotations

import numpy as np
from scanned import EYES, ROOM, beams, cloud_of, inside, noisy, ranges, solid

from tourgen.geometry import PointCloud
from tourgen.stages import owners, thin

CHEST = solid([-0.4, -0.3, 0.0], [0.5, 0.4, 0.9])


def merged(step_deg: float = 0.6) -> tuple[PointCloud, np.ndarray]:
    rng = np.random.default_rng(0)
    parts = []
    for number, eye in enumerate(EYES):
        way = beams(step_deg, heading_deg=17.3 * (number + 1)).reshape(-1, 3)
        parts.append(eye + way * noisy(ranges(eye, way, inside(*ROOM), CHEST), rng)[:, None])
    cloud = cloud_of(parts, merged=True)
    return cloud, np.repeat([0, 1], [len(part) for part in parts])


def test_each_point_finds_its_station() -> None:
    cloud, true = merged()
    near = EYES + np.array([[0.03, -0.05, 0.1], [-0.06, 0.02, -0.12]])
    found = owners.owners(cloud, near, owners.Settings())
    assert (found.cloud.station == true).mean() > 0.995
    assert np.abs(found.stations - EYES).max() < 0.001
    assert found.cloud.points is cloud.points


def test_averaged_points_lie_on_no_grid() -> None:
    cloud, _ = merged()
    cloud = thin.thin(cloud, thin.Settings(0.03))
    found = owners.owners(cloud, EYES, owners.Settings())
    assert found.cloud is cloud
    assert np.array_equal(found.stations, EYES)


def test_a_missing_station_claims_nothing() -> None:
    cloud, _ = merged()
    assert owners.owners(cloud, EYES[:1], owners.Settings()).cloud is cloud


def test_what_is_known_or_cannot_be_stays() -> None:
    cloud, true = merged(2.0)
    known = PointCloud(cloud.origin, cloud.points, cloud.colors, true.astype(np.int16))
    assert owners.owners(known, EYES, owners.Settings()).cloud is known
    assert owners.owners(cloud, np.empty((0, 3)), owners.Settings()).cloud is cloud
    assert owners.owners(cloud, EYES + 300.0, owners.Settings()).cloud is cloud
    spot = cloud_of([np.ones((5000, 3))], merged=True)
    assert owners.owners(spot, EYES, owners.Settings()).cloud is spot
