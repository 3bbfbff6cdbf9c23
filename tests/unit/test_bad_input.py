"""Bad input at the command line: one line with file, room and key, exit code 2, nothing touched."""

import numpy as np
import pytest
from scan_files import cloud_table, write_ply

from tourgen.cli import main
from tourgen.errors import Faults
from tourgen.tour import check_tour

HEAD = '[tour]\ntitle = "T"\n'
GOOD = '[[room]]\nid = "hall"\nscans = ["good.ply"]\n'
KITCHEN = '[[room]]\nid = "kitchen"\nscans = ["{scan}"]\n'
LINK = '[[room.link]]\nto = "{to}"\nat = [0, 0, 1]\n'


@pytest.fixture
def folder(tmp_path):
    """Scans good and bad, and a site that was published before."""
    table = cloud_table(
        np.random.default_rng(0).uniform(-2, 2, (12_000, 3)).astype(np.float32),
        np.zeros((12_000, 3), np.uint8),
    )
    good = write_ply(tmp_path / "good.ply", table)
    (tmp_path / "empty.ply").touch()
    (tmp_path / "cut.ply").write_bytes(good.read_bytes()[:-1000])
    text = write_ply(tmp_path / "text.ply", table, "ascii")
    text.write_bytes(text.read_bytes()[:-20_000])
    write_ply(tmp_path / "few.ply", {name: values[:50] for name, values in table.items()})
    write_ply(tmp_path / "grey.ply", {name: table[name] for name in "xyz"})
    holes = {name: values.copy() for name, values in table.items()}
    holes["y"][:11_000] = np.nan
    write_ply(tmp_path / "holes.ply", holes)
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "index.html").write_text("published before")
    return tmp_path


def told(folder, capsys, command, text, hint=""):
    """The error lines of a command that ends with exit code 2 and leaves the site alone.

    Its hint holds `hint`.
    """
    (folder / "tour.toml").write_text(text, encoding="utf-8")
    assert main([command, str(folder)]) == 2
    assert [path.name for path in (folder / "site").iterdir()] == ["index.html"]
    assert (folder / "site" / "index.html").read_text() == "published before"
    output = capsys.readouterr()
    assert "Traceback" not in output.err + output.out
    assert hint in "\n".join(line for line in output.err.splitlines() if line.startswith("hint: "))
    return [line for line in output.err.splitlines() if line.startswith("error: ")]


@pytest.mark.parametrize("command", ["check", "build"])
@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            KITCHEN.format(scan="gone.ply"),
            "tour.toml: room `kitchen`: scans 1: file: expected a file, found none at `gone.ply`",
        ),
        (
            KITCHEN.format(scan="empty.ply"),
            "tour.toml: room `kitchen`: scans 1: file: expected a file with contents, "
            "found `empty.ply` empty",
        ),
        (
            KITCHEN.format(scan="few.ply"),
            "room `kitchen`: scan `few.ply`: expected at least 10000 points, found 50",
        ),
        (
            KITCHEN.format(scan="cut.ply"),
            "room `kitchen`: scan `cut.ply`: expected 12000 points, found 11933",
        ),
        (
            KITCHEN.format(scan="good.ply") + LINK.format(to="hal"),
            "tour.toml: room `kitchen`: link 1: to: room `hal` does not exist",
        ),
        (
            KITCHEN.format(scan="good.ply") + LINK.format(to="kitchen"),
            "tour.toml: room `kitchen`: link 1: to: expected another room, "
            "found a link of `kitchen` to itself",
        ),
        (
            GOOD,
            "tour.toml: room `hall`: id: expected a name of its own, found a second room `hall`",
        ),
        (
            KITCHEN.format(scan="good.ply") + "surface = { detial_mm = 4 }\n",
            "tour.toml: room `kitchen`: surface.detial_mm: unknown key, "
            "expected one of agree_deg, crease_deg, depth, detail_mm, filter_deg, full_depth, "
            "linear_fit, method, neighbours, offset_mm, point_weight, radii_mm, reach, "
            "samples_per_node",
        ),
        (
            KITCHEN.format(scan="good.ply") + 'title = { it = "Cucina" }\n',
            "tour.toml: room `kitchen`: title: language `it` is not declared, expected en",
        ),
    ],
    ids=[
        "missing",
        "empty",
        "50 points",
        "truncated",
        "link to nowhere",
        "link to itself",
        "two of one name",
        "unknown key",
        "undeclared language",
    ],
)
def test_bad_input_is_one_line_and_leaves_the_site(folder, capsys, command, text, said):
    assert told(folder, capsys, command, HEAD + GOOD + text) == [f"error: {said}"]


@pytest.mark.parametrize(
    ("scan", "said"),
    [
        ("text.ply", "scan `text.ply`: expected 12000 points, found 11"),
        (
            "holes.ply",
            "scan `holes.ply`: expected at least 10000 points, "
            "found 1000, 11000 invalid ones dropped",
        ),
    ],
)
def test_what_only_reading_finds_is_bad_input_too(folder, capsys, scan, said):
    (line,) = told(folder, capsys, "build", HEAD + KITCHEN.format(scan=scan))
    assert line.startswith(f"error: room `kitchen`: {said}")


N = 12_000


U, V = np.random.default_rng(0).uniform(-2, 2, (2, N))
FLOOR = np.stack([U, V, 0 * U], axis=1)


@pytest.mark.parametrize(
    ("points", "found"),
    [
        (FLOOR, "expected the points of a room, found them all on one plane"),
        (
            np.stack([U, V, 0.3 * U - 0.2 * V], axis=1)
            + np.random.default_rng(1).normal(0, 0.001, (N, 3)),
            "expected the points of a room, found them all on one plane",
        ),
        (
            np.outer(U, (1, 0.3, -0.2)),
            "expected the points of a room, found them all on one line",
        ),
        (np.ones((N, 3)), "expected a room, found all points in one spot"),
        (2000 + FLOOR / 1000, "expected a room, found it 3.92 mm wide"),
    ],
    ids=["a floor", "a noisy slope", "a line", "a spot", "hardly more than a spot"],
)
def test_points_that_enclose_no_space_are_refused(folder, capsys, points, found):
    write_ply(folder / "flat.ply", cloud_table(points))
    text = HEAD + KITCHEN.format(scan="flat.ply")
    assert told(folder, capsys, "build", text) == [
        f"error: room `kitchen`: scan `flat.ply`: {found}"
    ]


def test_a_crop_down_to_the_floor_is_refused_with_its_key(folder, capsys):
    wall = np.stack([U, 0 * U + 2, 1 + abs(V)], axis=1)
    write_ply(folder / "room.ply", cloud_table(np.concatenate([FLOOR, wall])))
    text = HEAD + KITCHEN.format(scan="room.ply") + "keep = {min = [-2, -2, 0], max = [2, 2, 0.2]}"
    (line,) = told(folder, capsys, "build", text, hint="check the export, `keep` and `remove`")
    assert line.endswith("found them all on one plane")


@pytest.mark.parametrize(
    ("unit", "scale", "found", "hint"),
    [
        ("m", 1500, "at most 1000 m, found it 5886 m wide", 'write `unit = "mm"`: 5.89 m wide'),
        ("ft", 1500 / 0.3048, "at most 1000 m, found it 5886 m wide", 'write `unit = "mm"`'),
        ("m", 1e6, "at most 1000 m, found it 3923994 m wide", "keep a part of it, by `keep`"),
        ("mm", 1, "expected a room, found it 3.92 mm wide", 'write `unit = "m"`: 3.92 m wide'),
        ("cm", 1, "expected a room, found it 39.2 mm wide", 'write `unit = "m"`: 3.92 m wide'),
    ],
)
def test_a_room_of_an_odd_size_is_told_the_unit_that_it_may_be_in(
    folder, capsys, unit, scale, found, hint
):
    points = scale * np.random.default_rng(0).uniform(-2, 2, (N, 3))
    write_ply(folder / "odd.ply", cloud_table(points))
    text = HEAD + KITCHEN.format(scan="odd.ply") + f'unit = "{unit}"\n'
    (line,) = told(folder, capsys, "build", text, hint)
    assert line.startswith("error: room `kitchen`: scan `odd.ply`: ")
    assert line.endswith(found)


@pytest.mark.parametrize(
    ("box", "hint"),
    [
        ("keep = {min = [10, 10, 10], max = [11, 11, 11]}", "[-2.00, -2.00, -2.00] to [2.00, 2.00"),
        ("remove = [{min = [-3, -3, -3], max = [3, 3, 3]}]", "check `keep`, `remove`, `unit`"),
    ],
)
def test_a_box_that_leaves_nothing_is_told_with_where_the_points_are(folder, capsys, box, hint):
    (line,) = told(folder, capsys, "build", HEAD + KITCHEN.format(scan="good.ply") + box, hint)
    assert line == (
        "error: room `kitchen`: scan `good.ply`: expected at least 10000 points, "
        "found 0, 12000 cropped away"
    )


MOVED = "[[1, 0, 0, {x}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"


@pytest.mark.parametrize(
    ("scans", "found"),
    [
        (
            ["", f", pose = {MOVED.format(x=9)}"],
            "scans `good.ply` and `good.ply`: expected them to meet, found them 5 m apart",
        ),
        (
            ["", f", pose = {MOVED.format(x=9)}", f", pose = {MOVED.format(x=-4)}"],
            "scans `good.ply` and `good.ply`: expected them to meet, found them 5 m apart",
        ),
        (
            [
                ", station = [0, 0, 1]",
                f", station = [0, 0, 1], pose = {MOVED.format(x=4.5)}",
            ],
            "stations 1 at [0.0, 0.0, 1.0] and 2 at [4.5, 0.0, 1.0]: expected an overlap of 10% "
            "or more, found 0%",
        ),
    ],
    ids=["poses apart", "one of three apart", "stations side by side"],
)
def test_scans_that_do_not_meet_are_refused(folder, capsys, scans, found):
    files = ", ".join(f'{{ file = "good.ply"{rest} }}' for rest in scans)
    text = HEAD + f'[[room]]\nid = "kitchen"\nscans = [{files}]\n'
    assert told(folder, capsys, "build", text, hint="check their `pose`") == [
        f"error: room `kitchen`: {found}"
    ]


def test_faults_of_the_tour_file_do_not_hide_those_of_the_scans(folder):
    text = KITCHEN.format(scan="few.ply") + "unti = 'm'\n" + GOOD + LINK.format(to="atelier")
    (folder / "tour.toml").write_text(HEAD + text)
    with pytest.raises(Faults) as caught:
        check_tour(folder)
    assert [fault.message for fault in caught.value.faults] == [
        "tour.toml: room `kitchen`: unti: unknown key, expected one of captured, clean, closed, "
        "id, keep, link, mesh, note, place, remove, scans, start, stations, surface, text, "
        "texture, title, unit, up",
        "tour.toml: room `hall`: link 1: to: room `atelier` does not exist",
        "room `kitchen`: scan `few.ply`: expected at least 10000 points, found 50",
    ]


def test_a_scan_without_color_is_a_warning(folder, capsys):
    (folder / "tour.toml").write_text(HEAD + KITCHEN.format(scan="grey.ply"))
    assert main(["check", str(folder)]) == 0
    assert (
        "warning: room `kitchen`: scan `grey.ply`: has no colours, its points are grey"
        in capsys.readouterr().out.splitlines()
    )
