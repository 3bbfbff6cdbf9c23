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


def told(folder, capsys, command, text):
    """The error lines of a command that ends with exit code 2 and leaves the site alone."""
    (folder / "tour.toml").write_text(text, encoding="utf-8")
    assert main([command, str(folder)]) == 2
    assert [path.name for path in (folder / "site").iterdir()] == ["index.html"]
    assert (folder / "site" / "index.html").read_text() == "published before"
    output = capsys.readouterr()
    assert "Traceback" not in output.err + output.out
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


def test_faults_of_the_tour_file_do_not_hide_those_of_the_scans(folder):
    text = KITCHEN.format(scan="few.ply") + "unti = 'm'\n" + GOOD + LINK.format(to="atelier")
    (folder / "tour.toml").write_text(HEAD + text)
    with pytest.raises(Faults) as caught:
        check_tour(folder)
    assert [fault.message for fault in caught.value.faults] == [
        "tour.toml: room `kitchen`: unti: unknown key, expected one of clean, closed, id, keep, "
        "link, mesh, note, remove, scans, start, stations, surface, text, texture, title, unit, up",
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
