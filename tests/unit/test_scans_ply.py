"""PLY as programs write it, and as it arrives when something went wrong."""

import tracemalloc

import numpy as np
import pytest
from scan_files import cloud_table, ply_header, write_ply

from tourgen.errors import InputError
from tourgen.scans import open_scan

FORMS = ("ascii", "binary_little_endian", "binary_big_endian")
XYZ = [("x", "f4"), ("y", "f4"), ("z", "f4")]
POINTS = np.array([[0.5, -1.25, 2.0], [3.0, 4.5, -6.0], [1e3, 0.0, 7.75]], np.float32)
BYTES = np.array([[0, 128, 255], [10, 20, 30], [255, 254, 1]], np.uint8)


def read(path, **options):
    """All points and colours of a scan."""
    chunks = list(open_scan(path, **options).chunks())
    points = np.concatenate([chunk.points for chunk in chunks])
    if chunks[0].colors is None:
        return points, None
    return points, np.concatenate([chunk.colors for chunk in chunks])


def refused(path):
    """What is said of a scan that cannot be read to its end."""
    with pytest.raises(InputError) as caught:
        read(path)
    assert "\n" not in caught.value.message
    assert caught.value.message.startswith(f"scan `{path.name}`: ")
    return caught.value


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "names",
    [
        ("red", "green", "blue"),
        ("r", "g", "b"),
        ("Red", "Green", "Blue"),
        ("diffuse_red", "diffuse_green", "diffuse_blue"),
        ("vertex_r", "vertex_g", "vertex_b"),
    ],
)
def test_colors_are_found_under_any_name_in_use(tmp_path, form, names):
    table = cloud_table(POINTS) | {name: BYTES[:, i] for i, name in enumerate(names)}
    points, colors = read(write_ply(tmp_path / "a.ply", table, form))
    assert np.array_equal(points, POINTS)
    assert np.array_equal(colors, BYTES)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "values",
    [
        BYTES.astype(np.uint16) * 257,
        BYTES.astype(np.uint16),
        BYTES.astype(np.float32) / np.float32(255),
        BYTES.astype(np.float64),
        BYTES.view(np.int8),
        BYTES.astype(np.int32),
    ],
    ids=["16 bits", "bytes in ushort", "0 to 1", "0 to 255", "char", "int"],
)
def test_colors_of_every_type_become_bytes(tmp_path, form, values):
    if form == "ascii" and values.dtype == np.int8:
        values = BYTES  # as text, the sign is not there
    _, colors = read(write_ply(tmp_path / "a.ply", cloud_table(POINTS, values), form))
    assert np.array_equal(colors, BYTES)


def test_plain_colors_win_over_prefixed_ones_and_lone_letters_are_no_colors(tmp_path):
    table = cloud_table(POINTS) | {
        "ambient_red": BYTES[:, 2],
        "ambient_green": BYTES[:, 2],
        "ambient_blue": BYTES[:, 2],
        **{name: BYTES[:, i] for i, name in enumerate(("red", "green", "blue"))},
    }
    assert np.array_equal(read(write_ply(tmp_path / "a.ply", table))[1], BYTES)
    lone = cloud_table(POINTS) | {"r": BYTES[:, 0], "orange": BYTES[:, 0], "b": BYTES[:, 0]}
    assert read(write_ply(tmp_path / "b.ply", lone))[1] is None


def test_float_colors_are_scaled_by_the_brightest_of_the_whole_file(tmp_path, monkeypatch):
    monkeypatch.setattr("tourgen.scans.ply.CHUNK_POINTS", 2)
    values = np.array([[0.5, 0.5, 0.5], [1, 1, 1], [200, 100, 255]], np.float32)
    _, colors = read(write_ply(tmp_path / "a.ply", cloud_table(POINTS, values)))
    assert colors.tolist() == [[0, 0, 0], [1, 1, 1], [200, 100, 255]]


def test_a_color_that_is_no_number_is_black(tmp_path):
    values = np.array([[np.nan, 0.5, 1], [np.inf, -1, 0], [0, 0, 0]], np.float32)
    _, colors = read(write_ply(tmp_path / "a.ply", cloud_table(POINTS, values)))
    assert colors.tolist() == [[0, 128, 255], [255, 0, 0], [0, 0, 0]]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_headers_end_their_lines_in_any_way(tmp_path, form, newline):
    points = POINTS.copy()
    points.view(np.uint8)[0, 0] = 0x0A  # a line feed right behind the header
    points.view(np.uint8)[0, 3] = 0x0A  # in either byte order
    read_points, _ = read(write_ply(tmp_path / "a.ply", cloud_table(points), form, newline))
    assert np.array_equal(read_points, points)


@pytest.mark.parametrize("order", ["little", "big"])
def test_elements_before_and_behind_the_points_are_passed_over(tmp_path, order):
    mark = "<" if order == "little" else ">"
    header = (
        f"ply\nformat binary_{order}_endian 1.0\n"
        "element camera 2\nproperty double f\nproperty uchar n\n"
        "element face 2\nproperty list uchar int vertex_indices\nproperty uchar flag\n"
        "element vertex 3\nproperty float nx\nproperty float x\nproperty float y\n"
        "property double quality\nproperty float z\nproperty uchar red\nproperty uchar green\n"
        "property uchar blue\nproperty uchar alpha\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    vertex = np.zeros(
        3, [("nx", mark + "f4"), ("xy", mark + "f4", 2), ("q", mark + "f8"), ("z", mark + "f4"),
            ("rgb", "u1", 3), ("a", "u1")]
    )  # fmt: skip
    vertex["xy"], vertex["z"], vertex["rgb"] = POINTS[:, :2], POINTS[:, 2], BYTES

    def face(*indices: int) -> bytes:
        return bytes([len(indices)]) + np.array(indices, mark + "i4").tobytes()

    body = b"\1" * 18 + face(0, 1, 2) + b"\7" + face(0, 1, 2, 1) + b"\7" + vertex.tobytes()
    (tmp_path / "a.ply").write_bytes(header + body + face(2, 1, 0))
    points, colors = read(tmp_path / "a.ply")
    assert np.array_equal(points, POINTS)
    assert np.array_equal(colors, BYTES)


def test_ascii_elements_before_the_points_and_blank_lines_are_passed_over(tmp_path):
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int vertex_indices\n"
        "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
        "element edge 1\nproperty int a\nproperty int b\nend_header\n"
        "3 0 1 1\n4 0 1 1 0\n1 2 3\n\n  4 5e-1 6  \n0 1\n"
    )
    assert read(tmp_path / "a.ply")[0].tolist() == [[1, 2, 3], [4, 0.5, 6]]


@pytest.mark.parametrize("form", FORMS)
def test_points_that_are_no_numbers_are_dropped_and_counted(tmp_path, form):
    points = np.array([[1, 2, 3], [np.nan, 0, 0], [0, -np.inf, 0], [4, 5, 6], [0, 1e30, 0]], "f4")
    colors = np.arange(15, dtype=np.uint8).reshape(5, 3)
    (chunk,) = open_scan(write_ply(tmp_path / "a.ply", cloud_table(points, colors), form)).chunks()
    assert chunk.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert chunk.colors.tolist() == [[0, 1, 2], [9, 10, 11]]
    assert len(chunk.station) == 2
    assert chunk.dropped == 3


@pytest.mark.parametrize("form", FORMS)
def test_chunks_together_are_the_whole(tmp_path, monkeypatch, form):
    monkeypatch.setattr("tourgen.scans.ply.CHUNK_POINTS", 7)
    points = np.random.default_rng(1).normal(size=(50, 3))
    scan = open_scan(write_ply(tmp_path / "a.ply", cloud_table(points), form))
    chunks = list(scan.chunks())
    assert [len(chunk.points) for chunk in chunks] == [7] * 7 + [1]
    assert np.array_equal(np.concatenate([chunk.points for chunk in chunks]), points)
    assert scan.point_count == 50


def test_a_file_is_never_in_memory_as_a_whole(tmp_path, monkeypatch):
    monkeypatch.setattr("tourgen.scans.ply.CHUNK_POINTS", 5_000)
    points = np.zeros((400_000, 3))
    path = write_ply(tmp_path / "a.ply", cloud_table(points, np.zeros((400_000, 3), np.float32)))
    scan = open_scan(path)
    tracemalloc.start()
    count = sum(len(chunk.points) for chunk in scan.chunks())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert count == 400_000
    assert peak < path.stat().st_size / 4


@pytest.mark.parametrize(
    ("up", "expected"),
    [
        ("z", [1, 2, 3]),
        ("-z", [1, -2, -3]),
        ("y", [1, -3, 2]),
        ("-y", [1, 3, -2]),
        ("x", [-3, 2, 1]),
        ("-x", [3, 2, -1]),
    ],
)
def test_the_up_axis_is_turned_to_z_without_mirroring(tmp_path, up, expected):
    axes = np.vstack([[1, 2, 3], np.eye(3)]).astype(np.float32)
    points, _ = read(write_ply(tmp_path / "a.ply", cloud_table(axes)), up=up)
    assert points[0].tolist() == expected
    assert np.linalg.det(points[1:]) == pytest.approx(1)


def test_unit_then_pose_are_applied_and_a_given_station_moves_with_the_pose(tmp_path):
    pose = np.array([[0, -1, 0, 10], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], float)
    path = write_ply(tmp_path / "a.ply", cloud_table(np.array([[1000.0, 2000, 3000]])))
    scan = open_scan(path, 0.001, pose=pose, station=(1, 2, 1.5))
    (chunk,) = scan.chunks()
    assert chunk.points.tolist() == [[8, 1, 3]]
    assert scan.stations.tolist() == [[8, 1, 1.5]]
    assert chunk.station.tolist() == [0]


# ------------------------------------------------------------------ what cannot be read


def test_an_empty_file(tmp_path):
    (tmp_path / "a.ply").touch()
    assert refused(tmp_path / "a.ply").message.endswith("expected points, found an empty file")


def test_a_missing_file(tmp_path):
    assert "No such file" in refused(tmp_path / "a.ply").message


def test_an_unknown_format(tmp_path):
    (tmp_path / "a.xyz").write_text("1 2 3\n")
    assert "expected a name ending in .ply, .e57" in refused(tmp_path / "a.xyz").message


def test_a_truncated_binary_file_is_told_when_it_is_opened(tmp_path):
    path = write_ply(tmp_path / "a.ply", cloud_table(np.ones((100, 3), np.float32)))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="expected 100 points, found 91"):
        open_scan(path)


def test_a_truncated_ascii_file(tmp_path):
    path = write_ply(tmp_path / "a.ply", cloud_table(np.full((100, 3), 0.123456)), "ascii")
    path.write_bytes(b"\n".join(path.read_bytes().split(b"\n")[:60]) + b"\n")
    assert "expected 100 points, found 51" in refused(path).message


def test_a_count_that_no_file_of_this_size_can_hold_allocates_nothing(tmp_path):
    path = tmp_path / "a.ply"
    path.write_bytes(ply_header("ascii", 10**12, XYZ) + b"1 2 3\n")
    assert "expected 1000000000000 points, found room for 1" in refused(path).message


def test_truncated_faces_before_the_points(tmp_path):
    path = tmp_path / "a.ply"
    path.write_bytes(
        b"ply\nformat binary_little_endian 1.0\nelement face 9\n"
        b"property list uchar int vertex_indices\nelement vertex 1\nproperty float x\n"
        b"property float y\nproperty float z\nend_header\n\3"
    )
    assert "expected 9 records of `face`" in refused(path).message


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"solid\n", "expected a PLY file, found another format"),
        (b"ply\nformat ascii 1.0\n", "expected `end_header`, found none"),
        (ply_header("ascii", 1, []), "expected properties x, y and z, found none"),
        (
            b"ply\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
            b"end_header\n1 2 3\n",
            "expected a format among",
        ),
        (b"ply\nformat ascii 1.0\nelement face 0\nend_header\n", "expected an element `vertex`"),
        (ply_header("ascii", 1, XYZ[:2]) + b"1 2\n", "expected properties x, y and z, found x, y"),
        (ply_header("ascii", 1, XYZ, extra="property half nx"), "found `property half nx`"),
        (ply_header("ascii", 1, XYZ, extra="element vertex -1"), "found `element vertex -1`"),
        (ply_header("ascii", 1, XYZ, extra="property list uchar int k"), "found a list"),
        (
            ply_header("ascii", 3, XYZ) + b"1 2 3\n4 5 six\n7 8 9\n",
            "expected 3 numbers for point 2, found `4 5 six`",
        ),
        (
            ply_header("ascii", 3, XYZ) + b"1 2 3\n\n4 5 \n6 7 8\n",
            "expected 3 numbers for point 2, found `4 5`",
        ),
        (
            ply_header("ascii", 2, XYZ) + b"1,5 2,5 3,5\n1,5 2,5 3,5\n",
            "expected 3 numbers for point 1, found `1,5 2,5 3,5`",
        ),
        (
            ply_header("ascii", 2, XYZ) + b"\0\1\2\3\4\5\6\n\0\0\0\n",
            "expected 3 numbers for point 1, found `???????`",
        ),
        (ply_header("ascii", 3, XYZ) + b"1.5 2.5 3.5\n4 5 6\n7 8", "expected 3 points, found 2"),
    ],
)
def test_what_is_no_ply_is_told_in_one_line(tmp_path, text, said):
    (tmp_path / "a.ply").write_bytes(text)
    assert said in refused(tmp_path / "a.ply").message
