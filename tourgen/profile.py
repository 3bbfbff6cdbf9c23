"""Profile: where the time of a build goes, as a flame graph that a browser opens."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import reduce
from importlib.util import find_spec
from pathlib import Path

from tourgen.errors import MissingTool

_EVERY_S = 0.005
_FONTS = re.compile(r"https://fonts\.googleapis\.com/[^)\"']*")
"""The page would ask another server for its letters."""


def require_profiler() -> None:
    """Refuse where the library is not installed.

    Raises:
        MissingTool: It is not.
    """
    if find_spec("pyinstrument") is None:
        raise MissingTool(
            "--profile: expected pyinstrument, found none",
            'python3 -m pip install "tourgen[profile]"',
        )


@contextmanager
def sampled(file: Path | None) -> Iterator[None]:
    """Look what runs, 200 times a second, and write it to a file; None: do not."""
    if file is None:
        yield
        return
    from pyinstrument import Profiler

    profiler = Profiler(interval=_EVERY_S)
    profiler.start()
    try:
        yield
    finally:
        session = profiler.stop()
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(session.to_json()), encoding="utf-8")


def write_flame_graph(files: Sequence[Path], page: Path) -> None:
    """Join what was sampled in several tasks.

    Args:
        files: As ``sampled`` wrote them, at least one.
        page: HTML.
    """
    from pyinstrument.renderers import HTMLRenderer
    from pyinstrument.session import Session

    sessions = (Session.from_json(json.loads(file.read_text("utf-8"))) for file in files)
    text = HTMLRenderer().render(reduce(Session.combine, sessions))
    page.write_text(_FONTS.sub("", text), encoding="utf-8")
