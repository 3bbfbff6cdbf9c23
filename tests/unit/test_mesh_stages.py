"""From oriented points to the finest mesh: closed where it should be, open where one looks out."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest
import trimesh

from tourgen.errors import StageError
from tourgen.geometry import Mesh, OrientedCloud, PointCloud
from tourgen.stages import hygiene, inferred, levels, measure, specks, trim
from tourgen.stages.mesh_arrays import (
    STEP_M,
    components,
    face_adjacency,
    face_areas,
    on_grid,
    weld,
)
from tourgen.stages.surface import poisson

STATION = np.array([[0.3, 0.2, 1.5]])
Box = tuple[tuple[float, ...], tuple[float, ...]]
WINDOW: Box = ((1.9, -0.5, 1.0), (2.1, 0.5, 2.0))
DOOR: Box = ((1.9, -0.7, 0.0), (2.1, 0.7, 2.3))


def room_cloud() -> OrientedCloud:
    """A 4 x 4.8 x 2.5 m room with a window in the wall x = 2 and a blind disc."""
    rng = np.random.default_rng(0)
    points, normals = [], []
    for axis, side, inward in (
        (0, -2.0, 1), (0, 2.0, -1), (1, -2.4, 1), (1, 2.4, -1), (2, 0.0, 1), (2, 2.5, -1),
    ):  # fmt: skip
        face = rng.uniform([-2, -2.4, 0], [2, 2.4, 2.5], (25_000, 3))
        face[:, axis] = side
        points.append(face)
        normal = np.zeros((25_000, 3))
        normal[:, axis] = inward
        normals.append(normal)
    at, normal = np.concatenate(points), np.concatenate(normals)
    gap = inside(at, WINDOW)
    gap |= (at[:, 2] == 0) & (np.linalg.norm(at[:, :2] - STATION[0, :2], axis=1) < 0.85)
    keep = ~gap
    cloud = PointCloud(
        np.zeros(3),
        np.float32(at[keep]),
        np.full((keep.sum(), 3), 128, np.uint8),
        np.zeros(keep.sum(), np.int16),
    )
    return OrientedCloud(cloud, np.float32(normal[keep]), STATION)


def inside(points: np.ndarray, box: Box) -> np.ndarray:
    return np.all((points >= box[0]) & (points <= box[1]), axis=1)


@pytest.fixture(scope="module")
def oriented() -> OrientedCloud:
    return room_cloud()


@pytest.fixture(scope="module")
def solved(oriented: OrientedCloud) -> Mesh:
    return poisson.poisson(oriented, poisson.Settings(cell_m=0.05))


@pytest.fixture(scope="module")
def trimmed(oriented: OrientedCloud, solved: Mesh) -> Mesh:
    return trim.trim(solved, oriented, oriented.cloud, trim.Settings(support_m=0.12))


def scene(mesh: Mesh) -> o3d.t.geometry.RaycastingScene:
    made = o3d.t.geometry.RaycastingScene()
    made.add_triangles(mesh.vertices, mesh.faces.astype(np.uint32))
    return made


def covered(mesh: Mesh, start: list[float], toward: list[float]) -> bool:
    """Whether a ray meets the mesh within a metre of where the wall should be."""
    way = np.subtract(toward, start)
    length = float(np.linalg.norm(way))
    ray = np.float32([[*start, *(way / length)]])
    return float(scene(mesh).cast_rays(ray)["t_hit"].numpy()[0]) < length + 1


# ------------------------------------------------------------------ poisson


def test_the_surface_lies_on_the_walls_and_looks_inward(solved: Mesh) -> None:
    shape = trimesh.Trimesh(solved.vertices, solved.faces, process=False)
    assert shape.is_watertight
    assert shape.volume == pytest.approx(-4 * 4.8 * 2.5, rel=0.02), "seen from within"


@pytest.mark.parametrize(("cell_m", "depth"), [(0.05, 7), (0.025, 8), (10.0, 6), (1e-4, 12)])
def test_the_depth_follows_the_room_and_the_cell(cell_m: float, depth: int) -> None:
    assert poisson.octree_depth(np.array([[0, 0, 0], [4, 4, 2.5]]), cell_m) == depth


# ------------------------------------------------------------------ trim


def test_windows_open_and_blind_discs_stay_closed(solved: Mesh, trimmed: Mesh) -> None:
    eye = [0.0, 0.0, 1.5]
    assert covered(solved, eye, [2, 0, 1.5])
    assert not covered(trimmed, eye, [2, 0, 1.5]), "the window"
    assert covered(trimmed, [0.3, 0.2, 1.5], [0.3, 0.2, 0.0]), "the floor under the tripod"
    assert covered(trimmed, eye, [-2, 0, 1.5]), "a wall"
    lost = face_areas(solved).sum() - face_areas(trimmed).sum()
    assert lost == pytest.approx(1.0, abs=0.35), "as much as the window, and nothing else"


def domed_room(opening: Box, station: list[float]) -> tuple[OrientedCloud, Mesh]:
    """The room with another opening in the wall x = 2: its scan, and a dome outside closes it."""
    shell = trimesh.creation.box((4, 4.8, 2.5)).apply_translation([0, 0, 1.25])
    points, face = trimesh.sample.sample_surface(shell, 150_000, seed=1)
    gap = inside(points, opening)
    gap |= (points[:, 2] < 1e-6) & (np.linalg.norm(points[:, :2] - station[:2], axis=1) < 0.85)
    at, normals = np.float32(points[~gap]), np.float32(-shell.face_normals[face[~gap]])
    color, own = np.zeros((len(at), 3), np.uint8), np.zeros(len(at), np.int16)
    cloud = OrientedCloud(PointCloud(np.zeros(3), at, color, own), normals, np.array([station]))
    shell.invert()
    for _ in range(6):
        shell = shell.subdivide()
    vertices = np.float32(shell.vertices)
    closing = inside(vertices, opening)
    half = np.subtract(opening[1], opening[0])[1:] / 2
    from_middle = np.abs(vertices[closing, 1:] - np.add(opening[0], opening[1])[1:] / 2) / half
    vertices[closing, 0] += 0.3 * np.cos(np.pi / 2 * from_middle.max(axis=1))
    return cloud, Mesh(np.zeros(3), vertices, shell.faces.astype(np.int32))


def test_an_opening_seen_aslant_opens_as_far_as_its_rim() -> None:
    """Most of the dome that closes it hides behind the wall."""
    cloud, domed = domed_room(WINDOW, [1.6, -2.0, 1.5])
    opened = trim.trim(domed, cloud, cloud.cloud, trim.Settings(support_m=0.12))
    for y in (-0.35, -0.2, 0.0, 0.2, 0.35):
        assert not covered(opened, [0, y, 1.5], [2, y, 1.5]), f"the window at y = {y}"
    lost = face_areas(domed).sum() - face_areas(opened).sum()
    assert lost < 1.5, "the dome, and nothing else"


def test_a_blind_disc_in_a_doorway_stays_where_the_doorway_opens() -> None:
    """No point lies between what closes the door and the floor under the tripod."""
    cloud, domed = domed_room(DOOR, [1.2, 0.0, 1.5])
    opened = trim.trim(domed, cloud, cloud.cloud, trim.Settings(support_m=0.12))
    for z in (0.3, 1.0, 1.7):
        assert not covered(opened, [0, 0, z], [2, 0, z]), f"the door at z = {z}"
    for x in (0.6, 1.0, 1.4, 1.8):
        assert covered(opened, [x, 0, 1.5], [x, 0, 0.0]), f"the floor at x = {x}"


def test_a_bulge_is_drawn_back_behind_what_was_measured(oriented: OrientedCloud) -> None:
    """A board hides the gap in the wall; the surface bulges out in front of the board."""
    rng = np.random.default_rng(3)
    board = np.float32(rng.uniform([1.5, -0.9, 0.7], [1.5, 0.9, 2.3], (20_000, 3)))
    points = np.concatenate([oriented.cloud.points, board])
    kind = np.zeros(len(points), np.int16)
    full = PointCloud(np.zeros(3), points, np.zeros((len(points), 3), np.uint8), kind)
    box = trimesh.creation.box((4, 4.8, 2.5)).apply_translation([0, 0, 1.25])
    box.invert()
    for _ in range(6):
        box = box.subdivide()
    vertices = np.float32(box.vertices)
    hidden = inside(vertices, WINDOW)
    from_middle = np.linalg.norm(vertices[hidden, 1:] - [0, 1.5], axis=1)
    vertices[hidden, 0] -= 0.8 * np.cos(np.minimum(from_middle, 0.5) * np.pi) ** 2
    bulging = Mesh(np.zeros(3), vertices, box.faces.astype(np.int32))
    mended = trim.trim(bulging, oriented, full, trim.Settings(support_m=0.12))
    assert len(mended.faces) == len(bulging.faces), "nothing is cut"
    assert vertices[hidden, 0].min() < 1.21
    assert mended.vertices[hidden, 0].min() > 1.3, "as far as the board, but for the smoothing"
    np.testing.assert_array_equal(mended.vertices[~hidden], vertices[~hidden])


def test_what_is_marked_closed_stays(oriented: OrientedCloud, solved: Mesh) -> None:
    kept = trim.trim(
        solved, oriented, oriented.cloud, trim.Settings(support_m=0.12, closed=(WINDOW,))
    )
    assert covered(kept, [0, 0, 1.5], [2, 0, 1.5])


def test_without_stations_small_gaps_are_bridged(oriented: OrientedCloud, solved: Mesh) -> None:
    unknown = OrientedCloud(oriented.cloud, oriented.normals, np.empty((0, 3)))
    wide = trim.trim(solved, unknown, oriented.cloud, trim.Settings(0.12, bridge_area_m2=5))
    narrow = trim.trim(solved, unknown, oriented.cloud, trim.Settings(0.12, bridge_area_m2=0.1))
    assert len(wide.faces) == len(solved.faces)
    assert not covered(narrow, [0, 0, 1.5], [2, 0, 1.5])


# ------------------------------------------------------------------ hygiene


def test_crumbs_doubles_and_overfull_edges_go() -> None:
    ball = trimesh.creation.icosphere(3, 1.0)
    crumb = trimesh.creation.icosphere(1, 0.01)
    crumb.apply_translation((3, 0, 0))
    both = trimesh.util.concatenate([ball, crumb])
    flap = [*both.faces[0][:2], len(both.vertices)]
    vertices = np.vstack([both.vertices, [0, 0, 5]])
    faces = np.vstack([both.faces, both.faces[:1], [0, 0, 1], [flap]])
    mesh = Mesh(np.zeros(3), np.float32(vertices), np.int32(faces))
    clean = hygiene.hygiene(mesh, hygiene.Settings(crumb_area_m2=0.1))
    edge = np.sort(clean.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert np.unique(edge, axis=0, return_counts=True)[1].max() == 2
    assert (face_areas(clean) > 0).all()
    assert components(face_adjacency(clean.faces), len(clean.faces)).max() == 0
    assert len(clean.faces) >= len(ball.faces) - 1


def test_a_short_rod_is_no_crumb_but_a_ball_of_its_area_is() -> None:
    ball = trimesh.creation.icosphere(3, 1.0)
    rod = trimesh.creation.cylinder(0.01, 0.15).apply_translation([3, 0, 0])
    fleck = trimesh.creation.icosphere(2, 0.028).apply_translation([0, 3, 0])
    assert fleck.area == pytest.approx(rod.area, rel=0.1)
    all_of_it = trimesh.util.concatenate([ball, rod, fleck])
    mesh = Mesh(np.zeros(3), np.float32(all_of_it.vertices), np.int32(all_of_it.faces))
    clean = hygiene.hygiene(mesh, hygiene.Settings())
    assert len(clean.faces) == len(ball.faces) + len(rod.faces)
    assert clean.vertices[:, 0].max() > 3


def test_only_crumbs_is_an_error() -> None:
    ball = trimesh.creation.icosphere(1, 0.01)
    with pytest.raises(StageError, match="only crumbs"):
        hygiene.hygiene(
            Mesh(np.zeros(3), np.float32(ball.vertices), np.int32(ball.faces)), hygiene.Settings()
        )


# ------------------------------------------------------------------ specks


def test_what_hangs_in_the_air_on_a_few_strays_goes_and_a_lamp_stays(
    oriented: OrientedCloud, solved: Mesh
) -> None:
    lamp = trimesh.creation.icosphere(3, 0.15).apply_translation([0.5, 1.0, 1.9])
    blob = trimesh.creation.icosphere(3, 0.1).apply_translation([-0.5, -1.0, 1.2])
    shapes = [Mesh(solved.origin, np.float32(s.vertices), np.int32(s.faces)) for s in (lamp, blob)]
    hung = weld([solved, *shapes])
    seen = lamp.sample(int(lamp.area * len(oriented.cloud) / face_areas(solved).sum() / 2), seed=0)
    points = np.concatenate([oriented.cloud.points, seen, blob.vertices[[0, 100, 200]]])
    kept = specks.without_specks(hung, np.float32(points), support_m=0.12)
    assert len(kept.faces) == len(solved.faces) + len(lamp.faces)
    assert not (np.linalg.norm(kept.vertices - blob.center_mass, axis=1) < 0.11).any()


# ------------------------------------------------------------------ levels, measure


def test_levels_have_the_faces_asked_for_and_stay_near(trimmed: Mesh) -> None:
    ends = levels.levels(trimmed, levels.Settings(0.05, face_detail_ratio=1.5, root_faces=800))
    assert len(ends.root.faces) <= 800
    assert 800 < len(ends.finest.faces) < len(trimmed.faces)
    shape = scene(trimmed)
    for mesh, near_m in ((ends.finest, 0.02), (ends.root, 0.06)):
        distance = shape.compute_distance(mesh.vertices).numpy()
        assert np.quantile(distance, 0.95) < near_m


def test_blocks_leave_no_crack_where_they_met(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(levels, "_BLOCK_FACES", 10_000)
    ball = trimesh.creation.icosphere(subdivisions=5, radius=2.0)
    mesh = Mesh(np.zeros(3), ball.vertices.astype(np.float32), ball.faces.astype(np.int32))
    finest = levels.levels(mesh, levels.Settings(0.06, root_faces=400)).finest
    assert 3_400 < len(finest.faces) < 3_700
    assert trimesh.Trimesh(finest.vertices, finest.faces, process=False).is_watertight
    off_m = np.abs(np.linalg.norm(finest.vertices, axis=1) - 2)
    assert np.quantile(off_m, 0.95) < 0.004
    assert off_m.max() < 0.01


def test_quality_tells_distance_and_what_is_inferred(oriented: OrientedCloud) -> None:
    shell = trimesh.creation.box((4, 4.8, 2.5))
    shell.apply_translation((0, 0, 1.25))
    shell = shell.subdivide_to_size(0.05)
    mesh = Mesh(np.zeros(3), np.float32(shell.vertices), np.int32(shell.faces))
    quality = measure.measure(mesh, oriented.cloud, STATION, inferred.Settings(0.05))
    assert quality.cloud_to_mesh_p95_mm < 0.01
    assert quality.area_m2 == pytest.approx(82.4, rel=1e-4)
    gaps = np.pi * 0.85**2 + 1
    assert quality.inferred_area_ratio == pytest.approx(gaps / 82.4, rel=0.12)


def test_welding_joins_what_lies_at_one_place() -> None:
    box = trimesh.creation.box((1, 1, 1))
    parts = [
        Mesh(np.zeros(3), np.float32(box.vertices), np.int32(box.faces[half]))
        for half in (slice(0, 6), slice(6, 12))
    ]
    joined = weld(parts)
    assert len(joined.vertices) == 8
    assert trimesh.Trimesh(joined.vertices, joined.faces, process=False).is_watertight


def test_a_spike_without_width_is_gone_before_it_is_published() -> None:
    plane = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    spike = np.float32([[0.5, 0.5, 0], [0.5, 0.5 + STEP_M / 4, 0], [0.5, 0.5, 0.03]])
    faces = np.int32([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [4, 5, 6], [5, 4, 6]])
    found = on_grid(Mesh(np.zeros(3), np.concatenate([plane, spike]), faces))
    assert len(found.faces) == 4
    assert found.vertices[:, 2].max() == 0
    np.testing.assert_array_equal(found.vertices % STEP_M, 0)
