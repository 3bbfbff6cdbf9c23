"""Whatever a tour file says, it is a tour or a list of faults, each in one line."""

import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from tourgen.errors import Faults
from tourgen.tour import load_tour

LINES = """
[tour]
title = { en = "Lighthouse", fr = "Phare" }
languages = ["en", "fr"]
start = "hall"
[[room]]
id = "kitchen"
title = "Kitchen"
scans = ["a.ply", { file = "a.ply", station = [0, 0, 1.5] }]
stations = [[0, 0, 1.5]]
unit = "mm"
up = "-y"
keep = { min = [-3, -3, 0], max = [3, 3, 3] }
remove = [{ min = [0, 0, 0], max = [1, 1, 1] }]
text = "a.ply"
start = { position = [0, 0, 1.6], look_at = [1, 0, 1.6] }
[room.clean]
min_points = 100
[room.surface]
method = "poisson"
detail_mm = 8.5
[[room.link]]
to = "hall"
at = [1, 0, 1.4]
arrive = { position = [0, 0, 1.6], look_at = [1, 0, 1.6] }
[[room.note]]
at = [1, 2, 1]
title = "Bed"
image = "a.ply"
[[room]]
id = "hall"
scans = ["a.ply"]
""".strip().splitlines()

# fmt: off
VALUES = st.sampled_from([
    "0", "-1.5", "1e400", "nan", "true", '""', '"x"', '"\\n"', '"\\u0000"', '"{lang}"', '"/"',
    f'"{"x" * 300}"', "[]", "{}", "[1, 2, 3]", "[[]]", "[[1, 2, 3]]", "{ a = 1 }", "[{}]",
    "kitchen", "1979-05-27", "07:32:00", '{ en = "x" }', '{ xx = "x" }', "{ min = [0, 0, 0] }",
])
# fmt: on
KEYS = st.sampled_from(["", "id", "title", "scans", '"a b"', '"\\n"', "at", "tour", "room", "a.b"])
CHANGES = st.lists(
    st.tuples(st.integers(0, len(LINES) - 1), st.sampled_from("vkd"), VALUES, KEYS), max_size=6
)


@settings(deadline=None, max_examples=250)
@given(CHANGES)
def test_a_tour_file_changed_anywhere_is_a_tour_or_a_list_of_faults(changes):
    lines = list(LINES)
    for place, kind, value, key in changes:
        name, mark, content = lines[place].partition(" = ")
        if kind == "d":
            lines[place] = ""
        elif kind == "v" and mark:
            lines[place] = f"{name} = {value}"
        elif mark:
            lines[place] = f"{key} = {content}"
        else:
            lines[place] += f"\n{key} = {value}"
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "a.ply").write_text("ply")
        (Path(folder) / "tour.toml").write_text("\n".join(lines), encoding="utf-8")
        try:
            tour = load_tour(Path(folder))
        except Faults as told:
            faults = told.faults
        else:
            faults = ()
            assert tour.start in {room.id for room in tour.rooms}
            assert all(set(room.title) == set(tour.languages) for room in tour.rooms)
    for fault in faults:
        assert fault.message.startswith("tour.toml: ")
        assert fault.message.isprintable()
        assert fault.hint.isprintable()


def test_the_unchanged_file_has_no_fault(tmp_path):
    (tmp_path / "a.ply").write_text("ply")
    (tmp_path / "tour.toml").write_text("\n".join(LINES))
    assert [room.id for room in load_tour(tmp_path).rooms] == ["kitchen", "hall"]
