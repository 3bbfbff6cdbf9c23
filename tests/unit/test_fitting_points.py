"""What thinning is asked for must leave a room."""

import numpy as np
import pytest

from tourgen.errors import InputError
from tourgen.fitting.points import Thinning, thinned
from tourgen.geometry import PointCloud
from tourgen.stages.sift import Sifted
from tourgen.stages.spacing import spacing

POINTS = np.random.default_rng(0).uniform((0, 0, 0), (2, 1.5, 1), (3000, 3)).astype(np.float32)
CLOUD = PointCloud(np.zeros(3), POINTS, np.zeros((3000, 3), np.uint8), np.full(3000, -1, np.int16))


def test_a_detail_coarser_than_a_tenth_of_the_room_is_told_with_its_range():
    assert len(thinned(Sifted(CLOUD, {}), spacing(CLOUD), Thinning(150, 30))) > 1000
    with pytest.raises(InputError, match=r"surface.detail_mm: expected 1 to 200, a tenth of the"):
        thinned(Sifted(CLOUD, {}), spacing(CLOUD), Thinning(400, None))


def test_a_voxel_that_leaves_no_room_is_told_with_its_key():
    small = PointCloud(CLOUD.origin, CLOUD.points / 10, CLOUD.colors, CLOUD.station)
    assert len(thinned(Sifted(small, {}), spacing(small), Thinning(None, 10))) > 100
    with pytest.raises(InputError, match=r"100 points or more, found \d once .* 100 mm$") as told:
        thinned(Sifted(small, {}), spacing(small), Thinning(None, 100))
    assert "`clean.thin_mm`" in told.value.hint


@pytest.mark.parametrize("scale", [1e-3, 100])
def test_points_too_near_or_too_far_apart_are_told(scale):
    odd = PointCloud(CLOUD.origin, CLOUD.points * np.float32(scale), CLOUD.colors, CLOUD.station)
    with pytest.raises(InputError, match=r"expected points 0.1 to 1000 mm apart") as told:
        thinned(Sifted(odd, {}), spacing(odd), Thinning(None, None))
    assert "`unit`" in told.value.hint
