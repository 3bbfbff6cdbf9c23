"""Points of a merged cloud go back to the stations whose grids they lie on."""

import numpy as np
import pytest

from tourgen.stages.ownership import Settings, ownership
from tourgen.voxels import voxel_groups

PLACES = np.array([[-1.2, -0.6, 1.5], [1.1, 0.7, 1.6]])
OFF = np.array([[0.03, -0.02, 0.06], [-0.02, 0.03, -0.05]])
SIZE = np.array([3.0, 2.5, 1.4])
MIDDLE = np.array([0.0, 0.0, 1.4])


def measured(place, heading_deg, step_deg, rng):
    """What a scanner in an empty box measures: 2 mm of noise along each beam."""
    elevation = np.radians(np.arange(-60 + step_deg / 2, 90, step_deg))
    azimuth = np.radians(np.arange(0, 360, step_deg) + heading_deg)
    el, az = (a.ravel() for a in np.meshgrid(elevation, azimuth, indexing="ij"))
    way = np.stack([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)], axis=1)
    wall = MIDDLE + np.sign(way) * SIZE
    reach = np.min((wall - place) / way, axis=1)
    return place + way * (reach + rng.normal(0, 0.002, len(reach)))[:, None]


@pytest.fixture(scope="module")
def merged():
    rng = np.random.default_rng(3)
    scans = [measured(PLACES[0], 12.3, 0.9, rng), measured(PLACES[1], 51.7, 0.9, rng)]
    points = np.concatenate(scans).astype(np.float32)
    station = np.repeat([0, 1], [len(scan) for scan in scans])
    kept = rng.permutation(len(points))[: int(0.8 * len(points))]
    return points[kept], station[kept]


def test_each_point_finds_its_station(merged):
    points, station = merged
    found = ownership(points, PLACES + OFF, Settings())
    assert np.linalg.norm(found.stations - PLACES, axis=1).max() < 0.0001
    assert (found.station == station).mean() > 0.99


def test_steps_finer_than_the_place_is_known_are_found():
    rng = np.random.default_rng(3)
    scans = [measured(PLACES[0], 12.3, 0.1, rng), measured(PLACES[1], 51.7, 0.15, rng)]
    points = np.concatenate(scans).astype(np.float32)
    station = np.repeat([0, 1], [len(scan) for scan in scans])
    kept = rng.permutation(len(points))[: int(0.2 * len(points))]
    far_off = np.array([[-0.10, 0.11, 0.08], [0.09, 0.10, -0.04]])
    found = ownership(points[kept], PLACES + far_off, Settings())
    assert np.linalg.norm(found.stations - PLACES, axis=1).max() < 0.0001
    assert (found.station == station[kept]).mean() > 0.99


def test_averaged_points_have_no_owner(merged):
    points, _ = merged
    order, starts = voxel_groups(points, 0.15)
    count = np.diff(np.append(starts, len(order)))[:, None]
    averaged = (np.add.reduceat(points[order], starts, axis=0) / count).astype(np.float32)
    found = ownership(averaged, PLACES, Settings())
    assert (found.station == -1).all()


def test_one_station_missing_nobody_owns(merged):
    points, _ = merged
    found = ownership(points, PLACES[:1] + OFF[:1], Settings())
    assert (found.station == -1).all()
    assert np.linalg.norm(found.stations - PLACES[:1]) < 0.0001


@pytest.mark.parametrize("place", [[[0.4, -1.3, 0.9]], [[-0.75, -1.72, 0.67]]], ids=str)
def test_a_place_where_nobody_stood_owns_nothing(merged, place):
    """From the second the steps of a grid grow without end, until all points lie on it."""
    points, _ = merged
    place = np.array(place)
    found = ownership(points, place, Settings())
    assert (found.station == -1).all()
    assert (found.stations == place).all()


def test_no_station_no_owner(merged):
    points, _ = merged
    found = ownership(points, np.empty((0, 3)), Settings())
    assert (found.station == -1).all()
    assert found.stations.shape == (0, 3)


def test_few_points_have_no_owner():
    points = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
    assert (ownership(points, PLACES, Settings()).station == -1).all()


def test_a_few_points_on_a_grid_by_chance_move_no_station(merged):
    """Narrow windows of few points are regular somewhere; that is no scanner's grid."""
    points, _ = merged
    few = points[::30]
    places = np.array([[0.4, -1.3, 0.9], [-0.75, -1.72, 0.67], [0.9, 1.5, 1.2]])
    found = ownership(few, places, Settings())
    assert (found.station == -1).all()
    assert (found.stations == places).all()
