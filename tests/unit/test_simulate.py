"""The simulated scanner has the faults that it says, and no others."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tourgen.geometry import Float64
from tourgen.rays import ray_scene, rays_of
from tourgen.simulate import FULL_POINTS, MODELS, Size, simulate_room
from tourgen.simulation import furniture, scanner, stairs
from tourgen.simulation import materials as look
from tourgen.simulation.charts import (
    FlatWall,
    Opening,
    on_wall,
    place,
    reveal,
    rod,
    sheet,
    wall_surface,
)
from tourgen.simulation.model import ChartMesh, Lamp, PlacedOpening, RoomModel, join

POINTS = 60_000
SIZE = Size(POINTS, texture=256, panorama=64)


def small_room() -> RoomModel:
    """4 x 4 m, 2.5 m high: a window, a door, a mirror, a rail, a lamp, a person."""
    plaster, oak = look.plain((200, 190, 170)), look.wood()
    charts = [
        sheet((-2, -2, 0), (4, 0, 0), (0, 4, 0), look.tiles([(200, 200, 190)], 0.2), cell_m=0.4),
        sheet((-2, 2, 2.5), (4, 0, 0), (0, -4, 0), plaster, cell_m=0.4),
    ]
    openings: list[PlacedOpening] = []
    holes = {0: Opening("window", 0, 1.5, 1.4, 1.2), 1: Opening("door", 0, 1.0, 0.85, 2.0)}
    for k in range(4):
        wall = FlatWall(k * np.pi / 2, 2.0)
        pierced = [holes[k]] if k in holes else []
        charts += wall_surface(wall, (-2, 2), (0, 2.5), plaster, pierced)
        for hole in pierced:
            charts += reveal(wall, hole, plaster, oak)
            openings.append(PlacedOpening.of(wall, hole))
    charts += on_wall(furniture.mirror(0.8, 1.0, 2.0), FlatWall(1.5 * np.pi, 2.0))
    charts += rod((-1.0, 0.6, 0.0), (-1.0, 0.6, 1.6), 0.03, oak)
    person = furniture.person(look.cloth((60, 60, 90)), look.cloth((50, 40, 40)))
    return RoomModel(
        id="small",
        charts=tuple(charts),
        openings=tuple(openings),
        lamps=(Lamp((0, 0, 2.2), 0.1, (0.5, 0.4, 0.3)),),
        stations=np.array([[-0.6, -0.4, 1.5], [0.7, 0.5, 1.45], [0.5, -0.9, 1.5]]),
        passer_by=tuple(place(person, 0, (0.3, 1.2, 0))),
        passer_by_station=1,
    )


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("simulated")
    simulate_room(small_room(), folder, SIZE)
    return folder


def ply(path: Path) -> tuple[Float64, NDArray[np.uint8]]:
    data = path.read_bytes()
    body = data.index(b"end_header\n") + len(b"end_header\n")
    record = np.frombuffer(data[body:], dtype=[("xyz", "<f4", 3), ("rgb", "u1", 3)])
    return record["xyz"].astype(np.float64), record["rgb"]


def truth(folder: Path) -> tuple[dict[str, object], NDArray[np.uint8], NDArray[np.uint8]]:
    with np.load(folder / "truth" / "small.npz") as kept:
        label, station = kept["label"], kept["station"]
    facts = json.loads((folder / "truth" / "small.json").read_text(encoding="utf-8"))
    return facts, label, station


def beams(folder: Path) -> tuple[Float64, Float64, Float64]:
    """Per point: the true place of its station, the beam's true direction, and the range."""
    points, _ = ply(folder / "scans" / "small.ply")
    facts, _, station = truth(folder)
    origins, directions = np.empty_like(points), np.empty_like(points)
    for k, place_ in enumerate(facts["stations"]):
        mine = station == k
        local = (points[mine] - place_["believed_position"]) @ np.array(place_["believed_rotation"])
        directions[mine] = local @ np.array(place_["true_rotation"]).T
        origins[mine] = place_["position"]
    reach = np.linalg.norm(directions, axis=1)
    return origins, directions / reach[:, None], reach


def mesh_of(model: RoomModel) -> ChartMesh:
    return join(model.charts)


def test_count_is_exact_and_order_tells_nothing(scanned: Path) -> None:
    points, colors = ply(scanned / "scans" / "small.ply")
    _, label, station = truth(scanned)
    assert len(points) == len(colors) == len(label) == len(station) == POINTS
    runs = np.count_nonzero(np.diff(station.astype(int))) / POINTS
    shares = np.bincount(station) / POINTS
    assert runs == pytest.approx(1 - float((shares**2).sum()), abs=0.01)


def test_the_counts_of_the_demo() -> None:
    assert FULL_POINTS["chamber1"] == 1_302_317
    assert FULL_POINTS["chamber2"] == 15_224_042


def test_the_same_bytes_each_time(scanned: Path, tmp_path: Path) -> None:
    simulate_room(small_room(), tmp_path, SIZE)
    names = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.glob("*/*"))
    assert len(names) == 6
    for name in names:
        assert (tmp_path / name).read_bytes() == (scanned / name).read_bytes(), name


def test_nothing_below_sixty_degrees(scanned: Path) -> None:
    _, directions, _ = beams(scanned)
    elevation = np.degrees(np.arcsin(np.clip(directions[:, 2], -1, 1)))
    assert elevation.min() > -60
    assert elevation.min() < -58
    assert elevation.max() > 88


def test_range_noise_is_as_stated(scanned: Path) -> None:
    origins, directions, reach = beams(scanned)
    _, label, _ = truth(scanned)
    mesh = mesh_of(small_room())
    answer = ray_scene(mesh.vertices, mesh.faces).cast_rays(rays_of(origins, directions))
    true = answer["t_hit"].numpy()
    facing = np.abs((answer["primitive_normals"].numpy() * directions).sum(axis=1))
    plain = (label == scanner.SURFACE) & (facing > 0.5)
    scaled = (reach[plain] - true[plain]) / (0.0015 + 0.0002 * true[plain])
    assert np.median(np.abs(scaled)) / 0.6745 == pytest.approx(1, abs=0.03)
    assert abs(float(np.median(scaled))) < 0.03


def test_labels_agree_with_distance_to_truth(scanned: Path) -> None:
    import open3d as o3d

    origins, directions, reach = beams(scanned)
    _, label, station = truth(scanned)
    points = (origins + directions * reach[:, None]).astype(np.float32)
    mesh = mesh_of(small_room())
    scene = ray_scene(mesh.vertices, mesh.faces)
    distance = scene.compute_distance(o3d.core.Tensor(points)).numpy()
    assert (distance[label == scanner.SURFACE] < 0.012).all()
    assert (distance[label == scanner.MIXED] > 0.012).mean() > 0.7
    stray = label == scanner.STRAY
    assert 5 < stray.sum() < 300
    assert reach[stray].min() > 5.9
    assert reach[stray].max() < 40.1
    ghost = points[label == scanner.GHOST]
    assert len(ghost) > 100
    assert (ghost[:, 1] < -1.95).mean() > 0.99  # behind the southern wall
    passer_by = label == scanner.PASSER_BY
    assert passer_by.sum() > 300
    assert (station[passer_by] == 1).all()


def test_a_third_of_depth_edges_is_mixed() -> None:
    grid = scanner.Grid(rows=200, columns=300, lowest=0.0, step=0.005)
    reach = np.full((200, 300), 3.0)
    reach[:, 100:200] = 2.0  # two edges in each of 200 rows
    answer = scanner.Beams(
        reach=reach.ravel(),
        colors=np.zeros((60_000, 3), dtype=np.uint8),
        label=np.zeros(60_000, dtype=np.uint8),
        slope=np.zeros(60_000),
    )
    mixed, _, label = scanner._mixed(answer, grid, np.random.default_rng(1))
    assert label.sum() / 400 == pytest.approx(1 / 3, abs=0.07)
    assert ((mixed > 2.05) & (mixed < 2.95)).sum() == label.sum()


def test_stations_err_and_expose_as_stated() -> None:
    for station in scanner.stations_of(small_room(), np.random.default_rng(3)):
        shift = np.linalg.norm(station.believed.position - station.true.position)
        turn = station.believed.rotation @ station.true.rotation.T
        angle = np.degrees(np.arccos((np.trace(turn) - 1) / 2))
        assert 0.001 <= shift <= 0.002
        assert angle == pytest.approx(0.01, abs=1e-3)
        assert 0.92 * 0.97 <= station.gain.min() <= station.gain.max() <= 1.08 * 1.03
        assert station.gain.max() / station.gain.min() <= 1.03 / 0.97


def test_the_lamp_burns_out(scanned: Path) -> None:
    origins, directions, _ = beams(scanned)
    _, colors = ply(scanned / "scans" / "small.ply")
    way = np.array([0, 0, 2.2]) - origins
    near = (directions * way).sum(axis=1) / np.linalg.norm(way, axis=1) > np.cos(np.radians(2))
    assert near.sum() > 10
    assert (colors[near].mean(axis=1) > 225).all()


def test_e57_has_stations_rows_columns_and_pictures(scanned: Path) -> None:
    import pye57

    points, _ = ply(scanned / "scans" / "small.ply")
    facts, _, _ = truth(scanned)
    found = []
    with pye57.E57(str(scanned / "scans" / "small.e57")) as file:
        assert file.scan_count == 3
        assert file.root["images2D"].childCount() == 3
        for k in range(3):
            header = file.get_header(k)
            believed = facts["stations"][k]
            assert header.translation == pytest.approx(believed["believed_position"])
            data = file.read_scan(k, colors=True, row_column=True, ignore_missing_fields=True)
            found.append(np.stack([data[f"cartesian{a}"] for a in "XYZ"], axis=1))
            assert data["rowIndex"].max() > 50
            assert data["columnIndex"].max() > 100
            sphere = file.root["images2D"][k]["sphericalRepresentation"]
            assert sphere["imageWidth"].value() == 2 * sphere["imageHeight"].value() == 128
            assert (
                file.root["images2D"][k]["associatedData3DGuid"].value() == header["guid"].value()
            )
    away, _ = cKDTree(points).query(np.concatenate(found))
    assert sum(map(len, found)) == POINTS
    assert np.max(away) < 1e-5


@pytest.mark.parametrize("room", list(MODELS))
def test_the_shell_is_closed_except_at_openings(room: str) -> None:
    model = MODELS[room]()
    mesh = mesh_of(model)
    scene = ray_scene(mesh.vertices, mesh.faces)
    rng = np.random.default_rng(2)
    assert 20_000 < len(mesh.faces) < 150_000
    for station in model.stations:
        origins = np.broadcast_to(station, (60_000, 3))
        directions = rng.normal(size=(60_000, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        answer = scene.cast_rays(rays_of(origins, directions))
        lost = ~np.isfinite(answer["t_hit"].numpy())
        leaves = np.zeros(len(lost), dtype=np.bool_)
        for opening in model.openings:
            leaves |= opening.leaves(origins, directions)
        assert not (lost & ~leaves).any()
        behind = (answer["primitive_normals"].numpy() * directions).sum(axis=1) > 0
        assert not (behind & ~lost).any()


@pytest.mark.parametrize("room", ["chamber1", "chamber2"])
def test_one_blind_disc_stays_unseen(room: str) -> None:
    model = MODELS[room]()
    mesh = mesh_of(model)
    scene = ray_scene(mesh.vertices, mesh.faces)
    rng = np.random.default_rng(2)
    mine = model.stations[2]
    radius = mine[2] * np.tan(np.radians(30)) * np.sqrt(rng.random(2000))
    turn = rng.random(2000) * 2 * np.pi
    disc = np.stack(
        [mine[0] + radius * np.cos(turn), mine[1] + radius * np.sin(turn), np.full(2000, 0.002)],
        axis=1,
    )
    for other in model.stations[:2]:
        way = disc - other
        length = np.linalg.norm(way, axis=1)
        rays = rays_of(np.broadcast_to(other, way.shape), way / length[:, None])
        assert (scene.cast_rays(rays)["t_hit"].numpy() < length - 0.01).all()


def test_the_stair_can_be_climbed() -> None:
    assert stairs.RISE <= 0.19
    assert stairs.RADIUS - stairs.NEWEL >= 0.85
    climb = stairs.RISERS * stairs.RISE
    assert climb == pytest.approx(6.0)
    mesh = mesh_of(MODELS["stairs"]())
    scene = ray_scene(mesh.vertices, mesh.faces)
    turn = np.pi + 0.5 + np.linspace(-1.2, stairs.END + 1.0, 700)
    steps = np.clip(np.floor((turn - np.pi - 0.5) / stairs.TREAD) + 1, 0, stairs.RISERS)
    for radius in (0.45, 0.66, 0.88):
        feet = np.stack(
            [radius * np.cos(turn), radius * np.sin(turn), steps * stairs.RISE + 0.3], 1
        )
        up, down = np.array([[0, 0, 1.0]]), np.array([[0, 0, -1.0]])
        head = scene.cast_rays(rays_of(feet, np.repeat(up, 700, 0)))["t_hit"].numpy() + 0.3
        fall = scene.cast_rays(rays_of(feet, np.repeat(down, 700, 0)))["t_hit"].numpy()
        assert head.min() >= 1.9
        assert fall.max() <= 0.301
        assert fall.min() >= 0.299 - stairs.RISE  # the nosing of the next step, at most


def test_the_stations_see_the_stair() -> None:
    model = MODELS["stairs"]()
    mesh = mesh_of(model)
    scene = ray_scene(mesh.vertices, mesh.faces)
    rng = np.random.default_rng(2)
    step = rng.integers(0, stairs.RISERS - 1, 4000)
    turn = np.pi + 0.5 + (step + rng.random(4000)) * stairs.TREAD
    radius = np.sqrt(rng.uniform(0.25**2, 1.0, 4000))
    height = (step + 1) * stairs.RISE + 0.003
    treads = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    seen = np.zeros(4000, dtype=np.bool_)
    for station in model.stations:
        way = treads - station
        length = np.linalg.norm(way, axis=1)
        direction = way / length[:, None]
        rays = rays_of(np.broadcast_to(station, way.shape), direction)
        free = scene.cast_rays(rays)["t_hit"].numpy() > length - 0.006
        seen |= free & (direction[:, 2] > -np.sin(np.radians(60)))
    assert seen.mean() > 0.9
