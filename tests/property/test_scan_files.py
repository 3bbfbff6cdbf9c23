"""Whatever a cloud holds and however it is written, the reader gives the same points."""

import tempfile
from pathlib import Path
from unittest import mock

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scan_files import E57Part, cloud_table, write_e57, write_ply, xyz_fields

from tourgen.errors import InputError
from tourgen.scans import open_scan, read_room

FORMS = st.sampled_from(["ascii", "binary_little_endian", "binary_big_endian"])
COLOR_NAMES = st.sampled_from(
    [("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue")]
)
EXTRA = st.sampled_from(["nx", "intensity", "scalar_field", "alpha", "time", "label"])
COUNT = st.integers(1, 40)


def coordinates(count, kind, bound=1e6):
    width = 8 * np.dtype(kind).itemsize
    numbers = st.floats(-bound, bound, width=width, allow_subnormal=False)
    return arrays.arrays(kind, (count, 3), elements=numbers)


@st.composite
def tables(draw):
    """Columns in any order, of any type, with others between them; and what must come back."""
    count = draw(COUNT)
    points = draw(coordinates(count, draw(st.sampled_from(["f4", "f8"]))))
    table = cloud_table(points)
    shades = draw(arrays.arrays(np.uint8, (count, 3)))
    colored = draw(st.booleans())
    if colored:
        kind = draw(st.sampled_from(["u1", "u2", "f4", "f8"]))
        # a full white tells the range of the type, as it does in a real cloud
        shades[0] = 255
        values = {
            "u1": shades,
            "u2": shades.astype(np.uint16) * 257,
            "f4": shades.astype(np.float32) / np.float32(255),
            "f8": shades.astype(np.float64),
        }[kind]
        table |= {name: values[:, i] for i, name in enumerate(draw(COLOR_NAMES))}
    for name in draw(st.sets(EXTRA)):
        table[name] = draw(
            arrays.arrays(st.sampled_from([np.int8, np.uint32, np.float64, np.int16]), count)
        )
    order = draw(st.permutations(sorted(table)))
    return {name: table[name] for name in order}, points, shades if colored else None


@settings(deadline=None, max_examples=150)
@given(tables(), FORMS, st.sampled_from(["\n", "\r\n"]), st.integers(1, 50))
def test_every_flavour_of_ply_comes_back(content, form, newline, chunk_points):
    table, points, colors = content
    with tempfile.TemporaryDirectory() as folder:
        path = write_ply(Path(folder) / "a.ply", table, form, newline)
        scan = open_scan(path)
        with mock.patch("tourgen.scans.ply.CHUNK_POINTS", chunk_points):
            parts = list(scan.chunks())
    assert scan.point_count == len(points)
    assert scan.has_color == (colors is not None)
    assert np.array_equal(np.concatenate([part.points for part in parts]), points.astype(float))
    if colors is not None:
        assert np.array_equal(np.concatenate([part.colors for part in parts]), colors)


@settings(deadline=None, max_examples=150)
@given(tables(), FORMS, st.data())
def test_a_ply_cut_or_changed_anywhere_gives_points_or_one_line(content, form, data):
    table, _, _ = content
    with tempfile.TemporaryDirectory() as folder:
        path = write_ply(Path(folder) / "a.ply", table, form)
        whole = bytearray(path.read_bytes())
        if data.draw(st.booleans()):
            whole = whole[: data.draw(st.integers(0, len(whole) - 1))]
        else:
            place = data.draw(st.integers(0, len(whole) - 1))
            whole[place] = data.draw(st.integers(0, 255))
        path.write_bytes(whole)
        try:
            cloud, _, _ = read_room([open_scan(path)])
        except InputError as error:
            told = error.message
        else:
            told = "scan `a.ply`: "
            assert np.isfinite(cloud.points).all()
    assert told.startswith("scan `a.ply`: ")
    assert "\n" not in told


angles = st.floats(-np.pi, np.pi)
unit = st.floats(-1, 1)


def quaternion(axis, angle):
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])


def turned(points, axis, angle):
    """Rodrigues' rotation, which knows nothing of quaternions."""
    cosine, sine = np.cos(angle), np.sin(angle)
    along = (points @ axis)[:, None] * axis
    return points * cosine + np.cross(axis, points) * sine + along * (1 - cosine)


@settings(deadline=None, max_examples=60)
@given(
    COUNT.flatmap(lambda count: coordinates(count, "f8", 100)),
    st.tuples(unit, unit, unit).filter(lambda axis: np.linalg.norm(axis) > 0.1),
    angles,
    st.tuples(*[st.floats(-1e4, 1e4)] * 3),
    st.floats(0.1, 10),
)
def test_the_pose_of_an_e57_is_a_rotation_then_a_shift(points, axis, angle, shift, length):
    points[:, 2] += 200  # no return lies in the scanner
    direction = np.array(axis) / np.linalg.norm(axis)
    fields = xyz_fields(points) | {
        "rowIndex": np.arange(float(len(points))),
        "columnIndex": np.zeros(len(points)),
    }
    part = E57Part(fields, tuple(length * quaternion(direction, angle)), shift)
    with tempfile.TemporaryDirectory() as folder:
        scan = open_scan(write_e57(Path(folder) / "a.e57", [part]))
        (chunk,) = scan.chunks()
    expected = turned(points, direction, angle) + np.array(shift)
    assert np.allclose(chunk.points, expected, atol=1e-8)
    assert np.allclose(scan.stations, [shift])
    # the scanner sees every point as far away as it measured it
    assert np.allclose(
        np.linalg.norm(chunk.points - scan.stations[0], axis=1), np.linalg.norm(points, axis=1)
    )


@settings(deadline=None, max_examples=60)
@given(
    COUNT.flatmap(lambda count: coordinates(count, "f8", 50)),
    st.tuples(*[st.floats(-5e6, 5e6)] * 3),
    st.tuples(*[st.floats(-50, 0)] * 3),
)
def test_reading_a_room_keeps_what_lies_inside_to_a_hundredth_of_a_millimetre(points, shift, low):
    points = points + np.array(shift)
    low = tuple(np.array(low) + np.array(shift))
    with tempfile.TemporaryDirectory() as folder:
        scan = open_scan(write_ply(Path(folder) / "a.ply", cloud_table(points)))
        box = type("Box", (), {"min": low, "max": (1e9, 1e9, 1e9)})
        inside = (points >= np.array(low)).all(axis=1)
        if not inside.any():
            return
        cloud, _, facts = read_room([scan], box)
    assert facts.dropped_cropped == (~inside).sum()
    assert np.abs(cloud.points + cloud.origin - points[inside]).max() < 2e-5
