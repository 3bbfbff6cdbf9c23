"""What was measured before, so that a second run asks only what is new."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from surface_score import Figures

from tourgen.geometry import UInt8


@dataclass(frozen=True)
class Ledger:
    """Figures and pictures of earlier runs.

    Attributes:
        folder: Where they are kept.
    """

    folder: Path

    def figures(self, key: str, measure: Callable[[], Figures]) -> Figures:
        """The figures noted under a key, measured if there are none."""
        file = self.folder / "figures" / f"{key}.json"
        if not file.exists():
            _write(file, json.dumps(measure(), indent=1).encode())
        found: Figures = json.loads(file.read_text(encoding="utf-8"))
        return found

    def pictures(self, key: str, take: Callable[[], list[UInt8]]) -> list[UInt8]:
        """The pictures kept under a key, taken if there are none."""
        from PIL import Image

        folder = self.folder / "pictures" / key
        if not (folder / "done").exists():
            folder.mkdir(parents=True, exist_ok=True)
            for number, picture in enumerate(take()):
                Image.fromarray(picture).save(folder / f"{number:02}.png")
            (folder / "done").touch()
        return [np.asarray(Image.open(file)) for file in sorted(folder.glob("*.png"))]


def digest(files: Iterable[Path]) -> str:
    """Of the contents of files, in the order given."""
    whole = hashlib.sha256()
    for file in files:
        whole.update(file.read_bytes())
    return whole.hexdigest()[:12]


def _write(file: Path, data: bytes) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    aside = file.with_name(f".{file.name}")
    aside.write_bytes(data)
    aside.rename(file)
