"""Sifting: what is not there goes, what is thin, slanted or seen through a window stays."""

from __future__ import annotations

import numpy as np
import pytest
from scanned import EYES, ROOM, Cast, beams, cloud_of, inside, noisy, ranges, solid
from scipy.spatial import cKDTree

from tourgen.errors import InputError
from tourgen.geometry import PointCloud
from tourgen.stages import sift
from tourgen.stages.sift.grown import bodies
from tourgen.stages.sift.mirrors import outlined
from tourgen.stages.sift.nearby import nearby
from tourgen.stages.sift.picture import picture
from tourgen.stages.sift.views import View, views

SETTINGS = sift.Settings(min_points=100)
PERSON = solid([0.0, -1.2, 0.0], [0.4, -0.8, 1.75])
ROD = solid([0.3, 0.3, 0.0], [0.32, 0.32, 2.6])
TABLE = solid([-0.4, 0.9, 0.6], [0.6, 1.5, 0.75])
WALLS = inside(*ROOM)


def rows(cloud: PointCloud) -> np.ndarray:
    """One value a point."""
    return np.ascontiguousarray(cloud.points).view(np.dtype((np.void, 12))).reshape(-1)


def kept(cloud: PointCloud, sifted: sift.Sifted) -> np.ndarray:
    """Mask of the points left."""
    left = {row.tobytes() for row in sifted.cloud.points}
    return np.array([row.tobytes() in left for row in cloud.points])


def scans(*things: object, passer_by: bool = False, step_deg: float = 1.0) -> tuple:
    """Points of each station, and whether each is of the passer-by, whom the first one sees."""
    rng, way = np.random.default_rng(0), beams(step_deg)
    parts, person = [], []
    for number, eye in enumerate(EYES):
        true = ranges(eye, way, WALLS, *things)
        seen = ranges(eye, way, WALLS, *things, PERSON) if passer_by and number == 0 else true
        parts.append((eye + way * noisy(seen, rng)[..., None]).reshape(-1, 3))
        person.append((seen < true).reshape(-1))
    return parts, np.concatenate(person)


def test_who_stood_in_one_view_only_goes() -> None:
    parts, person = scans(TABLE, passer_by=True)
    cloud = cloud_of(parts)
    left = kept(cloud, sift.sift(cloud, EYES, SETTINGS))
    assert person.sum() > 300
    assert left[person].mean() < 0.01
    assert left[~person].mean() > 0.995


def test_a_thin_rod_stays() -> None:
    parts, _ = scans(ROD)
    cloud = cloud_of(parts)
    rod = (np.abs(cloud.points[:, :2] - 0.31) < 0.02).all(axis=1)
    assert rod.sum() > 100
    assert kept(cloud, sift.sift(cloud, EYES, SETTINGS))[rod].mean() > 0.9


def test_a_clean_scan_stays_whole() -> None:
    """Also what is seen at a grazing angle, where points are few."""
    parts, _ = scans(TABLE, solid([1.6, -1.9, 0.0], [2.4, -1.3, 1.4]))
    cloud = cloud_of(parts)
    assert kept(cloud, sift.sift(cloud, EYES, SETTINGS)).mean() > 0.9995


def tube(radius_m: float, axis_y: float, axis_z: float) -> Cast:
    """Range to a long tube along x, seen from outside."""

    def cast(eye: np.ndarray, way: np.ndarray) -> np.ndarray:
        y, z = eye[1] - axis_y, eye[2] - axis_z
        square = way[:, 1] ** 2 + way[:, 2] ** 2
        middle = -(y * way[:, 1] + z * way[:, 2])
        inside = middle**2 - square * (y * y + z * z - radius_m**2)
        with np.errstate(invalid="ignore", divide="ignore"):
            reach = (middle - np.sqrt(inside)) / square
        return np.where((inside > 0) & (reach > 0), reach, np.inf)

    return cast


def test_a_handrail_few_beams_wide_stays() -> None:
    parts, _ = scans(tube(0.025, 0.1, 1.0), step_deg=0.5)
    cloud = cloud_of(parts)
    rail = np.hypot(cloud.points[:, 1] - 0.1, cloud.points[:, 2] - 1.0) < 0.032
    assert rail.sum() > 3000
    assert kept(cloud, sift.sift(cloud, EYES, SETTINGS))[rail].mean() > 0.955


def test_a_lamp_on_a_wire_that_no_beam_meets_stays() -> None:
    parts, _ = scans(solid([-0.1, -0.1, 1.9], [0.1, 0.1, 2.1]))
    cloud = cloud_of(parts)
    lamp = (np.abs(cloud.points - [0, 0, 2.0]) < 0.12).all(axis=1)
    assert 60 < lamp.sum() < 0.05 * len(cloud)
    settings = sift.Settings(min_points=100, island_share=0.05)
    assert kept(cloud, sift.sift(cloud, EYES, settings))[lamp].mean() > 0.85


def test_what_lies_apart_outside_goes() -> None:
    parts, _ = scans()
    yard = np.random.default_rng(4).uniform([8, 0, 0], [8.4, 0.4, 0.4], (400, 3))
    cloud = cloud_of([np.concatenate([parts[0], yard]), parts[1]])
    settings = sift.Settings(min_points=100, island_share=0.05)
    left = kept(cloud, sift.sift(cloud, EYES, settings))
    assert not left[len(parts[0]) : len(parts[0]) + 400].any()


def test_a_person_is_a_body_and_what_is_mixed_along_edges_is_none() -> None:
    rng, way = np.random.default_rng(5), beams(0.6)
    slats = [solid([x, 1.0, 0.3], [x + 0.03, 1.03, 1.5]) for x in np.arange(-0.6, 0.6, 0.09)]
    points, mixed = [], []
    for eye in EYES:
        true = ranges(eye, way, WALLS, *slats)
        beside = np.roll(true, -1, axis=1)
        edge = (np.abs(true - beside) > 0.05) & (rng.random(true.shape) < 1 / 3)
        share = rng.uniform(0.1, 0.9, true.shape)
        seen = np.where(edge, share * true + (1 - share) * beside, true)
        points.append((eye + way * noisy(seen, rng)[..., None]).reshape(-1, 3))
        mixed.append(edge.reshape(-1))
    parts, person = scans(passer_by=True)
    for cloud, gone, share in (
        (cloud_of(points), np.concatenate(mixed), 0.0),
        (cloud_of(parts), person, 1.0),
    ):
        assert gone.sum() > 500
        found = bodies(cloud.points, gone, list(views(cloud, EYES)))
        assert found[gone].mean() == pytest.approx(share, abs=0.1)
        assert not found[~gone].any()


def test_mixed_pixels_go_and_edges_stay() -> None:
    rng, way = np.random.default_rng(1), beams(0.8)
    parts, off_m = [], []
    for eye in EYES:
        true = ranges(eye, way, WALLS, TABLE)
        beside = np.roll(true, -1, axis=1)
        mixed = (np.abs(true - beside) > 0.15) & (rng.random(true.shape) < 1 / 3)
        share = rng.uniform(0.1, 0.9, true.shape)
        seen = np.where(mixed, share * true + (1 - share) * beside, true)
        off_m.append(np.minimum(np.abs(seen - true), np.abs(seen - beside)).reshape(-1))
        parts.append((eye + way * noisy(seen, rng)[..., None]).reshape(-1, 3))
    cloud, off = cloud_of(parts), np.concatenate(off_m)
    sifted = sift.sift(cloud, EYES, SETTINGS)
    left = kept(cloud, sifted)
    assert (off > 0.02).sum() > 50
    assert left[off > 0.02].mean() < 0.2
    assert left[off == 0].mean() > 0.997
    assert sifted.removed["mixed"] > 30


@pytest.mark.parametrize(
    ("glass", "step_deg", "early"),
    [("mirror", 0.8, 0.0), ("window", 0.8, 0.0), ("mirror", 0.3, 0.1)],
    ids=["mirror", "window", "mirror, dense, with strays before what it shows"],
)
def test_a_mirrored_room_goes_and_one_behind_a_window_stays(
    glass: str, step_deg: float, early: float
) -> None:
    rng, way = np.random.default_rng(2), beams(step_deg)
    low, high = ROOM
    chest, shelf = (
        solid([-1.0, -0.2, 0.0], [-0.2, 0.3, 0.9]),
        solid([0.6, -1.9, 0.9], [1.6, -1.5, 1.6]),
    )
    parts, behind = [], []
    for eye in EYES:
        reach = ranges(eye, way, WALLS, chest, shelf)
        hit = eye + way * reach[..., None]
        through = (hit[..., 1] > high[1] - 1e-6) & (np.abs(hit[..., 0]) < 0.6)
        through &= np.abs(hit[..., 2] - 1.5) < 0.5
        start, further = hit[through], way[through]
        if glass == "mirror":
            thrown = further * [1, -1, 1]
            more = np.min(
                [cast_each(start + thrown * 1e-6, thrown, low, high)]
                + [box_each(start, thrown, *box) for box in BOXES],
                axis=0,
            )
        else:
            more = cast_each(
                start, further, [low[0] - 1, high[1] - 1e-3, -1], high + np.array([1, 3, 1])
            )
        reach[through] += more * np.where(rng.random(len(more)) < early, rng.random(len(more)), 1)
        parts.append((eye + way * noisy(reach, rng)[..., None]).reshape(-1, 3))
        behind.append(through.reshape(-1))
    cloud, seen_behind = cloud_of(parts), np.concatenate(behind)
    sifted = sift.sift(cloud, EYES, SETTINGS)
    left = kept(cloud, sifted)
    assert seen_behind.sum() > 500
    assert left[~seen_behind].mean() > 0.995
    if glass == "mirror":
        assert left[seen_behind].mean() < 0.01
        assert sifted.removed["reflected"] > 0.9 * seen_behind.sum()
        fresh = ~np.isin(rows(sifted.cloud), rows(cloud))
        on_glass = sifted.cloud.points[fresh]
        fullest = np.bincount(cloud.station[seen_behind]).max()
        assert fresh.sum() > 0.9 * fullest, "each beam of one station ends on the glass instead"
        _, beside = cKDTree(on_glass).query(on_glass, k=5)
        owner = sifted.cloud.station[fresh]
        assert (owner[beside] == owner[:, None]).mean() > 0.95, "no two pictures are mixed"
        assert np.abs(on_glass[:, 1] - high[1]).max() < 0.01
        assert (np.abs(on_glass[:, [0, 2]] - [0, 1.5]) < [0.65, 0.55]).all()
    else:
        assert sifted.removed["reflected"] == 0
    merged = cloud_of(parts, merged=True)
    assert kept(merged, sift.sift(merged, EYES, SETTINGS))[~seen_behind].mean() > 0.99


BOXES = (([-1.0, -0.2, 0.0], [-0.2, 0.3, 0.9]), ([0.6, -1.9, 0.9], [1.6, -1.5, 1.6]))


def cast_each(start: np.ndarray, way: np.ndarray, low: object, high: object) -> np.ndarray:
    """Range to the walls around, each beam from a place of its own."""
    with np.errstate(divide="ignore"):
        return np.where(way > 0, (high - start) / way, (low - start) / way).min(axis=1)


def box_each(start: np.ndarray, way: np.ndarray, low: list, high: list) -> np.ndarray:
    """Range to a box, each beam from a place of its own."""
    with np.errstate(divide="ignore"):
        a, b = (low - start) / way, (high - start) / way
    near, far = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
    return np.where((near < far) & (near > 0), near, np.inf)


def test_strays_go_without_stations() -> None:
    parts, _ = scans()
    strays = np.random.default_rng(3).uniform([-2, -1.5, 0.5], [2, 1.5, 2.1], (60, 3))
    cloud = cloud_of([*parts, strays, np.full((30, 3), 9.0)], merged=True)
    left = kept(cloud, sift.sift(cloud, np.empty((0, 3)), SETTINGS))
    assert left[-90:].mean() < 0.05
    assert left[:-90].mean() > 0.99


@pytest.mark.parametrize(
    "stations",
    [np.empty((0, 3)), EYES[:1], EYES, EYES + 500.0],
    ids=["none", "one", "two", "far outside"],
)
@pytest.mark.parametrize("spread", [(1, 1, 0), (1, 0, 0), (0, 0, 0)], ids=["plane", "line", "spot"])
@pytest.mark.parametrize("number", [-1, 0])
def test_flat_clouds_pass(stations: np.ndarray, spread: tuple, number: int) -> None:
    points = np.random.default_rng(0).random((2000, 3)) * spread
    cloud = cloud_of([points])
    cloud = PointCloud(
        cloud.origin, cloud.points, cloud.colors, np.full_like(cloud.station, number)
    )
    assert len(sift.sift(cloud, stations, SETTINGS).cloud) > 1800


def test_a_thousand_duplicates_do_no_harm() -> None:
    parts, person = scans(passer_by=True)
    again = [np.concatenate([parts[0], np.repeat(parts[0][5000:5001], 1000, axis=0)]), parts[1]]
    cloud = cloud_of(again)
    left = kept(cloud, sift.sift(cloud, EYES, SETTINGS))
    wrong = np.concatenate([person[: len(parts[0])], np.zeros(1000, bool), person[len(parts[0]) :]])
    assert left[wrong].mean() < 0.01
    assert left[~wrong].mean() > 0.99


def view_of(way: np.ndarray, reach: np.ndarray) -> View:
    points = (EYES[0] + way.reshape(-1, 3) * reach.reshape(-1, 1)).astype(np.float32)
    (view,) = views(cloud_of([points]), EYES[:1])
    return view


def test_noise_is_told_from_smooth_surfaces() -> None:
    rng, way = np.random.default_rng(0), beams(0.5)
    view = view_of(way, noisy(ranges(EYES[0], way, WALLS), rng))
    assert np.abs(view.noise_m / 0.0015 - 1).max() < 0.3
    assert np.median(view.noise_m) == pytest.approx(0.0015, rel=0.1)
    assert view.smooth.mean() > 0.85
    assert np.degrees(view.picture.step_rad) == pytest.approx(0.5, rel=0.1)


def test_a_slanted_surface_is_looked_through_to_the_centimetre() -> None:
    rng, way = np.random.default_rng(0), beams(0.5)
    view = view_of(way, noisy(ranges(EYES[0], way, WALLS), rng))
    places = rng.uniform([-0.5, -1.5, 0], [2, 1.5, 0], (500, 3)).astype(np.float32)
    for height_m, passed in ((0.0, 0.0), (0.04, 0.99)):
        _, beyond_m = view.beyond_m(places + np.float32([0, 0, height_m]))
        assert (beyond_m > 0.02).mean() == pytest.approx(passed, abs=0.01)


def test_a_ghost_beside_its_mirror_does_not_widen_it() -> None:
    """Three that fold onto the room by chance, seen half a metre aside, take no wall along."""
    rng = np.random.default_rng(0)
    normal, place = np.array([0.0, 1, 0]), np.array([0.2, -2.9, 1.6])
    patch = rng.uniform((-0.3, 0, -0.4), (0.3, 0, 0.4), (8000, 3))
    aside = np.array([[-0.8, 0, 0.1], [-0.82, 0, 0.15], [0.1, 0, 0.9]])
    mirror = outlined(normal, place, np.concatenate([patch, aside]))
    assert mirror is not None
    station = place + np.array([0.0, 3, 0])
    through = place + 2 * np.array([[0.25, -1.5, 0.3], [-0.5, -1.5, 0.1], [0.05, -1.5, 0.6]])
    assert mirror.hides(station, through.astype(np.float32), 0.05).tolist() == [True, False, False]


@pytest.mark.parametrize("count", [0, 3, 39])
def test_a_handful_of_ghosts_makes_no_mirror(count: int) -> None:
    crossing = np.random.default_rng(0).uniform(-0.01, 0.01, (count, 3))
    assert outlined(np.array([0.0, 1, 0]), np.zeros(3), crossing) is None


@pytest.mark.parametrize("case", ["far away", "one spot", "one far off"])
def test_a_picture_has_few_cells_for_each_point(case: str) -> None:
    rng = np.random.default_rng(0)
    points = rng.random((5000, 3)).astype(np.float32) + np.float32([0.5, 0.5, 0.5])
    if case == "far away":
        points += np.float32(500)
    elif case == "one spot":
        points[10:] = points[0]
    else:
        points[:-1] += np.float32(500)
    range_m = np.linalg.norm(points, axis=1)
    seen = picture(points / range_m[:, None], range_m)
    assert seen.beams.size < 8 * len(points)


def test_nearby_misses_none_and_takes_few_more() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-3, 3, (4000, 3)).astype(np.float32)
    places = rng.uniform(-1, 1, (30, 3)).astype(np.float32)
    distance = np.linalg.norm(points[:, None] - places, axis=2).min(axis=1)
    found = nearby(points, places, 0.3)
    assert found[distance < 0.3].all()
    assert not found[distance > 0.3 * 2 * np.sqrt(3)].any()


def test_too_few_points_are_told() -> None:
    cloud = cloud_of([np.random.default_rng(0).random((50, 3))])
    with pytest.raises(InputError, match="expected at least 10000 points, found 50"):
        sift.sift(cloud, EYES, sift.Settings())
