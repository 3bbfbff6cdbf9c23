"""What was read may be a room: its unit, its width, what each scan of it holds."""

import numpy as np
import pytest
from scan_files import cloud_table, write_ply

from tourgen.cache import stamp_of
from tourgen.errors import InputError
from tourgen.fitting.plausible import require_room
from tourgen.fitting.points import read, reading
from tourgen.geometry import PointCloud
from tourgen.scans import ReadFacts
from tourgen.tour import Room

POINTS = np.random.default_rng(0).uniform((-2, -1.5, 0), (2, 1.5, 2.5), (12_000, 3))


def read_as(tmp_path, unit, points) -> tuple[PointCloud, ReadFacts]:
    write_ply(tmp_path / "a.ply", cloud_table(points, np.full(points.shape, 9, np.uint8)))
    room = Room(id="a", scans=["a.ply"], unit=unit)
    scan = read(room, tmp_path, {"a.ply": stamp_of(tmp_path / "a.ply")}, reading(room))
    return scan.cloud, scan.facts


@pytest.mark.parametrize(
    ("unit", "in_a_metre"), [("m", 1), ("cm", 100), ("mm", 1000), ("ft", 1 / 0.3048)]
)
def test_every_unit_that_is_named_gives_metres(tmp_path, unit, in_a_metre):
    cloud, facts = read_as(tmp_path, unit, POINTS * in_a_metre)
    assert np.abs(cloud.points - POINTS).max() < 1e-6
    assert facts.warnings == ()


def test_a_wide_room_is_built_with_a_word_on_its_unit(tmp_path):
    _, facts = read_as(tmp_path, "m", POINTS * 100)
    assert facts.warnings == (
        'scan `a.ply`: is 392 m wide; if its numbers are cm, write `unit = "cm"`: 3.92 m wide',
    )


def test_a_gallery_of_200_m_and_a_few_strays_a_mile_off_are_no_fault(tmp_path):
    gallery = POINTS * (50, 1, 1)
    gallery[:100] += 1600
    cloud, facts = read_as(tmp_path, "m", gallery)
    assert len(cloud) == 12_000
    assert facts.warnings == ()


def test_a_relief_2_cm_deep_on_a_wall_4_m_wide_is_no_plane(tmp_path):
    relief = POINTS * (1, 1, 0)
    relief[:, 2] = np.where(np.abs(relief[:, 0]) < 1, 0.02, 0)
    assert len(read_as(tmp_path, "m", relief)[0]) == 12_000


def test_the_order_of_the_points_does_not_matter():
    """A scanner writes column by column: one point in so many lies at one height."""
    many = np.tile(POINTS[:1000], (400, 1)).astype(np.float32)
    many[::4, 2] = 0
    assert require_room(many, Room(id="a", scans=["a.ply"]), ReadFacts(400_000, 0, 0, ())) == ()


def test_too_few_places_are_told_with_what_was_dropped(tmp_path):
    with pytest.raises(InputError) as told:
        read_as(tmp_path, "m", np.repeat(POINTS[:2000], 6, axis=0))
    assert told.value.message == (
        "scan `a.ply`: expected at least 10000 points, found 2000, "
        "10000 at the place of another dropped"
    )


def test_a_scan_given_twice_is_read_once(tmp_path):
    cloud, facts = read_as(tmp_path, "m", np.concatenate([POINTS, POINTS]))
    assert np.abs(cloud.points - POINTS).max() < 1e-6
    assert (facts.points_read, facts.dropped_repeated) == (24_000, 12_000)


@pytest.mark.parametrize(("spoil", "told"), [("write_bytes", "changed"), ("unlink", "gone")])
def test_a_scan_that_changes_under_the_build_is_told(tmp_path, spoil, told):
    file = tmp_path / "a.ply"
    write_ply(file, cloud_table(POINTS, np.full(POINTS.shape, 9, np.uint8)))
    stamps = {"a.ply": stamp_of(file)}
    getattr(file, spoil)(*([file.read_bytes()[:-30]] if spoil == "write_bytes" else []))
    room = Room(id="a", scans=["a.ply"])
    with pytest.raises(InputError, match=f"expected it as it was .*, found it {told}"):
        read(room, tmp_path, stamps, reading(room))
