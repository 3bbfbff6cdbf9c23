"""tour.toml: what it gives, and every fault told at once, in the order of the file."""

from pathlib import Path

import numpy as np
import pytest
from scan_files import cloud_table, write_ply

from tourgen.cli import main
from tourgen.errors import Faults, InputError
from tourgen.reference import reference, starter
from tourgen.tour import Room, check_scans, load_tour, open_scans

PAGE = Path(__file__).resolve().parents[2] / "docs" / "tour-file.md"

TWO_ROOMS = """
[tour]
title = { en = "Lighthouse", fr = "Phare" }
languages = ["en", "fr"]
start = "hall"

[[room]]
id = "kitchen"
scans = ["scans/a.ply"]
[[room.link]]
to = "hall"
at = [1, 0, 1.4]

[[room]]
id = "hall"
title = { fr = "Salle" }
scans = [{ file = "scans/a.ply", station = [0, 0, 1.5] }]
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with a scan, a text and a picture."""
    for name in ("scans", "texts", "images"):
        (tmp_path / name).mkdir()
    points = np.random.default_rng(0).uniform(-2, 2, (200, 3))
    write_ply(tmp_path / "scans" / "a.ply", cloud_table(points, np.zeros((200, 3), np.uint8)))
    (tmp_path / "texts" / "a.en.md").write_text("Hello")
    (tmp_path / "images" / "bed.jpg").write_bytes(b"\xff\xd8")
    return tmp_path


def load(folder, text):
    (folder / "tour.toml").write_text(text, encoding="utf-8")
    return load_tour(folder)


def faults(folder, text):
    """The faults of a tour file, each with its hint."""
    with pytest.raises(Faults) as caught:
        load(folder, text)
    for fault in caught.value.faults:
        assert fault.message.startswith("tour.toml: ")
        assert "\n" not in fault.message + fault.hint
        assert not fault.message.endswith(".")
    assert caught.value.exit_code == 2
    return [
        (fault.message.removeprefix("tour.toml: "), fault.hint) for fault in caught.value.faults
    ]


def room_faults(folder, lines, before=""):
    """The faults of one room with these lines."""
    return faults(
        folder,
        f'[tour]\ntitle = "T"\n{before}\n'
        f'[[room]]\nid = "kitchen"\nscans = ["scans/a.ply"]\n{lines}\n',
    )


# ------------------------------------------------------------------ what is read


def test_a_tour_of_a_few_lines_has_all_the_rest_by_default(folder):
    tour = load(folder, '[tour]\ntitle = "T"\n[[room]]\nid = "kitchen"\nscans = ["scans/a.ply"]\n')
    (room,) = tour.rooms
    assert tour.folder == folder
    assert (tour.start, tour.languages, tour.title) == ("kitchen", ("en",), {"en": "T"})
    assert (room.title, room.stations, room.unit_m, room.up) == ({"en": "kitchen"}, "auto", 1, "z")
    assert (room.clean.min_points, room.texture.texel_mm) == (10_000, 4)
    assert (room.surface.detail_mm, room.clean.thin_mm) == (None, None)


def test_texts_come_in_every_language(folder):
    tour = load(folder, TWO_ROOMS)
    kitchen, hall = tour.rooms
    assert tour.title == {"en": "Lighthouse", "fr": "Phare"}
    assert kitchen.title == {"en": "kitchen", "fr": "kitchen"}
    assert hall.title == {"en": "Salle", "fr": "Salle"}
    assert kitchen.links[0].title == hall.title
    assert tour.start == "hall"
    assert tour.room("hall") is hall


def test_text_files_are_named_by_language(folder):
    (folder / "texts" / "a.fr.md").write_text("Bonjour")
    text = TWO_ROOMS.replace('id = "kitchen"', 'id = "kitchen"\ntext = "texts/a.{lang}.md"')
    assert load(folder, text).rooms[0].text == {"en": "texts/a.en.md", "fr": "texts/a.fr.md"}


def test_everything_that_may_be_said_is_read(folder):
    pose = "[[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]"
    room = load(
        folder,
        f"""
        [tour]
        title = "T"
        [[room]]
        id = "kitchen"
        title = "Kitchen"
        scans = [{{ file = "scans/a.ply", pose = {pose}, station = [0, 0, 1] }}]
        stations = [[0, 0, 1.5], [1, 2, 1.5]]
        unit = "mm"
        up = "-y"
        keep = {{ min = [-3, -3, 0], max = [3, 3, 3] }}
        remove = [{{ min = [0, 0, 0], max = [1, 1, 1] }}]
        closed = [{{ min = [0, 0, 0], max = [1, 1, 1] }}]
        text = "texts/a.en.md"
        start = {{ position = [0, 0, 1.6], look_at = [1, 0, 1.6] }}
        clean = {{ min_points = 100, thin_mm = 5 }}
        surface = {{ method = "poisson", detail_mm = 8.5, depth = 9 }}
        texture = {{ texel_mm = 2, quality = 90 }}
        [[room.note]]
        at = [1, 2, 1]
        title = "Bed"
        text = "A bed"
        image = "images/bed.jpg"
        """,
    ).rooms[0]
    assert room.unit_m == 0.001
    assert room.stations == ((0, 0, 1.5), (1, 2, 1.5))
    assert room.keep.max == (3, 3, 3)
    assert room.remove == room.closed
    assert room.surface.detail_mm == 8.5
    assert room.notes[0].text == {"en": "A bed"}
    (scan,) = open_scans(room, folder)
    assert scan.stations.tolist() == [[1, 2, 4]]


def test_line_ends_and_byte_order_marks_of_windows_are_read(folder):
    text = "\ufeff" + TWO_ROOMS.replace("\n", "\r\n")
    (folder / "tour.toml").write_bytes(text.encode())
    assert len(load_tour(folder).rooms) == 2


# ------------------------------------------------------------------ faults


def test_all_faults_are_told_at_once_in_the_order_of_the_file(folder):
    (folder / "scans" / "empty.ply").touch()
    told = faults(
        folder,
        """
        [tour]
        title = { en = "T", de = "T" }
        languages = ["en", "fr"]
        start = "kitchn"
        [[room]]
        id = "kitchen"
        scans = ["scans/b.ply", "scans/empty.ply"]
        text = "texts/a.{lang}.md"
        keep = { min = [0, 0, 0], max = [1, -1, 1] }
        [room.surface]
        detial_mm = 4
        [[room.link]]
        to = "kitchen"
        at = [1, 2]
        [[room.link]]
        to = "hal"
        at = [1, 2, 3]
        [[room]]
        id = "hall"
        scans = []
        [[room]]
        id = "kitchen"
        scans = ["scans/a.ply"]
        [[room.note]]
        at = [0, 0, 0]
        title = "N"
        image = "images/bad.jpg"
        """,
    )
    kitchen = "room `kitchen`: "
    assert told == [
        (
            "tour.title: language `de` is not declared, expected one of en, fr",
            'add it to `tour.languages`: "de"',
        ),
        ("tour.start: room `kitchn` does not exist", "did you mean `kitchen`?"),
        (
            kitchen + "scans 1: file: expected a file, found none at `scans/b.ply`",
            "did you mean `scans/a.ply`?",
        ),
        (
            kitchen + "scans 2: file: expected a file with contents, found `scans/empty.ply` empty",
            "export it again",
        ),
        (
            kitchen + "text: expected a file, found none at `texts/a.fr.md`",
            "did you mean `texts/a.en.md`?",
        ),
        (kitchen + "keep: expected min below max along y, found 0 and -1", "swap them"),
        (
            kitchen
            + "surface.detial_mm: unknown key, expected one of agree_deg, crease_deg, depth, "
            "detail_mm, filter_deg, full_depth, linear_fit, method, neighbours, offset_mm, "
            "point_weight, radii_mm, reach, samples_per_node",
            "did you mean `detail_mm`?",
        ),
        (
            kitchen + "link 1: to: expected another room, found a link of `kitchen` to itself",
            "",
        ),
        (kitchen + "link 1: at: expected three numbers [x, y, z], found [1, 2]", ""),
        (kitchen + "link 2: to: room `hal` does not exist", "did you mean `hall`?"),
        ("room `hall`: scans: expected at least one, found []", ""),
        (kitchen + "id: expected a name of its own, found a second room `kitchen`", ""),
        (
            kitchen + "note 1: image: expected a file, found none at `images/bad.jpg`",
            "did you mean `images/bed.jpg`?",
        ),
    ]


@pytest.mark.parametrize(
    ("lines", "said", "hint"),
    [
        ("detail_mm = 4", "detail_mm: unknown key", "did you mean `surface.detail_mm`?"),
        ("zzzzzz = 4", "zzzzzz: unknown key", ""),
        ('unit = "inch"', 'unit: expected one of m, cm, mm, ft, found "inch"', ""),
        ('unit = "km"', 'unit: expected one of m, cm, mm, ft, found "km"', ""),
        ('unit = "MM"', 'unit: expected one of m, cm, mm, ft, found "MM"', "mean `mm`?"),
        ('unit = "feet"', "unit: expected one of", "did you mean `ft`?"),
        ('unit = "metres"', "unit: expected one of", "did you mean `m`?"),
        ('unit = "Millimeter"', "unit: expected one of", "did you mean `mm`?"),
        ('unit = "centimetres"', "unit: expected one of", "did you mean `cm`?"),
        ('up = "Z"', 'up: expected one of z, -z, y, -y, x, -x, found "Z"', "did you mean `z`?"),
        ('up = "+y"', "up: expected one of", "did you mean `y`?"),
        ('up = "-Y"', "up: expected one of", "did you mean `-y`?"),
        ('up = "z-up"', "up: expected one of", "did you mean `z`?"),
        ('up = "north"', "up: expected one of", ""),
        ("unit = 1", "unit: expected one of m, cm, mm, ft, found 1", ""),
        ('stations = "atuo"', 'expected "auto" or a list of positions', ""),
        ("stations = []", 'expected "auto" or a list of positions', ""),
        ("stations = [[0, 0]]", "stations: expected three numbers [x, y, z], found [0, 0]", ""),
        ("keep = { min = [0, 0, 0] }", "keep.max: expected this key, found none", ""),
        ("keep = { min = [0, 1, 0], max = [1, 1, 1] }", "keep: expected min below max along y", ""),
        ("keep = [0, 0, 0]", "keep: expected a table, found [0, 0, 0]", ""),
        ('keep = { min = ["a", 0, 0], max = [1, 1, 1] }', "keep.min: expected three", ""),
        ("keep = { min = [nan, 0, 0], max = [1, 1, 1] }", "keep.min: expected three", ""),
        ("keep = { min = [true, 0, 0], max = [1, 1, 1] }", "keep.min: expected three", ""),
        ("remove = { min = [0, 0, 0], max = [1, 1, 1] }", "remove: expected a list, found", ""),
        ("clean = { min_points = 1.5 }", "clean.min_points: expected a whole number", ""),
        ("clean = { min_points = true }", "expected a whole number, found true", ""),
        ("clean = { min_points = 5 }", "clean.min_points: expected at least 100, found 5", ""),
        (
            "surface = { depth = 9 }",
            'surface.depth: expected this key with method "poisson", found method "auto"',
            'set `method = "poisson"`',
        ),
        (
            'surface = { method = "crust", reach = 2 }',
            'reach: expected this key with method "auto" or "signed-distance", found',
            "leave it out",
        ),
        ("surface = { solver_divide = 8 }", "solver_divide: unknown key", "older, unscreened"),
        ('surface = { detail_mm = "4" }', 'detail_mm: expected a number, found "4"', ""),
        ("surface = { detail_mm = inf }", "surface.detail_mm: expected a finite number", ""),
        (
            'surface = { method = "poison" }',
            "method: expected one of auto, poisson",
            "mean `poisson`?",
        ),
        ("title = 3", "title: expected a text or a table of texts by language, found 3", ""),
        ("title = {}", "title: expected a text or a table of texts by language", ""),
        ('title = { en = " " }', 'title: expected a text in language `en`, found " "', ""),
        ('title = { fr = "T" }', "language `fr` is not declared, expected en", "languages"),
        (
            "start = { position = [0, 0, 0], look_at = [0, 0, 0] }",
            "start: expected `look_at` away from `position`",
            "",
        ),
        ("[[room.note]]\ntitle = 'N'", "note 1: at: expected this key, found none", ""),
        (
            "[[room.note]]\nat = [0, 0, 1]\ntitle = 'N'\nsound = 'scans/a.ply'",
            "note 1: sound: expected a file that ends in .mp3, .m4a, .ogg, .wav, found",
            "",
        ),
        (
            "[[room.note]]\nat = [0, 0, 1]\ntitle = 'N'\ncaptions = 'scans/a.ply'",
            "note 1: captions: expected a `sound` that they belong to, found none",
            "",
        ),
        ("captured = '2026-05-12'", "captured: expected a date such as 2026-05-12", "quotes"),
        ("captured = 10:30:00", "captured: expected a date such as 2026-05-12", ""),
        ("place = { turn_deg = 90 }", "place.at: expected this key, found none", ""),
        ("place = { at = [0, 0, 0], turn_deg = 999 }", "turn_deg: expected -360 to 360", ""),
        ("[room.link]\nto = 'x'", "link: expected a list, found a table", "[[link]]"),
    ],
)
def test_a_wrong_value_is_told_with_its_key(folder, lines, said, hint):
    ((message, found_hint),) = room_faults(folder, lines)
    assert message.startswith("room `kitchen`: ")
    assert said in message
    assert hint in found_hint


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ('address = "example.org"', "tour.address: expected an address of a folder"),
        ('address = "https://a.org/?x=1"', "tour.address: expected an address of a folder"),
        ("north_deg = 400", "tour.north_deg: expected -360 to 360, found 400"),
        ('credits = "nobody.md"', "tour.credits: expected a file, found none at `nobody.md`"),
    ],
)
def test_what_is_wrong_with_the_tour_as_a_whole_is_told(folder, lines, said):
    with pytest.raises(Faults) as caught:
        load(folder, TWO_ROOMS.replace("[tour]", f"[tour]\n{lines}", 1))
    assert said in caught.value.faults[0].message


def test_a_stop_must_be_in_a_room_of_the_tour(folder):
    stop = '[[stop]]\nroom = "kitchn"\nposition = [0, 0, 1.6]\nlook_at = [1, 0, 1.6]\n'
    with pytest.raises(Faults) as caught:
        load(folder, TWO_ROOMS + stop)
    (fault,) = caught.value.faults
    assert "stop 1: room: room `kitchn` does not exist" in fault.message
    assert fault.hint == "did you mean `kitchen`?"
    tour = load(folder, TWO_ROOMS + stop.replace("kitchn", "kitchen"))
    assert tour.stops[0].look_at == (1, 0, 1.6)


@pytest.mark.parametrize(
    ("method", "value", "said"),
    [
        ("poisson", "depth = 4", "depth: expected 5 to 12, found 4"),
        ("poisson", "depth = 99", "depth: expected 5 to 12, found 99"),
        ("poisson", "depth = 8.5", "depth: expected a whole number, found 8.5"),
        ("poisson", "full_depth = 0", "full_depth: expected 1 to 8, found 0"),
        ("poisson", "full_depth = 9", "full_depth: expected 1 to 8, found 9"),
        (
            "poisson",
            "depth = 6, full_depth = 7",
            "full_depth: expected at most `depth`, 6, found 7",
        ),
        ("poisson", "samples_per_node = 0", "samples_per_node: expected 0.5 to 20, found 0"),
        ("poisson", "samples_per_node = 99", "samples_per_node: expected 0.5 to 20, found 99"),
        ("poisson", "point_weight = -1", "point_weight: expected 0 to 100, found -1"),
        ("poisson", "point_weight = nan", "point_weight: expected a finite number, found nan"),
        ("poisson", "linear_fit = 1", "linear_fit: expected true or false, found 1"),
        ("ball-pivoting", "radii_mm = []", "radii_mm: expected 1 to 8 of them, found []"),
        (
            "ball-pivoting",
            "radii_mm = [1, 2, 3, 4, 5, 6, 7, 8, 9]",
            "radii_mm: expected 1 to 8 of them, found [1, 2, 3, 4, 5, 6, 7, 8, 9]",
        ),
        ("ball-pivoting", "radii_mm = 10", "radii_mm: expected a list, found 10"),
        ("ball-pivoting", "radii_mm = [5, -5]", "radii_mm 2: expected 0.1 to 1000, found -5"),
        ("ball-pivoting", "radii_mm = [2000]", "radii_mm 1: expected 0.1 to 1000, found 2000"),
        (
            "ball-pivoting",
            "radii_mm = [10, 10]",
            "radii_mm: expected each larger than the one before, found [10, 10]",
        ),
        ("ball-pivoting", "agree_deg = 9", "agree_deg: expected 10 to 90, found 9"),
        ("auto", "neighbours = 2", "neighbours: expected 4 to 64, found 2"),
        ("signed-distance", "crease_deg = 90", "crease_deg: expected 3 to 45, found 90"),
        ("auto", "reach = 0", "reach: expected 0.5 to 5, found 0"),
        ("crust", "filter_deg = 120", "filter_deg: expected 10 to 90, found 120"),
        ("auto", "detail_mm = 0.5", "detail_mm: expected 1 to 500, found 0.5"),
        ("crust", "offset_mm = 101", "offset_mm: expected -100 to 100, found 101"),
    ],
)
def test_a_setting_of_the_surface_that_cannot_be_is_told_with_its_range(
    folder, method, value, said
):
    ((message, _),) = room_faults(folder, f'surface = {{ method = "{method}", {value} }}')
    assert message == f"room `kitchen`: surface.{said}"


@pytest.mark.parametrize(
    "pose",
    [
        "[1, 2]",
        "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]",
        "[[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]",
        "[[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]",
        "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 2, 3, 1]]",
    ],
)
def test_a_pose_must_be_a_rotation_and_a_shift(folder, pose):
    text = TWO_ROOMS.replace("station =", f"pose = {pose}, station =")
    ((message, _),) = faults(folder, text)
    assert message.startswith("room `hall`: scans 1: pose: expected ")


@pytest.mark.parametrize("room_id", ["Kitchen", "a/b", "..", "", "con", "été", "a b", "x" * 65])
def test_a_room_id_must_serve_as_folder_and_address(folder, room_id):
    text = f'[tour]\ntitle = "T"\n[[room]]\nid = "{room_id}"\nscans = ["scans/a.ply"]\n'
    ((message, hint),) = faults(folder, text)
    assert "id: expected a name of a folder and an address" in message
    advised = hint.split("`")[1]
    assert load(folder, text.replace(f'"{room_id}"', f'"{advised}"')).rooms[0].id == advised


def test_a_room_without_an_id_is_told_by_its_number(folder):
    told = faults(folder, '[tour]\ntitle = "T"\n[[room]]\nscans = ["scans/a.ply"]\n')
    assert told == [("room 1: id: expected this key, found none", "write `id = …`")]


def test_languages_must_be_codes_each_once(folder):
    ((said, _),) = room_faults(folder, "", 'languages = ["english"]')
    assert said.startswith("tour.languages: expected language codes")
    ((said, _),) = room_faults(folder, "", 'languages = ["en", "en"]')
    assert said.startswith("tour.languages: expected each language once")
    ((said, _), *_) = room_faults(folder, "", 'languages = "en"')
    assert said == 'tour.languages: expected a list, found "en"'


def test_what_is_no_toml_is_told_with_its_line(folder):
    ((said, hint),) = faults(folder, '[tour]\ntitle = "T\n')
    assert said.startswith("line 2, column 11: expected TOML, found: ")
    assert "straight quotes" in hint
    ((said, _),) = faults(folder, '[tour]\ntitle = "T"\ntitle = "U"\n')
    assert said.startswith("line 3, column 12: expected TOML, found: cannot overwrite a value")
    ((said, _),) = faults(folder, "x = [1,")
    assert said.startswith("end of the file: expected TOML")


def test_a_file_that_is_no_utf_8_is_told(folder):
    (folder / "tour.toml").write_bytes('[tour]\ntitle = "\xe9"\n'.encode("latin-1"))
    with pytest.raises(Faults, match="expected UTF-8, found byte 0xe9 at position 16"):
        load_tour(folder)


def test_a_missing_tour_file_and_an_empty_one_are_told(folder):
    with pytest.raises(Faults, match=r"tour.toml: expected a file in .*, found none"):
        load_tour(folder)
    assert faults(folder, "") == [
        ("tour: expected this key, found none", "write `[tour]`, and its keys below"),
        ("room: expected this key, found none", "write `[[room]]`, and its keys below"),
    ]


def test_a_room_that_is_not_there_is_told_with_the_near_one(folder):
    with pytest.raises(InputError, match="room `hal` does not exist") as caught:
        load(folder, TWO_ROOMS).room("hal")
    assert caught.value.hint == "did you mean `hall`?"


# ------------------------------------------------------------------ scans


def test_scans_are_checked_by_their_headers_all_at_once(folder):
    scans = folder / "scans"
    write_ply(scans / "few.ply", cloud_table(np.ones((50, 3))))
    write_ply(scans / "cut.ply", cloud_table(np.ones((50, 3), np.float32)))
    (scans / "cut.ply").write_bytes((scans / "cut.ply").read_bytes()[:-12])
    (scans / "no.e57").write_bytes(b"x")
    rooms = "".join(
        f'[[room]]\nid = "{name}"\nscans = {files}\n'
        for name, files in (
            ("few", '["scans/few.ply"]'),
            ("cut", '["scans/cut.ply", "scans/no.e57"]'),
            ("both", '["scans/few.ply", "scans/a.ply"]'),
        )
    )
    with pytest.raises(Faults) as caught:
        check_scans(load(folder, f'[tour]\ntitle = "T"\n{rooms}'))
    assert [fault.message for fault in caught.value.faults] == [
        "room `few`: scan `scans/few.ply`: expected at least 10000 points, found 50",
        "room `cut`: scan `scans/cut.ply`: expected 50 points, found 49",
        "room `cut`: scan `scans/no.e57`: expected an E57 file that can be read, found: "
        "an unrecoverable inconsistent internal state was detected",
        "room `both`: scan `scans/few.ply` + `scans/a.ply`: expected at least 10000 points, "
        "found 250",
    ]


def test_a_scan_without_color_is_a_warning(folder):
    write_ply(folder / "scans" / "grey.ply", cloud_table(np.ones((150, 3))))
    text = TWO_ROOMS.replace('["scans/a.ply"]', '["scans/grey.ply"]')
    tour = load(folder, text.replace("[[room]]", "[[room]]\nclean = { min_points = 100 }"))
    assert check_scans(tour) == (
        "room `kitchen`: scan `scans/grey.ply`: has no colours, its points are grey",
    )


# ------------------------------------------------------------------ a new tour, and the page


def test_a_new_tour_loads_and_so_does_every_line_it_proposes(folder):
    (folder / "scans" / "Küche 1.PLY").write_bytes((folder / "scans" / "a.ply").read_bytes())
    (folder / "scans" / "a.e57").write_bytes(b"E57")
    text = starter(folder)
    tour = load(folder, text)
    assert [room.id for room in tour.rooms] == ["a", "kuche-1"]
    assert tour.rooms[0].scans[0].file == "scans/a.e57"  # it knows its stations
    assert tour.rooms[1].title == {"en": "Küche 1"}
    proposed = "\n".join(line.removeprefix("# ") for line in text.splitlines()[2:])
    full = load(folder, proposed)
    assert full.rooms[0].links[0].to == "kuche-1"
    assert full.rooms[0].model_copy(update={"links": ()}) == tour.rooms[0]


def test_a_new_tour_needs_scans(tmp_path):
    with pytest.raises(InputError, match=r"expected scans \(.ply, .e57\), found none"):
        starter(tmp_path)


def test_every_key_is_described_and_the_page_is_current():
    page = reference()
    assert PAGE.read_text(encoding="utf-8") == page, (
        "write it anew: python -m tourgen.reference docs/tour-file.md"
    )
    for name, info in Room.model_fields.items():
        assert info.description, name
        assert f"`{info.alias or name}`" in page


def test_what_keys_mean_is_told_by_a_command(capsys):
    assert main(["keys"]) == 0
    assert capsys.readouterr().out == reference()
