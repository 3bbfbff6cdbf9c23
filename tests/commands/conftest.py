"""A screen for a kiosk."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from screen import SCREEN, screen_of
from turns import alone, shared_folder


@pytest.fixture(scope="module")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Its name. Two kiosks at once, drawn by two cores, would each be judged by the other."""
    with alone(shared_folder(tmp_path_factory) / "screen.lock"), screen_of(*SCREEN) as name:
        yield name
