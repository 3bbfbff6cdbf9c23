"""The demo in miniature: its three rooms with fewer points and coarser detail."""

from __future__ import annotations

import shutil
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from tourgen.simulate import MODELS, Size, simulate_room, write_sea

DEMO = Path(__file__).parents[1] / "sites/lighthouse"
SIZE = Size(points=250_000, texture=1024, e57=False)
COARSE = "[room.surface]\ndetail_mm = 20\n[room.texture]\ntexel_mm = 12\n\n"


def write_miniature(folder: Path) -> None:
    """Write tour.toml, texts, scans and ground truth."""
    for name in ("texts", "images"):
        shutil.copytree(DEMO / name, folder / name)
    write_sea(folder)
    head, *rooms = (DEMO / "tour.toml").read_text(encoding="utf-8").split("[[room]]")
    coarse = (room.replace("[[room.link]]", f"{COARSE}[[room.link]]", 1) for room in rooms)
    (folder / "tour.toml").write_text("[[room]]".join([head, *coarse]), encoding="utf-8")
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        list(pool.map(_scan, MODELS, [folder] * len(MODELS)))


def _scan(room: str, folder: Path) -> None:
    simulate_room(MODELS[room](), folder, SIZE)
