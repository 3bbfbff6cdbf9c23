"""Where one stands who came through a door that says nothing of it."""

from __future__ import annotations

import numpy as np

from tourgen.build import inside_door


def test_who_comes_by_an_upper_door_stands_on_its_landing_and_looks_in() -> None:
    """The height was that of the room's entry: under the floor of an upper storey."""
    view = inside_door(np.array([2.0, 5.0, 4.3]), 3.2, np.array([0.0, 1.0]))
    np.testing.assert_allclose(view.position, [2.0, 4.1, 4.8])
    np.testing.assert_allclose(view.look_at, [2.0, 2.1, 4.8])
