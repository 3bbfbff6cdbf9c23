from __future__ import annotations

import multiprocessing

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import grey_dilation
from surfaces import box_room, mesh, sheet

from tourgen.errors import StageError
from tourgen.geometry import Mesh, UvMesh
from tourgen.raster import rasterize
from tourgen.stages.unwrap import Settings, unwrap

TEXEL_M = 0.01


def corners(unwrapped: UvMesh) -> np.ndarray:
    """(f, 3, 2) in texels."""
    uv = unwrapped.uv.astype(np.float64) * unwrapped.texture_size
    return uv[unwrapped.mesh.faces]


def touched(unwrapped: UvMesh) -> np.ndarray:
    """(h, w) the chart that touches each texel, -1 for none; fails where two touch one."""
    width, height = unwrapped.texture_size
    hits = rasterize(corners(unwrapped), width, height, reach=0.71)
    owner = np.full((height, width), -1)
    chart = unwrapped.chart[hits.face]
    owner[hits.row, hits.column] = chart
    assert (owner[hits.row, hits.column] == chart).all()
    return owner


def gutter(owner: np.ndarray) -> int:
    """Texels between the nearest two charts, at most 9."""
    for reach in range(1, 10):
        size = 2 * reach + 1
        highest = grey_dilation(owner, size=(size, size))
        lowest = -grey_dilation(np.where(owner < 0, -(10**6), -owner), size=(size, size))
        if ((highest >= 0) & (lowest <= 10**5) & (highest != lowest) & (owner >= 0)).any():
            return reach - 1
    return 9


def texels_hit_twice(unwrapped: UvMesh) -> int:
    width, height = unwrapped.texture_size
    hits = rasterize(corners(unwrapped), width, height)
    inside = hits.barycentric.min(1) > 1e-3
    key = hits.row[inside].astype(np.int64) * width + hits.column[inside]
    return len(key) - len(np.unique(key))


def flat_areas(unwrapped: UvMesh) -> np.ndarray:
    """(f,) signed, in square metres as drawn; negative as image rows run down."""
    at = corners(unwrapped) * unwrapped.texel_m
    one, two = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
    return (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2


def true_areas(some: Mesh) -> np.ndarray:
    at = some.vertices[some.faces].astype(np.float64)
    return np.linalg.norm(np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]), axis=1) / 2


def fill(unwrapped: UvMesh) -> float:
    width, height = unwrapped.texture_size
    return float(np.abs(flat_areas(unwrapped)).sum() / unwrapped.texel_m**2 / width / height)


def check_promises(source: Mesh, unwrapped: UvMesh) -> None:
    assert unwrapped.uv.min() >= 0
    assert unwrapped.uv.max() <= 1
    assert max(unwrapped.texture_size) <= 4096
    assert all(side % 4 == 0 for side in unwrapped.texture_size)
    # The same faces in the same order.
    assert np.array_equal(
        unwrapped.mesh.vertices[unwrapped.mesh.faces], source.vertices[source.faces]
    )
    owner = touched(unwrapped)
    assert gutter(owner) >= 2
    assert texels_hit_twice(unwrapped) == 0
    assert (flat_areas(unwrapped) >= -1e-9).all() or (flat_areas(unwrapped) <= 1e-9).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_noisy_room_keeps_every_promise(seed: int) -> None:
    room = box_room(2.0, 14, 0.012, seed)
    unwrapped = unwrap(room, Settings(TEXEL_M))
    check_promises(room, unwrapped)


def test_noise_does_not_shatter_charts() -> None:
    room = box_room(3.0, 18, 0.015)
    unwrapped = unwrap(room, Settings(TEXEL_M))
    faces = np.bincount(unwrapped.chart)
    assert np.median(faces) >= 50
    assert len(faces) <= 24
    assert fill(unwrapped) >= 0.55


def test_a_texel_is_as_large_on_the_surface_as_asked() -> None:
    plane = sheet(1.3, 0.7, 9)
    unwrapped = unwrap(plane, Settings(TEXEL_M))
    assert unwrapped.texel_m == TEXEL_M
    drawn = corners(unwrapped)
    at = plane.vertices[plane.faces].astype(np.float64)
    edges = np.linalg.norm(at - np.roll(at, 1, 1), axis=2)
    edges_drawn = np.linalg.norm(drawn - np.roll(drawn, 1, 1), axis=2) * TEXEL_M
    assert np.allclose(edges_drawn, edges, rtol=1e-3)


def test_a_bent_wall_unrolls_without_stretch() -> None:
    plane = sheet(1.0, 1.0, 16)
    x, y, _ = plane.vertices.T.astype(np.float64)
    bent = mesh(np.stack([np.sin(x), y, np.cos(x)], 1), plane.faces)
    unwrapped = unwrap(bent, Settings(TEXEL_M))
    ratio = np.abs(flat_areas(unwrapped)) / true_areas(bent)
    assert np.percentile(np.abs(ratio - 1), 95) < 0.05


@settings(deadline=None, max_examples=25)
@given(
    seed=st.integers(0, 10_000),
    faces=st.integers(1, 40),
    vertices=st.integers(3, 25),
    scale_m=st.sampled_from([0.02, 0.3, 3.0]),
)
def test_any_soup_of_triangles_keeps_every_promise(
    seed: int, faces: int, vertices: int, scale_m: float
) -> None:
    rng = np.random.default_rng(seed)
    soup = mesh(rng.random((vertices, 3)) * scale_m, rng.integers(0, vertices, (faces, 3)))
    check_promises(soup, unwrap(soup, Settings(TEXEL_M)))


def test_faces_without_area_and_loose_pieces_are_kept() -> None:
    plane = sheet(0.4, 0.4, 4)
    loose = mesh(
        np.concatenate([plane.vertices, plane.vertices[:3] + 2, [[5, 5, 5]]]),
        np.concatenate([plane.faces, [[0, 0, 1], [25, 26, 27], [28, 28, 28], [0, 1, 2]]]),
    )
    check_promises(loose, unwrap(loose, Settings(TEXEL_M)))


def test_one_face_is_a_tile_too() -> None:
    one = mesh([[0, 0, 0], [0.3, 0, 0], [0, 0.2, 0.1]], [[0, 1, 2]])
    check_promises(one, unwrap(one, Settings(TEXEL_M)))


def test_the_same_tile_gives_the_same_bytes() -> None:
    room = box_room(2.0, 10, 0.02)
    one, two = unwrap(room, Settings(TEXEL_M)), unwrap(room, Settings(TEXEL_M))
    assert one.uv.tobytes() == two.uv.tobytes()
    assert one.mesh.faces.tobytes() == two.mesh.faces.tobytes()
    assert one.texture_size == two.texture_size


def test_texels_grow_where_a_picture_would_exceed_the_largest() -> None:
    plane = sheet(60.0, 2.0, 4)
    unwrapped = unwrap(plane, Settings(TEXEL_M))
    check_promises(plane, unwrapped)
    assert TEXEL_M < unwrapped.texel_m < 2 * TEXEL_M


def test_no_face_is_an_error() -> None:
    with pytest.raises(StageError, match="at least 1 face, found 0"):
        unwrap(mesh(np.zeros((3, 3)), np.zeros((0, 3))), Settings(TEXEL_M))


def _unwrap_slivers(count: int) -> None:
    flat = sheet(1.0, 1.0, 40)
    at = np.arange(count) % (len(flat.vertices) - 1)
    slivers = np.stack([at, at, at + 1], axis=1)
    tile = mesh(flat.vertices, np.concatenate([flat.faces, slivers]))
    assert len(unwrap(tile, Settings(TEXEL_M)).mesh.faces) == len(flat.faces) + count


def test_thousands_of_faces_without_area_come_to_an_end() -> None:
    """A root of the demo at full size holds 1,559: xatlas never ended."""
    worker = multiprocessing.get_context("spawn").Process(target=_unwrap_slivers, args=(2000,))
    worker.start()
    worker.join(60)
    ended = worker.exitcode
    worker.kill()
    assert ended == 0
