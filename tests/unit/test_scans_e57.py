"""E57: stations, poses, grids, invalid points, colours, damage."""

import numpy as np
import pytest
from scan_files import SHARED_SCANS, E57Part, rgb_fields, write_e57, xyz_fields

from tourgen.errors import InputError
from tourgen.scans import open_scan, read_room

POINTS = np.array([[1.0, 0, 0], [0, 2, 0], [0, 0, 3]])
QUARTER_TURN = (np.sqrt(0.5), 0, 0, np.sqrt(0.5))  # about z: x goes to y


def on_grid(points):
    """Fields of a scan on the scanner's grid."""
    count = np.arange(len(points), dtype=float)
    return xyz_fields(points) | {"rowIndex": count, "columnIndex": count}


def test_poses_are_applied_by_name_and_give_the_stations(tmp_path):
    path = write_e57(
        tmp_path / "a.e57",
        [
            E57Part(on_grid(POINTS), QUARTER_TURN, (10, 0, 1.5)),
            E57Part(on_grid(POINTS[:2]), (1, 0, 0, 0), (-10, 5, 1.5)),
        ],
    )
    cloud, stations, facts = read_room([open_scan(path)])
    assert stations.tolist() == [[10, 0, 1.5], [-10, 5, 1.5]]
    expected = [[10, 1, 1.5], [8, 0, 1.5], [10, 0, 4.5], [-9, 5, 1.5], [-10, 7, 1.5]]
    assert np.allclose(cloud.points, expected, atol=1e-6)
    assert cloud.station.tolist() == [0, 0, 0, 1, 1]
    assert facts.points_read == 5


def test_a_rotation_need_not_be_of_unit_length_and_may_be_left_out(tmp_path):
    twice = tuple(2 * number for number in QUARTER_TURN)
    parts = [
        E57Part(on_grid(POINTS), twice),
        E57Part(on_grid(POINTS), None, (0, 0, 1)),
        E57Part(on_grid(POINTS), (0, 0, 0, 0), (0, 0, 1)),
    ]
    chunks = list(open_scan(write_e57(tmp_path / "a.e57", parts)).chunks())
    assert np.allclose(chunks[0].points, [[0, 1, 0], [-2, 0, 0], [0, 0, 3]])
    assert np.allclose(chunks[1].points, POINTS + np.array([0, 0, 1]))
    assert np.allclose(chunks[2].points, POINTS + np.array([0, 0, 1]))


def test_the_origin_of_a_merged_cloud_is_no_station(tmp_path):
    identity = E57Part(xyz_fields(POINTS), (1, 0, 0, 0), (0, 0, 0))
    scan = open_scan(write_e57(tmp_path / "a.e57", [identity]))
    assert scan.stations.shape == (0, 3)
    assert next(scan.chunks()).station.tolist() == [-1, -1, -1]
    shifted = E57Part(xyz_fields(POINTS), (1, 0, 0, 0), (350_000, 5_000_000, 0))
    assert not len(open_scan(write_e57(tmp_path / "b.e57", [shifted])).stations)


def test_scans_posed_in_different_places_have_their_stations_there(tmp_path):
    first = E57Part(xyz_fields(POINTS), (1, 0, 0, 0), (0, 0, 0))
    second = E57Part(xyz_fields(POINTS), (1, 0, 0, 0), (3, 0, 0.5))
    scan = open_scan(write_e57(tmp_path / "a.e57", [first, second]))
    assert scan.stations.tolist() == [[0, 0, 0], [3, 0, 0.5]]
    assert [chunk.station.tolist() for chunk in scan.chunks()] == [[0] * 3, [1] * 3]
    assert not len(open_scan(write_e57(tmp_path / "b.e57", [second, second])).stations)


def test_the_origin_of_a_scan_on_the_grid_or_in_angles_is_its_station(tmp_path):
    angles = {
        "sphericalRange": np.array([1.0, 2.0, 3.0]),
        "sphericalAzimuth": np.array([0, np.pi / 2, 0]),
        "sphericalElevation": np.array([0, 0, np.pi / 2]),
    }
    scan = open_scan(write_e57(tmp_path / "a.e57", [E57Part(on_grid(POINTS)), E57Part(angles)]))
    assert scan.stations.tolist() == [[0, 0, 0], [0, 0, 0]]
    for chunk in scan.chunks():
        assert np.allclose(chunk.points, POINTS)


def test_invalid_points_and_empty_returns_are_dropped_and_counted(tmp_path):
    points = np.array([[1.0, 0, 0], [9, 9, 9], [9, 9, 9], [0, 0, 0], [np.nan, 0, 0], [2, 0, 0]])
    fields = on_grid(points) | {"cartesianInvalidState": np.array([0.0, 1, 2, 0, 0, 0])}
    (chunk,) = open_scan(write_e57(tmp_path / "a.e57", [E57Part(fields)])).chunks()
    assert chunk.points.tolist() == [[1, 0, 0], [2, 0, 0]]
    assert chunk.dropped == 4


@pytest.mark.parametrize("full", [1.0, 255.0, 4095.0, 65535.0])
def test_colors_are_scaled_by_their_limits(tmp_path, full):
    shades = np.array([[0.0, 0.2, 1.0], [1.0, 0.4, 0.0], [0.6, 0.6, 0.6]])
    part = E57Part(xyz_fields(POINTS) | rgb_fields(shades * full), color_maximum=full)
    (chunk,) = open_scan(write_e57(tmp_path / "a.e57", [part])).chunks()
    assert chunk.colors.tolist() == [[0, 51, 255], [255, 102, 0], [153, 153, 153]]


def test_a_part_without_color_is_grey_and_told(tmp_path):
    colored = E57Part(xyz_fields(POINTS) | rgb_fields(POINTS), color_maximum=255.0)
    path = write_e57(tmp_path / "a.e57", [colored, E57Part(xyz_fields(POINTS))])
    cloud, _, facts = read_room([open_scan(path)])
    assert facts.warnings == ("scan `a.e57`: scan 2 in it has no colour",)
    assert cloud.colors[3:].tolist() == [[160] * 3] * 3


def test_blocks_together_are_the_whole(tmp_path, monkeypatch):
    monkeypatch.setattr("tourgen.scans.e57.CHUNK_POINTS", 8)
    points = np.random.default_rng(2).normal(size=(50, 3))
    parts = [E57Part(xyz_fields(points[:30])), E57Part(xyz_fields(points[30:]))]
    scan = open_scan(write_e57(tmp_path / "a.e57", parts))
    assert scan.point_count == 50
    chunks = list(scan.chunks())
    assert max(len(chunk.points) for chunk in chunks) == 8
    assert np.array_equal(np.concatenate([chunk.points for chunk in chunks]), points)


def test_damage_is_one_line(tmp_path):
    path = write_e57(tmp_path / "a.e57", [E57Part(xyz_fields(np.ones((5000, 3))))])
    whole = path.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 0xFF
    for damaged in (whole[: len(whole) // 2], bytes(flipped), b"ASTM-E57" + bytes(5000), b"x"):
        path.write_bytes(damaged)
        with pytest.raises(InputError) as caught:
            list(open_scan(path).chunks())
        assert "\n" not in caught.value.message
        assert caught.value.message.startswith(
            "scan `a.e57`: expected an E57 file that can be read, found: "
        )


def test_fields_that_are_no_positions_are_refused(tmp_path):
    path = write_e57(tmp_path / "a.e57", [E57Part({"intensity": np.ones(3)})])
    with pytest.raises(InputError, match=r"expected cartesian or spherical .* found intensity"):
        open_scan(path)


def test_a_file_without_scans_is_refused(tmp_path):
    path = write_e57(tmp_path / "a.e57", [])
    with pytest.raises(InputError, match="expected at least one scan in the file, found none"):
        open_scan(path)


@pytest.mark.skipif(not SHARED_SCANS.is_dir(), reason="../shared/scans is absent")
def test_real_scans_give_their_stations():
    pump = SHARED_SCANS / "real_e57" / "pumpAVisualReferenceImage.e57"
    cloud, stations, facts = read_room([open_scan(pump)])
    assert (len(cloud), facts.dropped_invalid, facts.warnings) == (155_201, 0, ())
    assert stations.tolist() == [[0, 0, 0]]
    # the scanner's own limits of range, from the file's header
    distance = np.linalg.norm(cloud.points, axis=1)
    assert distance.min() == pytest.approx(1.983619, abs=1e-4)
    assert distance.max() == pytest.approx(5.429336, abs=1e-4)
    gallery = open_scan(SHARED_SCANS / "gallery_sim" / "scan_structured.e57")
    expected = [[0.6, 0.4, 1.5], [-3.0, 2.5, 1.5], [3.0, -3.0, 1.5]]
    assert np.allclose(gallery.stations, expected)
