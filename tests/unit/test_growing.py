"""Growing: all cells that a surface enters, and no others, each corner once."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tourgen.geometry import Float32
from tourgen.sorting import distinct
from tourgen.stages.surface.growing import grown
from tourgen.stages.surface.marching_cubes import CELL_CORNERS, Keys, corner_of, key_of

CELL_M = 0.1
MIDDLE = 200


def places(key: Keys) -> Float32:
    return (corner_of(key) - MIDDLE).astype(np.float32) * np.float32(CELL_M)


def cell_at(*place_m: float) -> Keys:
    return key_of(np.array([np.floor(np.array(place_m) / CELL_M).astype(int) + MIDDLE]))


def entered(distance: Float32) -> bool:
    return bool(distance.min() <= 0 < distance.max())


@settings(deadline=None, max_examples=40)
@given(
    radius_m=st.floats(0.35, 1.5),
    shift=st.tuples(*[st.floats(-0.05, 0.05)] * 3),
    known=st.integers(0, 60),
)
def test_every_cell_that_a_sphere_enters_is_found(
    radius_m: float, shift: tuple[float, float, float], known: int
) -> None:
    asked: list[Keys] = []

    def distance(key: Keys) -> Float32:
        away = np.linalg.norm(places(key) - np.float32(shift), axis=1) - np.float32(radius_m)
        return np.asarray(away, np.float32)

    def told(key: Keys) -> Float32:
        asked.append(key)
        return distance(key)

    # A row of cells from within to without: the surface enters one of them.
    row = np.concatenate([cell_at(x, 0.01, 0.01) for x in np.arange(0.05, 2, CELL_M)])
    before = distinct(row[:, None] + CELL_CORNERS)[:known]
    found = grown(told, row, before, distance(before), 1.0)
    key, value = found.key, found.value
    assert not len(found.outside)
    assert (np.diff(key) > 0).all()
    assert (value == distance(key)).all()
    once = np.concatenate([*asked, before])
    assert len(np.unique(once)) == len(once) == len(key)
    side = np.arange(-18, 19) + MIDDLE
    cells = key_of(np.stack(np.meshgrid(side, side, side, indexing="ij"), -1).reshape(-1, 3))
    corners = cells[:, None] + CELL_CORNERS
    values = distance(corners.ravel()).reshape(corners.shape)
    crossed = (values.min(axis=1) <= 0) & (values.max(axis=1) > 0)
    assert set(distinct(corners[crossed])) <= set(key)


def test_it_does_not_cross_a_jump_or_what_is_unknown() -> None:
    def told(key: Keys) -> Float32:
        x, _, z = places(key).T
        value = np.where(x > 1.01, 9 * z, z).astype(np.float32)
        value[x < -1.01] = np.nan
        value[np.abs(places(key)[:, 1]) > 0.51] = np.nan
        return value

    found = grown(told, cell_at(0.01, 0.01, 0.01), *_nothing(), 0.15)
    x = places(found.key)[:, 0]
    assert -1.3 < x.min() < -0.95
    assert 0.95 < x.max() < 1.3


def _nothing() -> tuple[Keys, Float32]:
    return np.empty(0, np.int64), np.empty(0, np.float32)
