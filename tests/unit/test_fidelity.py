"""The bench tells good from bad: surfaces, planes, creases, pictures, squares, sections."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import aims
import apart
import exact
import fidelity
import numpy as np
import picture_score
import planes
import plaque
import programs
import pytest
import report
import results
import score
import seams
import sections
import surface_score
import thinned
import variants
from drawing import Camera, draw, splatted, vertex_colored
from gaps import Gaps
from rooms import BenchRoom
from true_picture import Shot

from tourgen.geometry import OrientedCloud, PointCloud
from tourgen.rays import ray_scene
from tourgen.tour import load_tour

CORNERS = np.array(
    [[x, y, z] for z in (0.0, 2.5) for y in (-2.0, 2.0) for x in (-2.0, 2.0)], np.float64
)
FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7]),
        *([0, 5, 1], [0, 4, 5], [2, 3, 7], [2, 7, 6]),
        *([0, 2, 6], [0, 6, 4], [1, 7, 3], [1, 5, 7]),
    ],
    np.int32,
)
"""A box that looks inwards."""


@pytest.fixture(scope="module", autouse=True)
def fewer_samples() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(score, "SAMPLES", 30_000)
        yield


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> score.Truth:
    import open3d as o3d

    folder = tmp_path_factory.mktemp("truth")
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(CORNERS), o3d.utility.Vector3iVector(FACES)
    )
    o3d.io.write_triangle_mesh(str(folder / "box.ply"), mesh)
    stations = [{"position": [x, 0, 1.5]} for x in (-1.5, 1.5)]
    facts = {"stations": stations, "mirror_faces": []}
    (folder / "box.json").write_text(json.dumps(facts), encoding="utf-8")
    return score.Truth(folder, "box")


def chamfered(by_m: float) -> tuple[np.ndarray, np.ndarray]:
    """The box with its twelve edges cut off at 45 degrees."""
    from scipy.spatial import ConvexHull, HalfspaceIntersection

    middle, half = np.array([0, 0, 1.25]), np.array([2.0, 2.0, 1.25])
    cuts = [np.array(n) for n in np.ndindex(3, 3, 3)]
    normals = np.array([n - 1 for n in cuts if 0 < np.abs(n - 1).sum() < 3], float)
    reach = np.abs(normals) @ half - by_m * (np.abs(normals).sum(axis=1) == 2)
    corners = HalfspaceIntersection(np.column_stack([normals, -reach]), np.zeros(3)).intersections
    hull = ConvexHull(corners)
    faces = hull.simplices.copy()
    a, b, c = (corners[faces[:, k]] for k in range(3))
    outward = (np.cross(b - a, c - a) * a).sum(axis=1) > 0
    faces[outward] = faces[outward][:, ::-1]
    return corners + middle, faces.astype(np.int32)


def test_the_truth_itself_scores_full(truth: score.Truth) -> None:
    reference = surface_score.Reference.of(truth)
    samples = surface_score.Samples.of(truth.vertices, truth.faces, truth)
    figures = surface_score.surface_figures(truth.vertices, truth.faces, samples, reference)
    assert figures["f_score_2mm"] == 1
    assert figures["normal_agreement"] == pytest.approx(1)


def test_a_shift_costs_the_score_below_it_alone(truth: score.Truth) -> None:
    grown = truth.vertices + 0.004 * np.sign(truth.vertices - [0, 0, 1.25])
    reference = surface_score.Reference.of(truth)
    samples = surface_score.Samples.of(grown, truth.faces, truth)
    figures = surface_score.surface_figures(grown, truth.faces, samples, reference)
    assert figures["f_score_2mm"] < 0.02
    assert figures["f_score_5mm"] > 0.98


def test_flat_walls_and_floor_are_measured(truth: score.Truth) -> None:
    flat = planes.Flatness(truth)
    samples = surface_score.Samples.of(truth.vertices, truth.faces, truth)
    assert flat.figures(samples)["walls_rms_mm"] == pytest.approx(0, abs=0.01)
    lifted = truth.vertices + np.array([0, 0, 0.003])
    figures = flat.figures(surface_score.Samples.of(lifted, truth.faces, truth))
    assert figures["floor_rms_mm"] == pytest.approx(3, abs=0.05)
    assert figures["walls_rms_mm"] == pytest.approx(0, abs=0.01)
    tilted = truth.vertices + truth.vertices[:, :1] * [0, 0, np.tan(np.radians(0.2))]
    figures = flat.figures(surface_score.Samples.of(tilted, truth.faces, truth))
    assert figures["floor_normals_deg"] == pytest.approx(0.2, abs=0.02)


def quads(*corners: tuple[list[float], ...]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of some."""
    faces = [[4 * k, 4 * k + b, 4 * k + b + 1] for k in range(len(corners)) for b in (1, 2)]
    return np.array(corners, np.float64).reshape(-1, 3), np.array(faces, np.int32)


def upright(low: tuple[float, float], high: tuple[float, float]) -> tuple[list[float], ...]:
    """A piece of the wall x = 2."""
    (y, z), (back, top) = low, high
    return [2.0, y, z], [2.0, back, z], [2.0, back, top], [2.0, y, top]


def level(low: float, high: float, z: float) -> tuple[list[float], ...]:
    """A piece of the floor, from wall to wall."""
    return [low, -2.0, z], [high, -2.0, z], [high, 2.0, z], [low, 2.0, z]


@pytest.fixture(scope="module")
def windowed(tmp_path_factory: pytest.TempPathFactory) -> BenchRoom:
    """The box with a window of 1 m x 1 m in the wall x = 2."""
    import open3d as o3d

    pieces = [((-2, 0), (2, 1)), ((-2, 2), (2, 2.5)), ((-2, 1), (-0.5, 2)), ((0.5, 1), (2, 2))]
    vertices, faces = score.joined(
        [(CORNERS, FACES[:-2]), quads(*[upright(low, high) for low, high in pieces])]
    )
    folder = tmp_path_factory.mktemp("windowed")
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces)
    )
    o3d.io.write_triangle_mesh(str(folder / "box.ply"), mesh)
    stations = [{"position": [x, 0, 1.0]} for x in (-0.8, 0.6)]
    window = {"kind": "window", "width": 1.0, "height": 1.0, "depth": 0.0, "center": [2, 0, 1.5]}
    window |= {"right": [0, -1, 0], "up": [0, 0, 1], "outward": [1, 0, 0]}
    facts = {"stations": stations, "mirror_faces": [], "openings": [window]}
    (folder / "box.json").write_text(json.dumps(facts), encoding="utf-8")
    return BenchRoom("box", folder / "box.e57", folder, None, ())


def test_gaps_of_the_truth_are_closed_and_its_window_is_open(windowed: BenchRoom) -> None:
    truth = windowed.truth()
    figures = Gaps.of(windowed, truth).figures(truth.vertices, truth.faces)
    assert len(figures) == 7
    assert set(figures.values()) == {1.0}


def test_a_curtain_and_a_hump_under_a_tripod_are_told(windowed: BenchRoom) -> None:
    truth = windowed.truth()
    mesh = score.joined(
        [
            (truth.vertices, truth.faces[2:]),
            quads(level(-2, 0, 0.03), level(0, 2, 0.01), upright((-0.5, 1), (0, 2))),
        ]
    )
    figures = Gaps.of(windowed, truth).figures(*mesh)
    assert figures["disc_worst_closed_share"] == 1
    assert figures["discs_true_share"] == pytest.approx(0.5, abs=0.01)
    assert figures["disc_worst_true_share"] < 0.03
    for name in ("outlook_free_share", "openings_free_share", "opening_worst_free_share"):
        assert figures[name] == pytest.approx(0.5, abs=0.03)


def test_a_disc_that_no_other_station_sees_is_told_apart(windowed: BenchRoom) -> None:
    truth = windowed.truth()
    assert not Gaps.of(windowed, truth).unseen.any()
    truth.stations = truth.stations[:1]
    alone = Gaps.of(windowed, truth)
    assert alone.unseen.mean() > 0.99
    for faces, share in ((truth.faces, 1.0), (truth.faces[2:], 0.0)):
        figures = alone.figures(truth.vertices, faces)
        assert figures["blind_closed_share"] == figures["blind_true_share"] == share


def test_creases_are_found_where_they_are(truth: score.Truth) -> None:
    creases = planes.Creases(truth)
    figures = creases.figures(truth.vertices, truth.faces)
    assert figures["creases_m"] == pytest.approx(8 * 4 + 4 * 2.5, abs=0.2)
    assert figures["crease_p90_mm"] < 0.1
    assert figures["crease_within_4mm"] == 1


def test_cut_off_edges_are_no_creases(truth: score.Truth) -> None:
    creases = planes.Creases(truth)
    near = creases.figures(*chamfered(0.003))
    far = creases.figures(*chamfered(0.020))
    assert near["crease_within_4mm"] > 0.9
    assert far["crease_within_4mm"] < 0.1


def shot(picture: np.ndarray) -> Shot:
    judged = np.ones(picture.shape[:2], np.bool_)
    judged[:, :8] = False
    return Shot(picture, judged, np.ones(picture.shape[:2]))


def test_a_gain_is_forgiven_and_noise_is_not() -> None:
    rng = np.random.default_rng(0)
    true = np.repeat(np.repeat(rng.integers(60, 180, (6, 8, 3)), 8, 0), 8, 1).astype(np.uint8)
    masked = true.copy()
    masked[:, :8] = 255
    darker = np.rint(masked * np.array([0.9, 0.95, 0.85])).astype(np.uint8)
    forgiven = picture_score.score_pictures([darker], [shot(true)])
    assert forgiven.psnr_db[0] > 50
    assert forgiven.ssim[0] > 0.99
    noisy = np.clip(true + rng.normal(0, 10, true.shape), 0, 255).astype(np.uint8)
    punished = picture_score.score_pictures([noisy], [shot(true)])
    assert punished.psnr_db[0] == pytest.approx(20 * np.log10(255 / 10), abs=0.3)


def test_a_step_between_stations_is_a_seam_where_the_surface_stands_and_nowhere_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    camera = Camera(np.array([0.0, 0.0, 1.2]), np.array([2.0, 0.0, 1.2]))
    width, height = seams.SIZE
    cast = camera.rays(seams.SIZE)
    hit = ray_scene(CORNERS, FACES).cast_rays(seams.tensor(cast))["t_hit"].numpy()
    depth_m = hit.astype(np.float64) * np.linalg.norm(cast[..., 3:], axis=2)
    true = np.full((height, width, 3), 120, np.uint8)
    seen = Shot(true, np.ones((height, width), np.bool_), depth_m)
    halves = np.where(np.arange(width) < width // 2, 1, 3)
    monkeypatch.setattr(seams, "seen_by", lambda *_: np.tile(halves, (height, 1)))

    def figures(step: int, vertices: np.ndarray) -> dict[str, float]:
        shown = true.copy()
        shown[:, width // 2 :] += np.uint8(step)
        return seams.seam_figures(None, [camera], [shown], [seen], np.ones(3), (vertices, FACES))

    assert figures(0, CORNERS)["seam_max"] == 0
    found = figures(6, CORNERS)
    assert (found["seams"], found["seam_max"], found["seam_view_max"]) == (1, 6, 6)
    assert figures(6, CORNERS * (1.003, 1, 1))["seams"] == 0  # 6 mm behind the true wall


def test_squares_are_read_in_a_true_view_and_not_in_a_blurred_one() -> None:
    from scipy.ndimage import gaussian_filter

    camera, boards = plaque.plaque_view("chamber1")
    picture = np.full((540, 960, 3), 128, np.uint8)
    for board in boards[:2]:
        rows, columns = plaque.projected(camera, board.middles)
        half = (rows[0, 0] - rows[1, 0]) / 2
        for row, column, white in zip(rows.flat, columns.flat, board.white.flat, strict=True):
            top, left = (int(np.rint(at - half)) for at in (row, column))
            bottom, right = (int(np.rint(at + half)) for at in (row, column))
            picture[top : bottom + 1, left : right + 1] = 230 if white else 30
    sharp = plaque.read_board(picture, picture, camera, boards[1])
    assert (sharp.right, sharp.contrast) == (1, 1)
    blurred = gaussian_filter(picture, (5, 5, 0))
    assert plaque.read_board(blurred, picture, camera, boards[1]).contrast < 0.2


def test_colours_are_drawn_where_they_are() -> None:
    colors = np.full((8, 3), 200, np.uint8)
    camera = Camera(np.array([0.0, 0.0, 1.2]), np.array([1.0, 0.0, 1.2]))
    drawn = draw(ray_scene(CORNERS, FACES), vertex_colored(colors, FACES), camera, (32, 18))
    assert (drawn == 200).all()
    wall = draw(
        ray_scene(CORNERS, FACES[-2:]), vertex_colored(colors, FACES[-2:]), camera, (32, 18)
    )
    assert (wall[9, 16] == 200).all()
    outside = Camera(camera.position, np.array([-1.0, 0.0, 1.2]))
    void = draw(
        ray_scene(CORNERS, FACES[-2:]), vertex_colored(colors, FACES[-2:]), outside, (32, 18)
    )
    assert (void != 200).any(axis=2).all()


def test_a_section_is_rewritten_alone(tmp_path: Path) -> None:
    file = tmp_path / "benchmarks.md"
    sections.rewrite(file, "One", "first")
    sections.rewrite(file, "Two", "second\n\n### Part\n\nmore")
    sections.rewrite(file, "One", "third")
    told = file.read_text(encoding="utf-8")
    assert told == "# Benchmarks\n\n## One\n\nthird\n\n## Two\n\nsecond\n\n### Part\n\nmore\n"


def test_points_are_dots_where_the_surface_is_drawn_and_the_nearer_hides() -> None:
    camera = Camera(np.array([-1.0, 0.5, 1.2]), np.array([2.0, -0.3, 1.0]))
    rng = np.random.default_rng(0)
    wall = np.column_stack([np.full(200_000, 2.0), rng.uniform(-2, 2, (200_000, 2)) / (1, 2)])
    wall[:, 2] += 1.25
    places = np.concatenate([wall, wall / 2 + camera.position / 2 * (1, 1, 1)]).astype(np.float32)
    hues = np.repeat(np.array([[200, 30, 30], [30, 30, 200]], np.uint8), len(wall), axis=0)
    far = splatted(places[: len(wall)], hues[: len(wall)], camera, (96, 54))
    near = splatted(places, hues, camera, (96, 54))
    shown = (far == hues[0]).all(axis=2)
    faces = np.array([[0, 1, 3], [0, 3, 2]], np.int32)
    corners = np.array([[2.0, y, z] for z in (0.25, 2.25) for y in (-2.0, 2.0)])
    paint = vertex_colored(np.tile(hues[:1], (4, 1)), faces)
    drawn = (draw(ray_scene(corners, faces), paint, camera, (96, 54)) == hues[0]).all(axis=2)
    assert (shown != drawn).mean() < 0.05
    assert 0.2 < drawn.mean() < 0.95
    assert (near[shown] == hues[-1]).all(), "halfway to the eye the same directions are covered"


def test_a_method_is_drawn_in_the_tours_cache_from_its_cleaned_points(
    box_copy: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    tour = load_tour(box_copy)
    room = tour.rooms[0].id
    file = variants.drawn(tour, room, "poisson", tmp_path)
    assert isinstance(file, Path)
    assert capfd.readouterr().out.split() == ["surface", "trim", "hygiene", "levels"]
    with np.load(file) as stored:
        assert len(stored["faces"]) > 1000
        assert str(stored["told"]) == "poisson: as asked for"
    assert variants.drawn(tour, room, "poisson", tmp_path) == file
    assert not capfd.readouterr().out


def test_what_a_method_refuses_is_told_and_no_mesh(box_copy: Path, tmp_path: Path) -> None:
    tour = load_tour(box_copy)
    room = tour.rooms[0]
    huge = room.surface.model_copy(update={"detail_mm": 500.0})
    told = variants.drawn(
        tour.model_copy(update={"rooms": (room.model_copy(update={"surface": huge}),)}),
        room.id,
        "signed-distance",
        tmp_path,
    )
    assert isinstance(told, str)
    assert "detail_mm" in told


def never_ends() -> None:
    while True:
        pass


def dies() -> None:
    os._exit(3)


def test_work_apart_that_dies_or_never_ends_is_told() -> None:
    assert apart.apart(dies) == "died (exit code 3)"
    assert apart.apart(never_ends, limit_s=1).startswith("was stopped after")
    assert apart.apart(print) == ""


def test_a_thinned_scan_has_the_points_asked_for_and_even(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(thinned, "POINTS", 2000)
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.random((100_000, 2)), np.zeros(100_000)]).astype(np.float32)
    points[:50_000] *= 0.3  # dense in a corner
    kept = points[thinned.kept(points)]
    assert 1900 <= len(kept) <= 2000
    assert (kept.max(axis=1) < 0.3).mean() == pytest.approx(0.09, abs=0.01)


def test_faces_are_turned_to_the_stations() -> None:
    flipped = FACES.copy()
    flipped[::2] = flipped[::2, ::-1]
    turned = programs.facing_stations(CORNERS, flipped, np.array([[0.0, 0.0, 1.5]]))
    normals = surface_score.face_normals(CORNERS, turned)
    assert np.allclose(normals, surface_score.face_normals(CORNERS, FACES))


PEER = "Open3D Poisson"


def result(mine: float, theirs: float) -> results.RoomResult:
    return results.RoomResult(
        "hall",
        columns={
            "published": {"f_score_5mm": mine, "psnr_db": 29.0, "walls_rms_mm": 0.5},
            "oracle": {"psnr_db": 31.5},
            "poisson": {"f_score_5mm": 0.7},
            "signed-distance": {"f_score_5mm": 0.8},
            PEER: {"f_score_5mm": theirs, "psnr_db": 20.0, "walls_rms_mm": 0.7},
        },
        settings={PEER: "depth 9, cut 5 %"},
        tries=(
            results.Try(PEER, "depth 9, cut 5 %", theirs),
            results.Try(PEER, "depth 10, cut 2 %", None, "died (exit code 1)"),
        ),
        refused={"crust": "too many points"},
        cleaning={"ply": {"stray": 0.5, "lost": 0.001}},
    )


def test_a_room_is_won_by_the_higher_score() -> None:
    assert result(0.91, 0.9).won
    assert result(0.9, 0.91).lost == [f"hall: f_score_5mm: published 0.9, {PEER} 0.91"]
    assert not result(0.9, 0.9).won


def test_aims_hold_or_fall_short() -> None:
    (line,) = [each for each in aims.aims_table([result(0.91, 0.9)]).splitlines() if "f_sc" in each]
    assert line.endswith("| ✓ 0.91 (0.9) |")
    short = aims.short_of([result(0.9, 0.91)])
    assert [each.split(": ")[1] for each in short] == ["f_score_5mm", "ply", "psnr_below_oracle_db"]
    assert "hall: psnr_below_oracle_db: 2.5, asked ≤ 2" in short


def test_the_report_shows_scores_refusals_and_pictures(tmp_path: Path) -> None:
    views = {name: np.full((54, 96, 3), 90, np.uint8) for name in ("truth", "published", PEER)}
    sheet = report.side_by_side(views, tmp_path / "pictures" / "fidelity-hall-0.webp")
    shown = dataclasses.replace(result(0.91, 0.9), sheets=(sheet,))
    report.write([shown], tmp_path / "benchmarks.md")
    told = (tmp_path / "benchmarks.md").read_text(encoding="utf-8")
    assert "| f_score_5mm | 0.9100 |  | 0.7000 | 0.8000 | 0.9000 |" in told
    assert "the best method is `signed-distance`" in told
    assert "`crust` refuses: too many points." in told
    assert "| Open3D Poisson | depth 9, cut 5 % | 0.9000 |" in told
    assert "| Open3D Poisson | depth 10, cut 2 % | died (exit code 1) |" in told
    assert "| stray | 0.5000 |" in told
    assert (tmp_path / "pictures" / "fidelity-hall-0.webp").exists()
    assert "pictures/fidelity-hall-0.webp" in told


def test_a_result_is_read_back_as_it_was_kept(tmp_path: Path) -> None:
    kept = dataclasses.replace(result(0.91, 0.9), sheets=(results.Sheet("a.webp", ("truth",)),))
    results.save(kept, tmp_path / "hall.json")
    assert results.saved(tmp_path / "hall.json") == kept


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """The command on rooms whose judgement is given; what the docs say after."""
    monkeypatch.setattr(fidelity, "demo_rooms", lambda _: [SimpleNamespace(id=r) for r in "ab"])
    docs = tmp_path / "benchmarks.md"

    def run(*options: str, score: float = 0.5) -> str:
        monkeypatch.setattr(fidelity, "_judged", lambda room, _: named(room.id, score))
        scratch = ("--scratch", str(tmp_path / "scratch"))
        asked = ["fidelity", str(tmp_path), *scratch, "--write", str(docs), *options]
        monkeypatch.setattr("sys.argv", asked)
        assert fidelity.main() == 0
        return docs.read_text(encoding="utf-8") if docs.exists() else ""

    def named(room: str, score: float) -> results.RoomResult:
        return results.RoomResult(room, columns={"auto": {"f_score_5mm": score}})

    return run


def test_a_run_of_one_room_keeps_the_others(command: Callable[..., str]) -> None:
    assert command("--room", "a").count("0.5000") == 1, "the other was never judged"
    assert command().count("0.5000") == 2
    told = command("--room", "b", score=0.75)
    assert told.count("0.5000") == 1
    assert told.count("0.7500") == 1


def test_a_run_of_some_methods_writes_nothing(
    command: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = command()
    assert command("--method", "poisson", score=0.75) == before
    assert "writes no docs: not all contestants are judged" in capsys.readouterr().out
    assert command("--room", "a").count("0.5000") == 2, "nor is it kept"


def test_exact_points_lie_on_the_truth_and_look_as_they_did(truth: score.Truth) -> None:
    rng = np.random.default_rng(0)
    count, origin = 500, np.array([0.0, 0.0, 1.0])
    floor = np.zeros((count, 3))
    floor[:, :2] = rng.uniform(-1.5, 1.5, (count, 2))
    raised = floor + np.array([0, 0, 0.004])
    raised[-1, 2] = 0.4  # on no surface
    normals = np.tile([0.0, 0.3, 1.0], (count, 1)) / np.hypot(0.3, 1)
    normals[0] *= -1
    cloud = PointCloud(
        origin,
        np.float32(raised - origin),
        np.zeros((count, 3), np.uint8),
        np.zeros(count, np.int16),
    )
    given = OrientedCloud(cloud, normals, np.zeros((1, 3)))
    found = exact.exact_points(given, (truth.vertices, truth.faces))
    places = found.cloud.points + origin
    assert np.abs(places[:-1] - floor[:-1]).max() < 1e-5
    assert np.allclose(found.normals[1:-1], [0, 0, 1], atol=1e-6)
    assert np.allclose(found.normals[0], [0, 0, -1], atol=1e-6)
    assert np.array_equal(places[-1], (cloud.points + origin)[-1])
    assert np.array_equal(found.normals[-1], normals[-1])
    assert np.abs(cloud.points + origin - raised).max() < 1e-6
