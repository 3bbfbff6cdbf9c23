"""Reading a room: crop, origin, stations of several scans, too few points, odd files."""

import numpy as np
import pytest
from scan_files import SHARED_SCANS, E57Part, cloud_table, write_e57, write_ply, xyz_fields

from tourgen.errors import InputError
from tourgen.scans import FORMATS, open_scan, read_room, without_repeats
from tourgen.tour import Box

ODD_FILES = sorted(
    path for path in (SHARED_SCANS / "odd").rglob("*") if path.suffix.lower() in FORMATS
)


def ply(path, points, colors=None):
    return open_scan(write_ply(path, cloud_table(np.asarray(points), colors)))


def test_a_room_is_cropped_while_it_is_read(tmp_path):
    points = np.array([[0.0, 0, 0], [1, 1, 1], [1.01, 0, 0], [0.5, 0.5, 0.5], [-9, 0, 0]])
    colors = np.arange(15, dtype=np.uint8).reshape(5, 3)
    keep = Box(min=(0, 0, 0), max=(1, 1, 1))
    remove = [Box(min=(0.4, 0.4, 0.4), max=(0.6, 0.6, 0.6))]
    cloud, _, facts = read_room([ply(tmp_path / "a.ply", points, colors)], keep, remove)
    assert cloud.points.tolist() == [[0, 0, 0], [1, 1, 1]]
    assert cloud.colors.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert (facts.points_read, facts.dropped_cropped, facts.dropped_invalid) == (5, 3, 0)


def test_near_coordinates_keep_zero_as_their_origin(tmp_path):
    cloud, _, _ = read_room([ply(tmp_path / "a.ply", [[99.0, -99, 0], [1e5, 0, 0], [1, 2, 3]])])
    assert cloud.origin.tolist() == [0, 0, 0]
    assert cloud.points.dtype == np.float32


def test_far_coordinates_lose_nothing(tmp_path):
    points = np.array([354_123.4567, 5_412_345.6789, 45.1234]) + np.random.default_rng(0).uniform(
        -3, 3, (200, 3)
    )
    points[:5] += 1e5  # strays
    scan = ply(tmp_path / "a.ply", points)
    cloud, _, _ = read_room([scan], Box(min=tuple(points[5:].min(0)), max=tuple(points[5:].max(0))))
    assert np.array_equal(cloud.origin, np.floor(np.median(points, axis=0)))
    assert np.abs(cloud.origin + cloud.points - points[5:]).max() < 1e-6


def test_the_crop_does_not_move_the_origin(tmp_path):
    points = 1000 + np.random.default_rng(0).uniform(-3, 3, (200, 3))
    scan = ply(tmp_path / "a.ply", points)
    whole, _, _ = read_room([scan])
    part, _, _ = read_room([scan], Box(min=(1000, 1000, 1000), max=(1003, 1003, 1003)))
    assert np.array_equal(whole.origin, part.origin)


def test_stations_of_several_scans_are_numbered_through(tmp_path):
    grid = {"rowIndex": np.arange(2.0), "columnIndex": np.arange(2.0)}
    points = np.array([[1.0, 0, 0], [0, 1, 0]])
    parts = [
        E57Part(xyz_fields(points) | grid, (1, 0, 0, 0), (500, shift, 1.5)) for shift in (0, 3)
    ]
    scans = [
        open_scan(write_e57(tmp_path / "a.e57", parts)),
        ply(tmp_path / "b.ply", [[501.0, 1, 1]]),
        open_scan(write_ply(tmp_path / "c.ply", cloud_table(points)), station=(502, 0, 1.5)),
    ]
    cloud, stations, facts = read_room(scans)
    assert cloud.station.tolist() == [0, 0, 1, 1, -1, 2, 2]
    assert (stations + cloud.origin).tolist() == [[500, 0, 1.5], [500, 3, 1.5], [502, 0, 1.5]]
    assert [warning.split(":")[0] for warning in facts.warnings] == [
        "scan `a.e57`",
        "scan `b.ply`",
        "scan `c.ply`",
    ]


def test_a_scan_without_color_is_grey_with_a_warning(tmp_path):
    cloud, _, facts = read_room([ply(tmp_path / "a.ply", [[1.0, 2, 3]])])
    assert cloud.colors.tolist() == [[160, 160, 160]]
    assert facts.warnings == ("scan `a.ply`: has no colours, its points are grey",)


@pytest.mark.parametrize("full", [np.uint8(255), np.float32(1), np.uint16(65535)])
def test_a_black_scan_is_grey_with_a_warning_and_the_others_are_not(tmp_path, full):
    """Many programs write colours of zero where there are none."""
    points = np.arange(6.0).reshape(2, 3)
    black = np.zeros((2, 3), full.dtype)
    lit = black.copy()
    lit[1, 2] = full
    scans = [ply(tmp_path / "a.ply", points, black), ply(tmp_path / "b.ply", points + 1, lit)]
    cloud, _, facts = read_room(scans)
    assert cloud.colors.tolist() == [[160] * 3, [160] * 3, [0] * 3, [0, 0, 255]]
    assert facts.warnings == ("scan `a.ply`: has colours that are all black, its points are grey",)


def test_what_the_crop_darkens_stays_dark(tmp_path):
    """A black cupboard alone is black: its scan has seen light."""
    points, colors = np.arange(6.0).reshape(2, 3), np.uint8([[0, 0, 0], [9, 9, 9]])
    keep = Box(min=(0, 0, 0), max=(2, 2, 2))
    cloud, _, facts = read_room([ply(tmp_path / "a.ply", points, colors)], keep)
    assert cloud.colors.tolist() == [[0, 0, 0]]
    assert facts.warnings == ()


def test_a_scan_that_the_crop_leaves_nothing_of_is_told(tmp_path):
    points, colors = np.ones((2, 3)), np.ones((2, 3), np.uint8)
    near, far = ply(tmp_path / "a.ply", points, colors), ply(tmp_path / "b.ply", 9 * points, colors)
    _, _, facts = read_room([near, far], Box(min=(0, 0, 0), max=(2, 2, 2)))
    assert facts.warnings == ("scan `b.ply`: `keep` and `remove` leave none of its points",)
    assert facts.bounds[0].tolist() == [[1, 1, 1], [1, 1, 1]]
    assert np.isnan(facts.bounds[1]).all()


def test_each_place_counts_once(tmp_path):
    points = np.float32([[0.0, 1, 2], [3, 4, 5], [-0.0, 1, 2], [3, 4, 5.5], [3, 4, 5]])
    cloud, _, _ = read_room([ply(tmp_path / "a.ply", points, np.uint8(10 * points))])
    left = without_repeats(cloud)
    assert left.points.tolist() == [[0, 1, 2], [3, 4, 5], [3, 4, 5.5]]
    assert left.colors.tolist() == [[0, 10, 20], [30, 40, 50], [30, 40, 55]]
    assert without_repeats(left) is left


@pytest.mark.parametrize(
    ("points", "keep", "said", "hint"),
    [
        (np.ones((50, 3)), None, "expected at least 100 points, found 50", "lower"),
        (np.ones((0, 3)), None, "expected at least 100 points, found 0", "lower"),
        (
            np.vstack([np.ones((99, 3)), np.full((9, 3), np.nan)]),
            None,
            "found 99, 9 invalid ones dropped",
            "lower",
        ),
        (np.ones((500, 3)), Box(min=(2, 2, 2), max=(3, 3, 3)), "found 0, 500 cropped", "[1.00"),
    ],
)
def test_too_few_points_are_told_with_what_became_of_the_others(tmp_path, points, keep, said, hint):
    with pytest.raises(InputError) as caught:
        read_room([ply(tmp_path / "a.ply", points)], keep, min_points=100)
    assert caught.value.message.startswith("scan `a.ply`: ")
    assert said in caught.value.message
    assert hint in caught.value.hint


def test_of_no_points_at_all_no_cloud_is_made(tmp_path):
    with pytest.raises(InputError, match="expected points, found 0"):
        read_room([ply(tmp_path / "a.ply", np.ones((0, 3)))])


@pytest.mark.skipif(not ODD_FILES, reason="../shared/scans/odd is absent")
def test_odd_files_give_points_or_one_line():
    read, refused = [], {}
    for path in ODD_FILES:
        try:
            cloud, stations, facts = read_room([open_scan(path)])
        except InputError as error:
            refused[path.name] = error.message
            continue
        read.append(path.name)
        assert len(cloud) == facts.points_read - facts.dropped_invalid > 0
        assert np.isfinite(cloud.points).all()
        assert cloud.station.max() < max(1, len(stations))
    assert {"ascii_float_rgb.ply", "big_endian_double_diffuse.ply", "tiny_spherical.e57"} <= set(
        read
    )
    assert {"truncated.ply", "zero_vertices.ply", "corrupt_crc.e57"} <= set(refused)
    assert all(said.startswith(f"scan `{name}`: ") for name, said in refused.items())
    assert not any("\n" in said for said in refused.values())
    assert len(read) > len(refused)
